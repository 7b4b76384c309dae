"""The cast: people drawn from anthropometry, and caricatures, each with one of five rest poses.

Bodies marked ``held_out`` are in no training set, and neither is any body of ``h36m17``.
"""

from __future__ import annotations

from dataclasses import replace

from .proportions import ADULT, STATURE, drawn, human
from .structures import BODY22, BODY23, BODY28, H36M17, Body, Structure

_WOMAN, _WOMAN_SPREAD = STATURE["woman"]
_MAN, _MAN_SPREAD = STATURE["man"]


PEOPLE = {
    "dora": ("woman", ADULT, 120),
    "emil": ("man", ADULT, 56),
    "fay": ("woman", 8, 41),
    "gus": ("man", 12, 100),
    "hanna": ("woman", ADULT, 91),
    "igor": ("man", ADULT, 51),
    "jonas": ("man", ADULT, 61),
    "kira": ("woman", ADULT, 127),
    "leo": ("man", 10, 121),
    "mina": ("woman", 12, 30),
    "nils": ("man", ADULT, 100),
    "olga": ("woman", ADULT, 79),
    "petra": ("woman", ADULT, 135),
    "quinn": ("man", ADULT, 100),
    "rosa": ("woman", 10, 188),
    "bruno": ("man", ADULT, 167),
    "hugo": ("man", ADULT, 37),
    "ines": ("woman", ADULT, 97),
    "karl": ("man", ADULT, 198),
    "lena": ("woman", ADULT, 85),
    "jack": ("man", 8, 58),
}
"""Sex, age in years, and which draw under the name. Among people who are built alike copying is an answer,
so out of 200 draws under every name those were taken that make people most unlike in build (``families.py``),
all within the ellipsoid that holds 95 % of people: ``tests/benchmarks/puppets_people.py``."""


def _person(name: str, structure: Structure, rest: str, held_out: bool = False) -> Body:
    """Somebody drawn from the tables."""
    sex, age, number = PEOPLE[name]
    sizes = drawn(f"{name} {number}", sex, age)
    return Body(name, structure, sizes, rest, held_out or structure is H36M17)


def _odd(
    name: str, structure: Structure, rest: str, stature: float, held_out: bool = False, **factors: float
) -> Body:
    """A caricature: a man of this stature with some of his lengths multiplied. ``hunch``: shares of it."""
    hunch = factors.pop("hunch", 0.0) * stature
    sizes = replace(human("man", stature).scaled(**factors), hunch=hunch)
    return Body(name, structure, sizes, rest, held_out or structure is H36M17)


_BODY22 = (
    Body("ada", BODY22, human("woman", _WOMAN), rest="t_pose"),
    # a man with long thighs and forearms
    Body(
        "boris",
        BODY22,
        human("man", _MAN).scaled(thigh=1.04, shank=0.95, upper_arm=0.97, forearm=1.05),
        rest="along_x",
    ),
    _person("dora", BODY22, "a_pose"),
    _person("emil", BODY22, "z_up"),
    _person("fay", BODY22, "t_pose"),
    _person("gus", BODY22, "arms_down"),
    _person("hanna", BODY22, "along_x", held_out=True),
    _person("igor", BODY22, "t_pose", held_out=True),
    # big head and feet, short legs and arms
    _odd(
        *("pip", BODY22, "a_pose", 1.25),
        head=2.1,
        hand=1.2,
        girth=1.2,
        thigh=0.55,
        shank=0.65,
        ball=1.30,
        toes=1.30,
        heel=1.25,
        hip_half=1.25,
        upper_arm=0.88,
        forearm=0.78,
    ),
    # all limbs long and thin
    _odd(
        *("twig", BODY22, "t_pose", 1.80),
        thigh=1.22,
        shank=1.18,
        upper_arm=1.30,
        forearm=1.30,
        hand=1.25,
        trunk=0.85,
        girth=0.70,
        shoulder_half=0.85,
        hip_half=0.85,
        waist_half=0.80,
    ),
    # hunched over a broad trunk, arms to the knees
    _odd(
        *("gnarl", BODY22, "arms_down", 1.45, True),
        hunch=0.07,
        head=1.5,
        neck=0.8,
        hand=1.3,
        girth=1.35,
        thigh=0.80,
        shank=0.78,
        ball=1.15,
        toes=1.15,
        hip_half=1.25,
        waist_half=1.30,
        shoulder_half=1.35,
        upper_arm=1.15,
        forearm=1.20,
    ),
    # a mouse: an enormous head on a small trunk
    _odd(
        *("moppet", BODY22, "z_up", 1.10, True),
        head=2.5,
        neck=0.7,
        hand=1.4,
        trunk=0.85,
        thigh=0.70,
        shank=0.70,
        ball=1.10,
        toes=1.20,
        heel=1.15,
        hip_half=1.2,
        upper_arm=0.95,
        forearm=0.90,
    ),
)

