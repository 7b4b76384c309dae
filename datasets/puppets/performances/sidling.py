"""Steps that do not go forward: sideways, and turning on the spot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..curves import wander
from ..randomness import Stream
from ..score import Score
from .carriage import personal
from .gait import Course, Tread
from .striding import stepping, striding
from .style import seconds
from .walking import MODES, gait

_SIDEWAYS = Tread(
    landing=(0.16, 0.10),
    leaving=(0.26, 0.20),
    flat=0.09,
    peel=(0.12, 0.0),
    lift=(0.04, 0.02),
    width=1.75,
    under=0.30,
)
_ON_THE_SPOT = Tread(
    landing=(0.20, 0.0),
    leaving=(0.42, 0.0),
    flat=0.10,
    peel=(0.14, 0.0),
    lift=(0.045, 0.02),
    width=1.0,
    under=0.30,
)


def walk_sideways(stream: Stream, frames: int, mode: str = "") -> Score:
    """One foot steps aside, the other follows up to it; eyes forward or where it goes."""
    to = stream.sign()
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.5, 2.1),
        step=(0.14, 0.24),
        duty=(0.60, 0.66),
        turns=(0.0, 0.0, 0.3),
        bearing=0.5 * np.pi * to,
    )
    # the foot in front of the way goes first
    drawn = replace(drawn, lead="left" if to > 0 else "right")
    course = Course.of(drawn)
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=stream.uniform(0.03, 0.09),
        bob=0.012,
        sway=0.0,
        lean=0.04 + 0.7 * usual.lean,
        drop=0.05,
        swing=0.0,
        aside=stream.uniform(0.05, 0.30),
    )
    score = striding(stream, "walk_sideways", drawn, course, stepping(drawn, course, _SIDEWAYS), carriage)
    return _looking(stream, score, 0.55 * to * stream.choice((0.0, 1.0)))


def turn(stream: Stream, frames: int, mode: str = "") -> Score:
    """Round on the spot in small steps, the eyes first."""
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.4, 1.9),
        step=(0.0, 0.0),
        duty=(0.62, 0.68),
        turns=(1.8, 2.6, 3.4),
    )
    drawn = replace(drawn, lead="left" if drawn.turned > 0.0 else "right")
    course = _turning(Course.of(drawn), drawn.turned, frames)
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=0.018,
        bob=0.008,
        sway=0.038,
        drop=0.0,
        turn=0.0,
        tilt=0.02,
        lean=0.5 * usual.lean,
        swing=0.3 * usual.swing,
    )
    score = striding(stream, "turn", drawn, course, stepping(drawn, course, _ON_THE_SPOT), carriage)
    return _stepping_arms(stream, score)


def _turning(course: Course, turned: float, frames: int) -> Course:
    """The same course, turning only while the feet step."""
    rate = course.activity * turned / frames
    heading = np.cumsum(rate)
    return replace(course, heading=heading - heading[len(heading) // 2] + course.heading[len(heading) // 2])


def _looking(stream: Stream, score: Score, aside: float) -> Score:
    gaze = score.trunk.gaze.copy()
    gaze[:, 0] += aside + wander(stream, seconds(score.frames), 0.08)
    return replace(score, trunk=replace(score.trunk, gaze=gaze))


def _stepping_arms(stream: Stream, score: Score) -> Score:
    """Arms that are flung outward a little by the turning."""
    size = stream.uniform(0.03, 0.10)
    hands = {
        side: replace(hand, reach=hand.reach + np.array([size, 0.02 * size, 0.0]))
        for side, hand in score.hands.items()
    }
    return replace(score, hands=hands)
