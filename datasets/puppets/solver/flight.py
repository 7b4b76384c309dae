"""Flight: from the last touch of the floor to the next the centre of mass falls as thrown things do.

The score's height has the parabola of a flight in it; gravity is the same in leg lengths for every body
(``scaling.py``).
"""

from collections.abc import Sequence

import numpy as np

from ..bodies.structures import Body
from ..performances.score import Score
from .feet import FootPath
from .limbs import centre_of_mass


def bridged(score: Score, wanted: np.ndarray, reached: np.ndarray) -> np.ndarray:
    """Heights ``(frames,)`` as ``reached``, but in flights as ``wanted``, moved so that both ends fit."""
    if not score.flights:
        return reached
    return _chords(score.flights, reached - wanted, reached - wanted) + wanted


def fall(score: Score, body: Body, positions: np.ndarray) -> np.ndarray:
    """How far the pelvis must be off its own course ``(frames,)``, metres, for the centre of mass to fall
    freely, in a pose with joints at ``positions`` ``(frames, joints, 3)``."""
    if not score.flights:
        return np.zeros(score.frames)
    hips = 0.5 * (positions[:, body.part["left_up_leg"], 1] + positions[:, body.part["right_up_leg"], 1])
    above = centre_of_mass(body, positions)[:, 1] - hips
    # outside of flights the line is the curve itself
    return _chords(score.flights, above, above) - above


def carried_over(score: Score, under: np.ndarray) -> np.ndarray:
    """Places ``(frames, 2)`` under which the body is borne, in flights on the straight line between."""
    if not score.flights:
        return under
    return np.stack([_chords(score.flights, row, row) for row in under.T], axis=-1)


def unbound(score: Score, side: str, foot: FootPath, body: Body) -> np.ndarray:
    """How much higher ``(frames,)`` than this foot's place allows the pelvis may go, metres: a foot that is
    thrown along with the body, or carried, holds nothing down."""
    free = np.zeros(score.frames)
    if score.flights:
        free = np.where(foot.swinging, 1.0, free)
    air = score.feet[side].air
    if air is not None:
        free = np.maximum(free, air.weight)
    return 0.5 * body.proportions.leg * free


def _chords(flights: Sequence[tuple[int, int]], outside: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """``outside`` ``(frames,)``, but in flights the straight line between the values of ``ends`` at both
    ends; a flight that a clip cuts off keeps the value at the end that is there."""
    line, frames = outside.copy(), np.arange(len(outside))
    for off, strike in flights:
        inside = (frames > off) & (frames < strike)
        first, last = max(off, 0), min(strike, len(frames) - 1)
        values = ends[[first if off >= 0 else last, last if strike < len(frames) else first]]
        line[inside] = values[0] + (values[1] - values[0]) * (frames[inside] - off) / (strike - off)
    return line
