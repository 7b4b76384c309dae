"""Families: bodies with their kinds of performance, parts of the corpus, and how unlike bodies are."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Literal

import numpy as np

from ..bodies.characters import BODIES, DOGS
from ..bodies.proportions import Proportions
from ..bodies.structures import Body
from ..performances.dogs import KINDS as DOG_KINDS
from ..performances.people import KINDS, STRUNG, sequence
from ..performances.score import Score
from ..randomness import Stream

HELD_OUT_STRUCTURES = ("h36m17",)
"""None of their bodies is trained on; of the other structures, bodies say so themselves."""

VALIDATION_BODIES = ("dora", "grub", "quinn", "fox")
"""One body of each other structure, none of the extreme ones, that training goes without so that it can be
steered by how it does on them. What was chosen by them has seen them: for the test they are not new."""

HELD_OUT_KINDS = (
    "limp",
    "walk_sideways",
    "stairs_down",
    "hop",
    "lunge",
    "kick_side",
    "catch",
    "salute",
    "dance_line",
    "shake_paw",
)
"""Kinds of performance that only the test has; sequences, too, do without them."""


@dataclass(frozen=True, eq=False)
class Family:
    """kinds: kind -> what draws a performance of so many frames. sequence: the kind that strings several
    others together, of which the long clips are."""

    name: str
    bodies: Mapping[str, Body]
    kinds: Mapping[str, Callable[[Stream, int], Score]]
    sequence: str


@cache
def families() -> tuple[Family, ...]:
    """People first."""
    trained = [kind for kind in STRUNG if kind not in HELD_OUT_KINDS]
    kinds: dict[str, Callable[[Stream, int], Score]] = {
        **KINDS,
        "sequence": partial(sequence, among=trained),
    }
    return (
        Family("people", BODIES, kinds, "sequence"),
        Family("dogs", DOGS, DOG_KINDS, "dog_sequence"),
    )


@cache
def everybody() -> Mapping[str, Body]:
    """The bodies of all families by name."""
    return {name: body for family in families() for name, body in family.bodies.items()}


@cache
def family_of(kind: str) -> Family:
    """The family that performs a kind."""
    return next(each for each in families() if kind in each.kinds)


@cache
def family_of_structure(structure: str) -> Family:
    """The family whose bodies have a structure."""
    return next(
        each for each in families() if any(b.structure.name == structure for b in each.bodies.values())
    )


Part = Literal["train", "validation", "test"]


def only_tested(body: Body) -> bool:
    """True for a body that is only in the test."""
    return body.held_out or body.structure.name in HELD_OUT_STRUCTURES


def bodies_of(family: Family, part: Part) -> tuple[str, ...]:
    """Names of the bodies of a family in a part, in their order."""
    aside = VALIDATION_BODIES if part == "train" else ()
    names = tuple(name for name, body in family.bodies.items() if part == "test" or not only_tested(body))
    return tuple(name for name in names if name not in aside)


def kinds_of(family: Family, part: Part) -> tuple[str, ...]:
    """The kinds of a family in a part, in their order."""
    return tuple(kind for kind in family.kinds if part == "test" or kind not in HELD_OUT_KINDS)


@cache
def training_manifest() -> dict[str, Sequence[str]]:
    """Characters, structures and kinds that training on the puppets sees. ``validation``: those
    of the characters that only steered the training."""
    bodies = [family.bodies[name] for family in families() for name in bodies_of(family, "validation")]
    return {
        "characters": [body.name for body in bodies],
        "validation": list(VALIDATION_BODIES),
        "structures": list(dict.fromkeys(body.structure.name for body in bodies)),
        "kinds": [kind for family in families() for kind in kinds_of(family, "train")],
    }


RATIOS: Mapping[str, Callable[[Proportions], float]] = {
    "thigh to shank": lambda p: p.thigh / p.shank,
    "leg to trunk": lambda p: p.leg / p.trunk,
    "arm to trunk": lambda p: p.arm / p.trunk,
    "upper arm to forearm": lambda p: p.upper_arm / p.forearm,
    "hips to leg": lambda p: p.hip_half / p.leg,
    "shoulders to trunk": lambda p: p.shoulder_half / p.trunk,
    "foot to leg": lambda p: p.ball / p.leg,
    "ankle to leg": lambda p: p.ankle / p.leg,
    "head to trunk": lambda p: p.head / p.trunk,
}
"""Chosen by lengths of the skeleton alone, not by any method's answers."""


def build(sizes: Proportions) -> np.ndarray:
    """``(ratios,)`` logarithms of a body's ratios."""
    return np.log([ratio(sizes) for ratio in RATIOS.values()])


@cache
def unlikeness(family: Family) -> Mapping[tuple[str, str], int]:
    """Two bodies of a family -> how unlike they are, in hundredths: the root mean square difference of
    their builds, each ratio in units of its standard deviation among the family. Whole numbers, so that
    lists which depend on them are the same everywhere."""
    names = list(family.bodies)
    builds = np.array([build(body.proportions) for body in family.bodies.values()])
    scaled = builds / builds.std(axis=0)
    apart = np.sqrt(((scaled[:, None] - scaled) ** 2).mean(axis=-1))
    hundredths = np.rint(100.0 * apart).astype(int).tolist()
    return {(a, b): hundredths[i][j] for i, a in enumerate(names) for j, b in enumerate(names)}
