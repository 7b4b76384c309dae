"""Which places of its own body a body's hands reach at all, measured by solving: at ease, or crouching."""

from __future__ import annotations

from functools import cache

import numpy as np

from .bodies import Body
from .places import LOW, place
from .reach import TOUCHES, gaps
from .score import SIDES, Foot, Hand, Plant, Score, Touch, Trunk
from .solver import solve

_FRAMES = 9
_EVER = 10_000


def able(body: Body, name: str, side: str) -> bool:
    """Whether the hand of a side can be put on a place (``left_hip``, ``right_head`` ...)."""
    return reach_of(body, name, side) <= TOUCHES


@cache
def reach_of(body: Body, name: str, side: str) -> float:
    """Metres by which the hand of a side falls short of a place, or must stay away from one too near.

    Measured on the solver's own answer: standing upright, the other hand before the belly; crouching for
    places on the legs.
    """
    scores = [_probe(name, side, *each) for each in _CROUCHING if place(name, body).part in LOW]
    scores = scores or [_probe(name, side, 0.99, 0.0)]
    return min(gaps(score, body, solve(score, body))[side, name] for score in scores)


_CROUCHING = ((0.7, 0.45), (0.5, 0.7))
"""Height of the hip joints, leg lengths, and lean of pelvis and spine each, radians."""


def _probe(name: str, side: str, height: float, bent: float) -> Score:
    """Holding still with one hand on a place."""
    still = np.zeros(_FRAMES)
    lean = np.zeros((_FRAMES, 3))
    lean[:, 1] = bent
    plant = Plant((0.0, 0.0), 1.2, 0.0, 0.15, -_EVER, -_EVER, _EVER, _EVER)
    return Score(
        kind="probe",
        heading=still,
        path=np.zeros((_FRAMES, 2)),
        sway=np.zeros((_FRAMES, 2)),
        height=still + height,
        balance=still + 1.0,
        support=still + 0.5,
        trunk=Trunk(lean, lean, 0.5 * lean),
        feet={each: Foot((plant,), still) for each in SIDES},
        hands={each: _hand((Touch(name, still + 1.0),) if each == side else ()) for each in SIDES},
    )


def _hand(touches: tuple[Touch, ...]) -> Hand:
    still = np.zeros(_FRAMES)
    before = np.tile([0.0, -0.35, 0.50], (_FRAMES, 1))
    return Hand(before, still + 0.5, still + 1.0, still, np.zeros((_FRAMES, 3)), touches)