_BODY28 = (
    # a tall woman with long shanks
    Body(
        "clara",
        BODY28,
        human("woman", _WOMAN + 2.0 * _WOMAN_SPREAD).scaled(thigh=0.97, shank=1.06, trunk=0.98),
        rest="t_pose",
    ),
    _person("jonas", BODY28, "a_pose"),
    _person("kira", BODY28, "z_up"),
    _person("leo", BODY28, "along_x"),
    _person("mina", BODY28, "t_pose"),
    _person("nils", BODY28, "along_x", held_out=True),
    _person("olga", BODY28, "arms_down", held_out=True),
    # very long arms over short, wide-set legs
    _odd(
        *("gibbon", BODY28, "a_pose", 1.50),
        upper_arm=1.45,
        forearm=1.65,
        hand=1.2,
        neck=0.8,
        thigh=0.80,
        shank=0.62,
        hip_half=1.3,
        waist_half=1.1,
        ball=1.2,
    ),
    # a giant: small head, broad chest, long shanks, small feet
    _odd(
        *("titan", BODY28, "along_x", 1.35 * (_MAN + 2.0 * _MAN_SPREAD)),
        head=0.72,
        girth=1.2,
        shoulder_half=1.45,
        trunk=1.10,
        hip_half=1.3,
        waist_half=1.15,
        thigh=0.86,
        shank=1.18,
        ball=0.75,
        toes=0.75,
        heel=0.75,
        upper_arm=1.15,
        forearm=0.95,
    ),
    # a goblin: stooped, large hands and feet
    _odd(
        *("grub", BODY28, "t_pose", 1.20),
        hunch=0.05,
        head=1.7,
        hand=1.5,
        ball=1.35,
        toes=1.35,
        thigh=0.85,
        shank=0.85,
        upper_arm=1.10,
        forearm=1.15,
        shoulder_half=1.10,
    ),
    # a vampire: tall and narrow, long hands, a slight stoop
    _odd(
        *("vesper", BODY28, "a_pose", 1.95, True),
        hunch=0.03,
        thigh=1.08,
        shank=1.12,
        trunk=0.92,
        upper_arm=1.05,
        forearm=1.12,
        hand=1.35,
        shoulder_half=0.92,
        waist_half=0.85,
        hip_half=0.90,
        girth=0.80,
    ),
    # a giant on short legs: all trunk and shoulders
    _odd(
        *("boulder", BODY28, "arms_down", 2.30, True),
        hunch=0.03,
        head=0.70,
        neck=0.7,
        trunk=1.15,
        thigh=0.72,
        shank=0.72,
        girth=1.35,
        shoulder_half=1.60,
        hip_half=1.35,
        waist_half=1.35,
        upper_arm=1.15,
        forearm=1.15,
        hand=1.2,
    ),
)

_BODY23 = (
    _person("petra", BODY23, "a_pose"),
    _person("quinn", BODY23, "t_pose"),
    _person("rosa", BODY23, "along_x"),
    _person("bruno", BODY23, "z_up", held_out=True),
    # broad and heavy, limbs a little short
    _odd(
        *("sumo", BODY23, "t_pose", 1.70),
        girth=1.5,
        shoulder_half=1.20,
        hip_half=1.25,
        waist_half=1.45,
        thigh=0.92,
        shank=0.90,
        upper_arm=0.98,
    ),
    # legs of a wading bird under a small trunk
    _odd(
        *("stork", BODY23, "arms_down", 1.75, True),
        thigh=1.25,
        shank=1.35,
        trunk=0.75,
        upper_arm=0.95,
        forearm=0.95,
        girth=0.75,
        hip_half=0.90,
        waist_half=0.85,
    ),
)

_H36M17 = (
    _person("hugo", H36M17, "t_pose"),
    _person("ines", H36M17, "along_x"),
    _person("karl", H36M17, "z_up"),
    _person("lena", H36M17, "a_pose"),
    _person("jack", H36M17, "arms_down"),
    # a bobblehead: all head on slight limbs
    _odd(
        *("bobble", H36M17, "t_pose", 1.30),
        head=1.9,
        thigh=0.85,
        shank=0.85,
        upper_arm=0.95,
        forearm=0.95,
        hip_half=1.1,
    ),
)

CAST = (*_BODY22, *_BODY28, *_BODY23, *_H36M17)
BODIES = {body.name: body for body in CAST}
