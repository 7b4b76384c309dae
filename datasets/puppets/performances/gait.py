"""Steps in turn: when each foot comes down and leaves, and where the way leads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..curves import ramp
from ..score import SIDES, Plant, sign
from .style import Style

MARGIN = 90
"""Frames drawn before and after the clip, so that it may begin and end in the middle of a way."""
EVER = 10_000
"""A frame after every clip's end."""


@dataclass(frozen=True, eq=False)
class Gait:
    """mode: steady, start, stop, or there: from stand to stand. frames: of the clip. stride: frames from
    one strike of a foot to its next. first: frame of a strike of the leading side. step: leg lengths. duty:
    share of a stride that a foot is down. turned: angle gone along the clip. heading: in the middle of the
    clip. bearing: of the way against the heading. lame: the side that is spared; limp: by what share of a
    stride."""

    mode: str
    frames: int
    stride: float
    first: float
    lead: str
    step: float
    duty: float
    turned: float
    heading: float
    style: Style
    bearing: float = 0.0
    lame: str = ""
    limp: float = 0.0

    def strike(self, k: int) -> float:
        """Frame of the k-th strike; even ones are the leading side's."""
        sooner = self.limp if self.lame and self.side(k) != self.lame else 0.0
        return self.first + (0.5 * k - sooner) * self.stride

    def side(self, k: int) -> str:
        return self.lead if k % 2 == 0 else SIDES[self.lead == "left"]

    def down(self, side: str) -> float:
        """Share of a stride that this foot is down."""
        if not self.lame:
            return self.duty
        return self.duty - 1.3 * self.limp if side == self.lame else self.duty + 0.7 * self.limp

    @property
    def speed(self) -> float:
        """Leg lengths per frame."""
        return 2.0 * self.step / self.stride

    @property
    def steps(self) -> range:
        """The strikes that matter to the clip."""
        half = 0.5 * self.stride
        low = int(np.floor((-1.2 * self.stride - self.first) / half))
        high = int(np.ceil((self.frames + 1.2 * self.stride - self.first) / half))
        if self.starts:
            low = 0
        if self.stops:
            high = int(np.floor((self.frames - 0.5 * self.stride - self.first) / half)) + 1
        return range(low, high)

    @property
    def starts(self) -> bool:
        return self.mode in ("start", "there")

    @property
    def stops(self) -> bool:
        return self.mode in ("stop", "there")

    @cached_property
    def phase(self) -> np.ndarray:
        """``(frames,)`` 0 at every strike of the left foot, 2 pi a stride."""
        shift = 0.0 if self.lead == "left" else 0.5 * self.stride
        return 2.0 * np.pi * (np.arange(self.frames) - self.first - shift) / self.stride


@dataclass(frozen=True, eq=False)
class Course:
    """Where the way leads, on frames from ``-MARGIN`` on: activity (0 standing, 1 under way), heading,
    place ``(n, 2)`` leg lengths."""

    activity: np.ndarray
    heading: np.ndarray
    place: np.ndarray

    @classmethod
    def of(cls, gait: Gait) -> Course:
        k = np.arange(gait.frames + 2 * MARGIN) - float(MARGIN)
        activity = np.ones_like(k)
        if gait.starts:
            begin = gait.strike(0)
            activity = activity * ramp(k, begin - 0.45 * gait.stride, begin + 0.35 * gait.stride)
        if gait.stops:
            end = gait.strike(gait.steps[-1])
            activity = activity * (1.0 - ramp(k, end - 0.85 * gait.stride, end + 0.25 * gait.stride))
        share = ramp(k, -0.35 * gait.frames, 1.35 * gait.frames)
        heading = gait.heading + gait.turned * 1.2 * (share - 0.5)
        speed, way = activity * gait.speed, heading + gait.bearing
        place = np.cumsum(np.stack([speed * np.sin(way), speed * np.cos(way)], axis=-1), axis=0)
        return cls(activity, heading, place - place[MARGIN + gait.frames // 2])

    def at(self, frame: float) -> tuple[float, tuple[float, float], float]:
        """Heading, place and activity at any frame, held at the ends."""
        k = np.arange(len(self.heading)) - float(MARGIN)
        rows = (self.heading, self.place[:, 0], self.place[:, 1], self.activity)
        heading, x, z, activity = (float(np.interp(frame, k, row)) for row in rows)
        return heading, (x, z), activity


@dataclass(frozen=True)
class Tread:
    """How a foot comes down and leaves.

    landing: pitch of the sole at first touch, and what a step of a leg length adds to it.
    leaving: pitch when the toe leaves, and what a step adds.
    flat: share of a stride from first touch to the flat sole. peel: from the heel's rising to the toe's
    leaving, and what being under way adds. lift: clearance, leg lengths, and what the style's bounce adds.
    width: against the style's stance. under: share of a stride from first touch to the body's being over
    the foot.
    """

    landing: tuple[float, float] = (-0.06, -0.40)
    leaving: tuple[float, float] = (0.42, 0.54)
    flat: float = 0.10
    peel: tuple[float, float] = (0.14, 0.08)
    lift: tuple[float, float] = (0.055, 0.02)
    width: float = 0.75
    under: float = 0.296


def plants(gait: Gait, course: Course, side: str, tread: Tread) -> tuple[Plant, ...]:
    """The stays of one foot along the way."""
    found = []
    mine = [k for k in gait.steps if gait.side(k) == side]
    down = gait.down(side)
    if gait.starts:
        off = round(gait.strike(mine[0]) - (1.0 - down) * gait.stride)
        found.append(_plant(gait, course, tread, -EVER, off, place_at=-MARGIN))
    for k in mine:
        strike = round(gait.strike(k))
        off = round(gait.strike(k) + down * gait.stride)
        place_at = gait.strike(k) + tread.under * gait.stride
        if gait.stops and k >= gait.steps[-2]:
            off, place_at = EVER, float(EVER)
        found.append(_plant(gait, course, tread, strike, off, place_at))
    return tuple(found)


def _plant(gait: Gait, course: Course, tread: Tread, strike: int, off: int, place_at: float) -> Plant:
    heading, place, _ = course.at(place_at)
    landing, leaving = course.at(strike)[2], course.at(off)[2]
    stays = off == EVER
    return Plant(
        place=place,
        width=gait.style.stance * (tread.width + (1.0 - tread.width) * (1.0 - landing)),
        heading=heading,
        toe_out=gait.style.toe_out,
        strike=strike,
        flat=strike + max(round(tread.flat * gait.stride), 2),
        lift=EVER
        if stays
        else off - max(round((tread.peel[0] + tread.peel[1] * leaving) * gait.stride), 3),
        off=off,
        strike_pitch=tread.landing[0] + tread.landing[1] * landing * gait.step,
        off_pitch=tread.leaving[0] + tread.leaving[1] * leaving * gait.step,
        lift_height=tread.lift[0] + tread.lift[1] * gait.style.bounce,
    )


def support(gait: Gait) -> np.ndarray:
    """On which foot one rests while standing: before a start on the one that stays."""
    even = np.full(gait.frames, 0.5)
    if not gait.starts:
        return even
    off = gait.strike(0) - (1.0 - gait.duty) * gait.stride
    return even - 0.42 * sign(gait.lead) * ramp(np.arange(gait.frames), off - 0.45 * gait.stride, off)
