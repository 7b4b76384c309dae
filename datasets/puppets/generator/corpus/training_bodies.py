"""Training bodies drawn at random: people by the published statistics, and caricatures and dogs around the
cast's.

Nobody of them is built like a body that the test or the validation part holds out, and none is of a
structure that only the test has.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from ..bodies import rigs
from ..bodies.characters import MIDDLING_DOG
from ..bodies.dogs import DOG21, dog
from ..bodies.proportions import ADULT, Proportions, drawn, human
from ..bodies.structures import BODY22, BODY23, BODY28, Body, Structure
from ..randomness import Stream
from .families import VALIDATION_BODIES, build, everybody, only_tested

VERSION = "1"
"""Moves when any drawn body does."""

STRUCTURES: tuple[Structure, ...] = (BODY22, BODY28, BODY23, BODY22, BODY28, BODY23, DOG21)
"""Of the bodies in turn."""
_AGES = (ADULT, ADULT, ADULT, ADULT, 12, 10, 8, 6)
_CARICATURES = 0.5
"""Share of the people."""
LEAST_UNLIKE = 0.05
"""As a share: the least that some ratio of lengths differs by from those of any held-out body."""
_GIRTH = 0.12
"""Standard deviation of the thickness of limbs among people, share of the mean; ours, since ``drawn`` makes
all people of a stature equally thick."""


@cache
def training_bodies(seed: int, number: int) -> Mapping[str, Body]:
    """The first ``number`` bodies of an endless list that belongs to a seed, by name."""
    bodies = (_acceptable(seed, place) for place in range(number))
    return {body.name: body for body in bodies}


@cache
def _acceptable(seed: int, place: int) -> Body:
    """The first draw for a place of the list that is not like a held-out body."""
    structure = STRUCTURES[place % len(STRUCTURES)]
    name = f"{structure.name}_{place:04d}"
    stream = Stream("puppets", seed, "training body", VERSION, place)
    rest = stream.choice(rigs.RESTS)
    if structure is DOG21:
        draw: Callable[[Stream], Proportions] = _dog
    else:
        draw = _caricature if stream.uniform(0.0, 1.0) < _CARICATURES else _person
    while True:
        sizes = draw(stream)
        if _unlikeness(sizes) >= LEAST_UNLIKE:
            return Body(name, structure, sizes, rest)


def _unlikeness(sizes: Proportions) -> float:
    """The largest difference of any ratio to the held-out body that is most alike."""
    return float(np.abs(build(sizes) - _held_out()).max(axis=1).min())


@cache
def _held_out() -> np.ndarray:
    """``(bodies, ratios)``: the builds of all bodies that are not trained on."""
    bodies = everybody().values()
    untrained = [body for body in bodies if only_tested(body) or body.name in VALIDATION_BODIES]
    return np.array([build(body.proportions) for body in untrained])


def _person(stream: Stream) -> Proportions:
    """A person of the published statistics, of any thickness."""
    sex, age = stream.choice(("woman", "man")), stream.choice(_AGES)
    proportions = drawn(f"{stream.name} {stream.uniform(0.0, 1.0):.12f}", sex, age)
    thick = math.exp(stream.normal(_GIRTH))
    return replace(
        proportions, girth=thick * proportions.girth, waist_half=math.sqrt(thick) * proportions.waist_half
    )


def _caricature(stream: Stream) -> Proportions:
    """A mean woman or man of any size, exaggerated by any amount.

    Bones of a limb go together for the larger part. Spreads are such that the cast's caricatures lie
    well inside.
    """
    much = stream.uniform(0.3, 1.0)
    stature = math.exp(stream.uniform(math.log(0.9), math.log(2.6)))
    body = human(stream.choice(("woman", "man")), stature)

    def factors(common: float, own: float, *names: str) -> dict[str, float]:
        shared = stream.normal(common)
        return {name: math.exp(much * (shared + stream.normal(own))) for name in names}

    sizes = {
        **factors(0.28, 0.10, "thigh", "shank"),
        **factors(0.30, 0.10, "upper_arm", "forearm"),
        **factors(0.25, 0.06, "ball", "toes", "heel"),
        **factors(0.25, 0.08, "hip_half", "waist_half"),
        **factors(0.28, 0.0, "shoulder_half"),
        **factors(0.15, 0.0, "trunk"),
        **factors(0.15, 0.0, "neck"),
        **factors(0.18, 0.0, "hand"),
        **factors(0.30, 0.0, "girth"),
        **factors(0.45, 0.0, "head"),
    }
    # the smaller a drawn figure is, the larger its head, as in children
    sizes["head"] *= (1.7 / stature) ** 0.5
    hunch = stature * stream.uniform(0.0, 0.07) if stream.uniform(0.0, 1.0) < 0.25 else 0.0
    return replace(body.scaled(**sizes), hunch=hunch)


def _dog(stream: Stream) -> Proportions:
    """A dog of any size, from a middling build to a caricature; fore and hind legs go together."""
    much = stream.uniform(0.15, 1.0)
    withers = math.exp(stream.uniform(math.log(0.2), math.log(0.85)))

    def factor(spread: float) -> float:
        return math.exp(much * stream.normal(spread))

    legs = math.exp(-abs(much * stream.normal(0.30)) if stream.uniform(0.0, 1.0) < 0.5 else 0.0)
    sizes = {
        name: legs * factor(0.05)
        for name in ("thigh", "shank", "ankle", "upper_arm", "forearm", "hand", "blade")
    }
    sizes["blade"] /= math.sqrt(legs)
    spreads = {
        "ball": 0.25,
        "hip_half": 0.18,
        "shoulder_half": 0.18,
        "trunk": 0.12,
        "neck": 0.20,
        "head": 0.30,
        "girth": 0.20,
        "tail": 0.30,
    }
    return dog(MIDDLING_DOG, withers, **sizes, **{name: factor(spread) for name, spread in spreads.items()})
