"""Who performs what: bodies that share their kinds of performance and a solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from . import held_out
from .bodies import Body
from .characters import BODIES
from .performances import KINDS, STRUNG, sequence
from .quadruped import solver as dog_solver
from .quadruped.dogs import KENNEL
from .quadruped.kinds import KINDS as DOG_KINDS
from .randomness import Stream
from .reach import out_of_reach
from .score import Score
from .solver import Manner, Solution, solve

SECOND = Manner(knees=0.5, elbows=0.17, lower_back=0.08, collar=0.75, pelvis=0.15, ahead=0.1)
"""The manner of the second answer: other planes of knees and elbows, other shares of pelvis, spine and
collar bones in what the trunk does, and balance kept farther forward. As far from the usual manner as goes
unnoticed: whoever sees only the performance would call it the same."""


@dataclass(frozen=True, eq=False)
class Family:
    """kinds: kind -> what draws a performance of so many frames. solve: a score on a body, in the usual
    manner or in ``second``. short_of: what of a score a body cannot reach, and by how many metres."""

    name: str
    bodies: Mapping[str, Body]
    kinds: Mapping[str, Callable[[Stream, int], Score]]
    solve: Callable[..., Solution]
    second: Any
    short_of: Callable[[Score, Body, Solution], Mapping[str, float]]
    sequence: str = "sequence"
    """The kind that strings several others together, of which the long clips are."""


@cache
def families() -> tuple[Family, ...]:
    """People first."""
    kinds: dict[str, Callable[[Stream, int], Score]] = {
        **KINDS,
        "sequence": partial(sequence, among=_seen(STRUNG)),
    }
    return (
        Family("people", BODIES, kinds, solve, SECOND, out_of_reach),
        Family(
            "dogs",
            KENNEL,
            DOG_KINDS,
            dog_solver.solve,
            dog_solver.SECOND,
            _nothing,
            sequence="dog_sequence",
        ),
    )


def _nothing(score: Score, body: Body, solution: Solution) -> Mapping[str, float]:
    """Dogs touch nothing but the floor."""
    del score, body, solution
    return {}


def _seen(names: Sequence[str]) -> tuple[str, ...]:
    """Kinds that sequences may have, since training has them too."""
    return tuple(name for name in names if name not in held_out.KINDS)


@cache
def family_of(kind: str) -> Family:
    """The family that performs a kind."""
    return next(each for each in families() if kind in each.kinds)
