"""Scores for four legs: what ``..score`` says, and what a dog has beside it.

Of ``Score``, ``path`` is of the middle of the trunk in lengths of the hind leg (hip joint to floor,
standing); ``height`` of the hip joints: 1 standing, 0 lying; ``trunk.pelvis`` turns the rump alone,
``trunk.chest`` is the bend of the back (turn to the left, arched up, rolled to the left), ``trunk.gaze`` of
the head against the heading of the fore body. There are no ``feet``, and hands touch nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..score import SIDES, Hand, Score

LIMBS = tuple(f"{side}_{end}" for end in ("hind", "fore") for side in SIDES)
"""In the order of ``dogs.PAWS``."""


@dataclass(frozen=True)
class PawPlant:
    """One stay of a paw on the floor.

    moment: the frame whose place and heading of rump or shoulders it is measured from; may lie between
            frames and outside the clip.
    out, ahead: from where the paw of a standing body is: in half widths outward, in hind leg lengths.
    lain: 1 where the paw of a body that lies or sits is, 0 where that of a standing one is.
    strike, flat, lift, off: first frame down, first and last frame at rest, last frame down.
    strike_pitch, rest, off_pitch: how far it is rolled forward about its tip at first touch, at rest and at
            last touch, radians.
    lift_height: clearance of the swing that follows, hind leg lengths. curl: how far the paw hangs back
            in it, radians.
    """

    moment: float
    out: float
    ahead: float
    strike: int
    flat: int
    lift: int
    off: int
    strike_pitch: float = -0.2
    rest: float = 0.0
    off_pitch: float = 0.6
    lift_height: float = 0.12
    curl: float = 0.6
    lain: float = 0.0


@dataclass(frozen=True, eq=False)
class PawAir:
    """A fore paw held up. reach: ``(frames, 3)`` (out, up, forward) from the shoulder joint to the carpus,
    lengths of the fore leg. weight: ``(frames,)`` 1 where it goes there; 0 while it is down."""

    reach: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class Paw:
    """plants: in time order. flat: ``(frames,)`` 1 where the joint over the paw rests on the floor too."""

    plants: tuple[PawPlant, ...]
    flat: np.ndarray
    air: PawAir | None = None


@dataclass(frozen=True, eq=False)
class DogScore(Score):
    """A performance on four legs, at 30 frames per second.

    fore:   ``(frames,)`` height of the shoulder joints: 1 standing, 0 lying.
    anchor: ``(frames,)`` where the trunk is held while its length is shared: 0 the rump, 1 the shoulders.
    neck:   ``(frames,)`` how far the neck is lowered from where a standing dog carries it, radians.
    tail:   ``(frames, 4)`` raised and turned to the left, first and second bone, radians.
    spread: ``(frames, 2)`` how far knees and elbows are turned outward, radians.
    """

    fore: np.ndarray = field(default_factory=lambda: np.zeros(0))
    anchor: np.ndarray = field(default_factory=lambda: np.zeros(0))
    neck: np.ndarray = field(default_factory=lambda: np.zeros(0))
    tail: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    spread: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    paws: Mapping[str, Paw] = field(default_factory=dict)


def idle_hands(frames: int) -> dict[str, Hand]:
    """Hands that touch nothing."""
    still = np.zeros(frames)
    return {side: Hand(np.zeros((frames, 3)), still, still, still, np.zeros((frames, 3))) for side in SIDES}
