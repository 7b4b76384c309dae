"""The parts of the corpus, and what is kept out of training for good."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Literal

from . import held_out as keep
from .bodies import Body
from .families import Family, families

Part = Literal["train", "validation", "test"]


def held_out(body: Body) -> bool:
    """Whether a body is only in the test."""
    return body.held_out or body.structure.name in keep.STRUCTURES


def bodies(family: Family, part: Part) -> tuple[str, ...]:
    """Names of the bodies of a family in a part, in their order."""
    aside = keep.ASIDE if part == "train" else ()
    found = tuple(name for name, body in family.bodies.items() if part == "test" or not held_out(body))
    return tuple(name for name in found if name not in aside)


def kinds(family: Family, part: Part) -> tuple[str, ...]:
    """The kinds of a family in a part, in their order."""
    return tuple(kind for kind in family.kinds if part == "test" or kind not in keep.KINDS)


@cache
def training_manifest() -> dict[str, Sequence[str]]:
    """What whoever trains on the puppets has seen: characters, structures and kinds. ``validation``: those
    of the characters that only steered the training."""
    seen = [family.bodies[name] for family in families() for name in bodies(family, "validation")]
    return {
        "characters": [body.name for body in seen],
        "validation": list(keep.ASIDE),
        "structures": list(dict.fromkeys(body.structure.name for body in seen)),
        "kinds": [kind for family in families() for kind in kinds(family, "train")],
    }
