"""Walking: straight, along arcs, starting from a stand and coming to one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..curves import ramp, wander
from ..randomness import Stream
from ..score import FPS, SIDES, Foot, Hand, Plant, Score, Trunk, sign
from .style import Style, hand, hanging, seconds, trunk

_MARGIN = 90
"""Frames drawn before and after the clip, so that it may begin and end in the middle of a walk."""
_EVER = 10_000


@dataclass(frozen=True, eq=False)
class _Gait:
    """mode: steady, start or stop. frames: of the clip. stride: frames from one strike of a foot to its
    next. first: frame of a strike of the leading side. step: leg lengths. duty: share of a stride that a
    foot is down. turned: angle walked along the clip. heading: in the middle of the clip."""

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

    @classmethod
    def draw(cls, stream: Stream, frames: int) -> _Gait:
        mode = stream.choice(("steady", "steady", "start", "stop"))
        stride = 2.0 * FPS / stream.uniform(1.6, 2.1)
        first = stream.uniform(0.0, 1.0)
        turned = stream.choice((0.0, 0.0, 0.35, 0.8, 1.4)) * stream.sign() * frames / 100.0
        return cls(
            mode=mode,
            frames=frames,
            stride=stride,
            first=0.62 * stride + 12.0 * first if mode == "start" else first * stride,
            lead=stream.choice(SIDES),
            step=stream.uniform(0.60, 0.84) * (1.0 - 0.12 * abs(turned)),
            duty=stream.uniform(0.60, 0.65),
            turned=turned + stream.normal(0.04),
            heading=stream.uniform(-np.pi, np.pi),
            style=Style.draw(stream),
        )

    def strike(self, k: int) -> float:
        """Frame of the k-th strike; even ones are the leading side's."""
        return self.first + 0.5 * k * self.stride

    def side(self, k: int) -> str:
        return self.lead if k % 2 == 0 else SIDES[self.lead == "left"]

    @property
    def steps(self) -> range:
        """The strikes that matter to the clip."""
        half = 0.5 * self.stride
        low = int(np.floor((-1.2 * self.stride - self.first) / half))
        high = int(np.ceil((self.frames + 1.2 * self.stride - self.first) / half))
        if self.mode == "start":
            return range(0, high)
        if self.mode == "stop":
            return range(low, int(np.floor((self.frames - 0.5 * self.stride - self.first) / half)) + 1)
        return range(low, high)

    @cached_property
    def phase(self) -> np.ndarray:
        """``(frames,)`` 0 at every strike of the left foot, 2 pi a stride."""
        shift = 0.0 if self.lead == "left" else 0.5 * self.stride
        return 2.0 * np.pi * (np.arange(self.frames) - self.first - shift) / self.stride


