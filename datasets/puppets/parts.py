"""The parts of the corpus, and what is kept out of training for good."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Literal

from .bodies import Body
from .families import Family, families

Part = Literal["train", "validation", "test"]

HELD_OUT_STRUCTURES = ("h36m17",)
"""None of their bodies is in training or validation."""

HELD_OUT_KINDS = (
    "limp",
    "sideways",
    "lunge",
    "kick_side",
    "catch",
    "touch_toe",
    "salute",
    "dance_b",
    "trot",
)
"""Kinds of performance that only the test has; those that there are."""


def held_out(body: Body) -> bool:
    """Whether a body is only in the test."""
    return body.structure.name in HELD_OUT_STRUCTURES or bool(getattr(body, "held_out", False))


def bodies(family: Family, part: Part) -> tuple[str, ...]:
    """Names of the bodies of a family in a part, in their order."""
    return tuple(name for name, body in family.bodies.items() if part == "test" or not held_out(body))


def kinds(family: Family, part: Part) -> tuple[str, ...]:
    """The kinds of a family in a part, in their order."""
    return tuple(kind for kind in family.kinds if part == "test" or kind not in HELD_OUT_KINDS)


@cache
def training_manifest() -> dict[str, Sequence[str]]:
    """What whoever trains on the puppets has seen: characters, structures and kinds."""
    seen = [family.bodies[name] for family in families() for name in bodies(family, "train")]
    return {
        "characters": [body.name for body in seen],
        "structures": list(dict.fromkeys(body.structure.name for body in seen)),
        "kinds": [kind for family in families() for kind in kinds(family, "train")],
    }
