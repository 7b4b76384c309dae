"""What all performances on the spot share: a stance, shifts of weight, heels that lift, small steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..curves import plateau, ramp, through
from ..randomness import Stream
from ..score import SIDES, Foot, Plant, sign
from .style import Style

EVER = 10_000
"""A frame after every clip's end."""


@dataclass(frozen=True, eq=False)
class Stance:
    """Feet on the spot. heading: ``(frames,)``. support: ``(frames,)`` share of the weight on the left."""

    heading: np.ndarray
    feet: Mapping[str, Foot]
    support: np.ndarray

    @property
    def tip(self) -> np.ndarray:
        """``(frames,)`` -1 to 1: how far the weight is on the left rather than on the right."""
        return 2.0 * self.support - 1.0

    def moved(self, side: str, foot: Foot, support: np.ndarray) -> Stance:
        """With another course of one foot, and of the weight."""
        return replace(self, feet={**self.feet, side: foot}, support=support)


def stance(heading: float, style: Style, frames: int, support: np.ndarray, width: float) -> Stance:
    """Both feet side by side for the whole clip. width: half hip widths."""
    plant = Plant(
        place=(0.0, 0.0),
        width=width,
        heading=heading,
        toe_out=style.toe_out,
        strike=-EVER,
        flat=-EVER,
        lift=EVER,
        off=EVER,
    )
    feet = {side: Foot((plant,), np.zeros(frames)) for side in SIDES}
    return Stance(np.full(frames, heading), feet, support)


def shifting(stream: Stream, frames: int, size: float) -> np.ndarray:
    """Weight that goes from one foot to the other every second or two; ``size`` up to 0.5."""
    times, values = [-40.0], [0.5]
    direction = stream.sign()
    while times[-1] < frames + 60:
        times.append(times[-1] + stream.uniform(24.0, 60.0))
        values.append(0.5 + direction * size * stream.uniform(0.4, 1.0))
        direction = -direction
    return through(np.arange(frames, dtype=float), times, values)


def lift_heel(feet: Stance, side: str, start: int, end: int, angle: float) -> Stance:
    """The heel of the foot that bears little weight rises and comes down; its toe stays planted."""
    t = np.arange(len(feet.support), dtype=float)
    rise = min(12.0, 0.4 * (end - start))
    foot = feet.feet[side]
    heel = foot.heel + angle * plateau(t, start, start + rise, end - rise, end)
    return feet.moved(side, replace(foot, heel=heel), _relieved(feet, side, start, end, 0.6))


STEP = 18
"""Frames from lifting a heel to the sole's being flat again, in a small step."""


def small_step(
    feet: Stance,
    side: str,
    start: int,
    ahead: float = 0.0,
    wider: float = 0.0,
    turned: float = 0.0,
    lasting: int = STEP,
) -> Stance:
    """One foot is lifted, toe last, and set down elsewhere, toe first, while the other bears the weight.

    ahead: leg lengths. wider: half hip widths outward. turned: radians, of the foot and of its place
    around the body. lasting: frames from lifting the heel to the sole's being flat again.
    """
    foot = feet.feet[side]
    last = foot.plants[-1]
    off, strike, flat = start + 5, start + lasting - 4, start + lasting
    # a foot that goes back is not pushed off
    pitch = (0.45 if ahead >= 0.0 else 0.15) * STEP / lasting
    leaving = replace(last, lift=start, off=off, off_pitch=pitch, lift_height=0.06)
    heading = last.heading + turned
    x, z = last.place
    landing = replace(
        last,
        place=(x + ahead * float(np.sin(heading)), z + ahead * float(np.cos(heading))),
        width=last.width + wider,
        heading=heading,
        strike=strike,
        flat=flat,
        strike_pitch=0.20,
    )
    plants = (*foot.plants[:-1], leaving, landing)
    return feet.moved(side, replace(foot, plants=plants), _relieved(feet, side, start, flat, 0.95))


def step_to(
    feet: Stance, side: str, start: int, place: tuple[float, float], heading: float, lasting: int
) -> Stance:
    """One foot goes within so many frames to its place beside a middle (leg lengths), toe first, as in a
    dance. The weight is left to the caller."""
    foot = feet.feet[side]
    last = foot.plants[-1]
    off, flat = start + max(round(0.28 * lasting), 3), start + lasting - 1
    leaving = replace(last, lift=start, off=off, off_pitch=0.40, lift_height=0.05)
    landing = replace(last, place=place, heading=heading, strike=flat - 3, flat=flat, strike_pitch=0.16)
    return feet.moved(side, replace(foot, plants=(*foot.plants[:-1], leaving, landing)), feet.support)


def turn(feet: Stance, start: int, angle: float) -> Stance:
    """Two small steps turn the body on the spot; the foot on the inside goes first."""
    first, second = SIDES if angle > 0.0 else SIDES[::-1]
    feet = small_step(feet, first, start, turned=angle)
    feet = small_step(feet, second, start + STEP + 3, turned=angle)
    t = np.arange(len(feet.support), dtype=float)
    return replace(feet, heading=feet.heading + angle * ramp(t, start - 2.0, start + 2.0 * STEP))


def _relieved(feet: Stance, side: str, start: int, end: int, share: float) -> np.ndarray:
    """The support with so much of the weight taken off a foot while it is not flat."""
    t = np.arange(len(feet.support), dtype=float)
    away = share * plateau(t, start - 16.0, start + 1.0, end - 3.0, end + 14.0)
    other = 0.0 if sign(side) > 0 else 1.0
    return feet.support + away * (other - feet.support)