@dataclass(frozen=True, eq=False)
class _Course:
    """Where the walk leads, on frames from ``-_MARGIN`` on: activity (0 standing, 1 walking), heading,
    place ``(n, 2)`` leg lengths."""

    activity: np.ndarray
    heading: np.ndarray
    place: np.ndarray

    @classmethod
    def of(cls, gait: _Gait) -> _Course:
        k = np.arange(gait.frames + 2 * _MARGIN) - float(_MARGIN)
        activity = np.ones_like(k)
        if gait.mode == "start":
            begin = gait.strike(0)
            activity = ramp(k, begin - 0.45 * gait.stride, begin + 0.35 * gait.stride)
        elif gait.mode == "stop":
            end = gait.strike(gait.steps[-1])
            activity = 1.0 - ramp(k, end - 0.85 * gait.stride, end + 0.25 * gait.stride)
        share = ramp(k, -0.35 * gait.frames, 1.35 * gait.frames)
        heading = gait.heading + gait.turned * 1.2 * (share - 0.5)
        speed = activity * (2.0 * gait.step / gait.stride)
        place = np.cumsum(np.stack([speed * np.sin(heading), speed * np.cos(heading)], axis=-1), axis=0)
        return cls(activity, heading, place - place[_MARGIN + gait.frames // 2])

    def at(self, frame: float) -> tuple[float, tuple[float, float], float]:
        """Heading, place and activity at any frame, held at the ends."""
        k = np.arange(len(self.heading)) - float(_MARGIN)
        rows = (self.heading, self.place[:, 0], self.place[:, 1], self.activity)
        heading, x, z, activity = (float(np.interp(frame, k, row)) for row in rows)
        return heading, (x, z), activity


def walk(stream: Stream, frames: int) -> Score:
    """Walking at 0.45 to 0.8 leg lengths a step, with heel strike and toe-off."""
    gait = _Gait.draw(stream, frames)
    course, style = _Course.of(gait), gait.style
    t, phase, still = seconds(frames), gait.phase, np.zeros(frames)
    inside = slice(_MARGIN, _MARGIN + frames)
    active = course.activity[inside]
    over_left = phase - 0.6 * np.pi
    sway = [0.030 * active * np.cos(over_left), 0.010 * active * np.sin(2.0 * over_left)]
    sway[0] = sway[0] + wander(stream, t, 0.004 * style.loose)
    height = 0.994 - 0.018 * active + 0.017 * style.bounce * active * np.cos(2.0 * over_left)
    return Score(
        kind="walk",
        heading=course.heading[inside],
        path=course.place[inside],
        sway=np.stack(sway, axis=-1),
        height=height,
        balance=1.0 - active,
        support=_support(gait),
        trunk=_trunk(stream, gait, course, t, active),
        feet={side: Foot(_plants(gait, course, side), still) for side in SIDES},
        hands={side: _arm(stream, gait, side, t, active) for side in SIDES},
        parameters={"mode": gait.mode, "step": gait.step, "stride": gait.stride, "turned": gait.turned},
    )


def _support(gait: _Gait) -> np.ndarray:
    """On which foot a standing walker rests: before a start on the one that stays."""
    even = np.full(gait.frames, 0.5)
    if gait.mode != "start":
        return even
    off = gait.strike(0) - (1.0 - gait.duty) * gait.stride
    return even - 0.42 * sign(gait.lead) * ramp(np.arange(gait.frames), off - 0.45 * gait.stride, off)


def _plants(gait: _Gait, course: _Course, side: str) -> tuple[Plant, ...]:
    plants = []
    mine = [k for k in gait.steps if gait.side(k) == side]
    if gait.mode == "start":
        off = round(gait.strike(mine[0]) - (1.0 - gait.duty) * gait.stride)
        plants.append(_plant(gait, course, -_EVER, off, place_at=-_MARGIN))
    for k in mine:
        strike = round(gait.strike(k))
        off = round(gait.strike(k) + gait.duty * gait.stride)
        place_at = gait.strike(k) + 0.275 * gait.stride
        if gait.mode == "stop" and k >= gait.steps[-2]:
            off, place_at = _EVER, float(_EVER)
        plants.append(_plant(gait, course, strike, off, place_at))
    return tuple(plants)


def _plant(gait: _Gait, course: _Course, strike: int, off: int, place_at: float) -> Plant:
    heading, place, _ = course.at(place_at)
    landing, leaving = course.at(strike)[2], course.at(off)[2]
    stays = off == _EVER
    return Plant(
        place=place,
        width=gait.style.stance * (0.75 + 0.25 * (1.0 - landing)),
        heading=heading,
        toe_out=gait.style.toe_out,
        strike=strike,
        flat=strike + max(round(0.10 * gait.stride), 2),
        lift=_EVER if stays else off - max(round((0.14 + 0.08 * leaving) * gait.stride), 3),
        off=off,
        strike_pitch=-0.06 - 0.40 * landing * gait.step,
        off_pitch=0.45 + 0.60 * leaving * gait.step,
        lift_height=0.035 + 0.02 * gait.style.bounce,
    )


def _trunk(stream: Stream, gait: _Gait, course: _Course, t: np.ndarray, active: np.ndarray) -> Trunk:
    """The pelvis turns with the leg in front and drops on the swinging side, the chest counters both."""
    style = gait.style
    size = active * gait.step / 0.7
    turn = -0.10 * size * np.cos(gait.phase)
    drop = -0.065 * size * style.bounce * np.cos(gait.phase - 0.35 * np.pi)
    tilt = 0.05 * active + 0.02 * size * np.cos(2.0 * gait.phase)
    ahead = np.array([course.at(frame)[0] for frame in np.arange(len(t)) + 9.0])
    looking = ahead - course.heading[_MARGIN : _MARGIN + len(t)]
    pelvis = np.stack([turn, tilt, drop], axis=-1)
    chest = np.stack(
        [
            -turn * (1.0 + 0.8 * style.swing),
            0.03 * active + 0.015 * size * np.cos(2.0 * gait.phase - 0.8),
            -0.8 * drop,
        ],
        axis=-1,
    )
    gaze = np.stack([1.6 * looking, 0.06 - 0.012 * size * np.cos(2.0 * gait.phase), 0.0 * t], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze, follow=0.15)


def _arm(stream: Stream, gait: _Gait, side: str, t: np.ndarray, active: np.ndarray) -> Hand:
    """Each arm swings with the other side's leg, a little late, and bends more in front."""
    style = gait.style
    own = 1.0 + sign(side) * style.asymmetry
    wave = -sign(side) * np.cos(gait.phase - 0.15)
    swing = 0.36 * style.swing * own * active * gait.step / 0.7
    ahead = swing * wave - 0.14 + wander(stream, t, 0.02 * style.loose)
    lagging = -sign(side) * np.cos(gait.phase - 0.55)
    bend = style.elbow + swing * (0.3 + 0.3 * lagging) + wander(stream, t, 0.03 * style.loose)
    aside = style.aside + wander(stream, t, 0.015 * style.loose)
    return hand(stream, t, hanging(ahead, aside, bend), style, upright=0.8)
