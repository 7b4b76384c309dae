"""Stairs, up and down, one foot on every step; they grow with the performer (``solver/scaling.py``)."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...conventions import SIDES
from ...curves import ramp
from ...randomness import Stream
from ..score import Foot, Plant, Score, Stairs
from .striding import Gait, striding
from .style import personal
from .walking import gait


def stairs(stream: Stream, frames: int, kind: str) -> Score:
    """``stairs_up``: the whole sole on the tread, the knee high, the body lifted over it;
    ``stairs_down``: toe first, the other knee giving way until it touches."""
    up = 1 if kind == "stairs_up" else -1
    tread, rise = stream.uniform(0.36, 0.44), up * stream.uniform(0.14, 0.185)
    drawn = gait(stream, frames, "steady", ((1.25, 1.65), (0.5, 0.5), (0.60, 0.64), (0.0,)))
    # treads lie along the axes of the floor's height field
    drawn = replace(drawn, turned=0.0, step=tread, heading=0.5 * np.pi * stream.choice((-1, 0, 1, 2)))
    steps = list(drawn.steps)
    first = stream.choice((steps[0] - 2, steps[0] - 2, steps[2], steps[3]))
    last = stream.choice((steps[-1] + 2, steps[-1] + 2, steps[-3]))
    top = max(-rise, 0.0) * (last - first)
    levels = {k: top + rise * (min(max(k, first), last) - first) for k in steps}
    risers = {k: 0.5 * tread * up * (levels[k + (up > 0)] != levels[k - (up < 0)]) for k in steps[1:-1]}
    feet = _feet(drawn, levels, risers, up)
    stairs = _stairs(drawn, tread, rise, first, last)
    usual = personal(stream, drawn.style, tread)
    carriage = replace(
        usual,
        low=0.036 if up > 0 else 0.035,
        bob=0.006,
        sway=0.032,
        lean=(0.08 if up > 0 else 0.0) + 0.6 * usual.lean,
        tilt=0.08,
        gaze=0.22 if up > 0 else 0.38,
        swing=0.6 * usual.swing,
        ahead=usual.ahead + (0.15 if up > 0 else 0.05),
        turn=0.08,
    )
    score = striding(stream, kind, drawn, feet, carriage, tread=tread, rise=rise)
    return replace(score, height=score.height + _lifted(drawn, levels, up), stairs=stairs)


def _middle(drawn: Gait, k: int) -> tuple[float, float]:
    """Position of the body's line over the k-th step."""
    return drawn.course.at(drawn.strike(k) + 0.30 * drawn.stride)[1]


def _stairs(drawn: Gait, tread: float, rise: float, first: int, last: int) -> Stairs:
    """Step ``first`` is the last one on the lower (upper) floor: the riser follows half a tread later."""
    x, z = _middle(drawn, drawn.steps[0])
    ahead = tread * (first - drawn.steps[0] + 0.5)
    edge = (x + ahead * float(np.sin(drawn.heading)), z + ahead * float(np.cos(drawn.heading)))
    return Stairs(edge, drawn.heading, tread, rise, last - first, max(-rise, 0.0) * (last - first))


def _feet(drawn: Gait, levels: dict[int, float], risers: dict[int, float], up: int) -> dict[str, Foot]:
    still, found = np.zeros(drawn.frames), {}
    for side in SIDES:
        mine = [k for k in drawn.steps if drawn.side(k) == side]
        plants = tuple(_plant(drawn, k, levels[k], risers.get(k, 0.0), up) for k in mine)
        found[side] = Foot(plants, still)
    return found


def _plant(drawn: Gait, k: int, level: float, riser: float, up: int) -> Plant:
    strike = round(drawn.strike(k))
    off = round(drawn.strike(k) + drawn.duty * drawn.stride)
    return Plant(
        place=_middle(drawn, k),
        width=0.8 * drawn.style.stance,
        heading=drawn.heading,
        toe_out=drawn.style.toe_out,
        strike=strike,
        flat=strike + max(round(0.09 * drawn.stride), 2),
        lift=off - max(round(0.22 * drawn.stride), 3),
        off=off,
        strike_pitch=0.18 if up > 0 else 0.30,
        off_pitch=0.70 if up > 0 else 0.42,
        lift_height=0.12 if up > 0 else 0.07,
        level=level,
        riser=riser,
    )


def _lifted(drawn: Gait, levels: dict[int, float], up: int) -> np.ndarray:
    """How the body rises over each step after the foot is on it, or sinks before it gets there."""
    t, steps, half = np.arange(drawn.frames, dtype=float), list(levels), 0.5 * drawn.stride
    begin, end = (0.10, 1.05) if up > 0 else (-0.70, 0.30)
    height = np.full(drawn.frames, levels[steps[0]])
    for before, k in pairwise(steps):
        at = drawn.strike(k)
        height += (levels[k] - levels[before]) * ramp(t, at + begin * half, at + end * half)
    return height
