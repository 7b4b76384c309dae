"""Who performs: people drawn from anthropometry, and caricatures; five ways of drawing a rest pose.

Those marked ``held_out`` are in no training set, and neither is anybody of ``h36m17``.
"""

from __future__ import annotations

from dataclasses import replace

from .anthropometry import ADULT, STATURE, drawn, human
from .bodies import Body
from .structures import BODY22, BODY23, BODY28, H36M17, Structure

_WOMAN, _WOMAN_SPREAD = STATURE["woman"]
_MAN, _MAN_SPREAD = STATURE["man"]


def _person(
    name: str, structure: Structure, rest: str, sex: str, age: int = ADULT, held_out: bool = False
) -> Body:
    """Somebody drawn from the tables; the name decides who it is."""
    return Body(name, structure, drawn(name, sex, age), rest, held_out or structure is H36M17)


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
    _person("dora", BODY22, "a_pose", "woman"),
    _person("emil", BODY22, "z_up", "man"),
    _person("fay", BODY22, "t_pose", "woman", age=8),
    _person("gus", BODY22, "arms_down", "man", age=12),
    _person("hanna", BODY22, "along_x", "woman", held_out=True),
    _person("igor", BODY22, "t_pose", "man", held_out=True),
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
    _person("jonas", BODY28, "a_pose", "man"),
    _person("kira", BODY28, "z_up", "woman"),
    _person("leo", BODY28, "along_x", "man", age=10),
    _person("mina", BODY28, "t_pose", "woman", age=12),
    _person("nils", BODY28, "along_x", "man", held_out=True),
    _person("olga", BODY28, "arms_down", "woman", held_out=True),
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
    _person("petra", BODY23, "a_pose", "woman"),
    _person("quinn", BODY23, "t_pose", "man"),
    _person("rosa", BODY23, "along_x", "woman", age=10),
    _person("bruno", BODY23, "z_up", "man", held_out=True),
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
    _person("hugo", H36M17, "t_pose", "man"),
    _person("ines", H36M17, "along_x", "woman"),
    _person("karl", H36M17, "z_up", "man"),
    _person("lena", H36M17, "a_pose", "woman"),
    _person("jack", H36M17, "arms_down", "man", age=8),
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
