"""Striding: when each foot comes down, where the path leads, and what the rest of the body does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...conventions import GRAVITY, SIDES, other, sign
from ...curves import plateau, ramp, through
from ...randomness import Stream
from ..score import EVER, Air, Foot, FootContact, Hand, Score, Trunk
from .style import Carriage, Performer, Style, hanging, rows

MARGIN = 90
"""Frames drawn before and after the clip, so that it may begin and end in the middle of a way."""


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
        return self.lead if k % 2 == 0 else other(self.lead)

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

    def feet(self, contact: Callable[[int], FootContact]) -> dict[str, Foot]:
        """Feet with a stay from every strike on: ``contact(k)``."""
        stays = {side: tuple(contact(k) for k in self.steps if self.side(k) == side) for side in SIDES}
        return {side: Foot(stays[side], np.zeros(self.frames)) for side in SIDES}

    @cached_property
    def course(self) -> Course:
        k = np.arange(self.frames + 2 * MARGIN) - float(MARGIN)
        activity = np.ones_like(k)
        if self.starts:
            begin = self.strike(0)
            activity = activity * ramp(k, begin - 0.45 * self.stride, begin + 0.35 * self.stride)
        if self.stops:
            end = self.strike(self.steps[-1])
            activity = activity * (1.0 - ramp(k, end - 0.85 * self.stride, end + 0.25 * self.stride))
        share = ramp(k, -0.35 * self.frames, 1.35 * self.frames)
        heading = self.heading + self.turned * 1.2 * (share - 0.5)
        speed, way = activity * self.speed, heading + self.bearing
        place = np.cumsum(np.stack([speed * np.sin(way), speed * np.cos(way)], axis=-1), axis=0)
        if not self.step:
            # on the spot the body turns only while the feet step
            turning = np.cumsum(activity * self.turned / self.frames)
            heading = turning - turning[len(k) // 2] + heading[len(k) // 2]
        return Course(activity, heading, place - place[MARGIN + self.frames // 2])


@dataclass(frozen=True, eq=False)
class Course:
    """The way of a gait, on frames from ``-MARGIN`` on: activity (0 standing, 1 under way), heading,
    place ``(n, 2)`` leg lengths."""

    activity: np.ndarray
    heading: np.ndarray
    place: np.ndarray

    def at(self, frame: float) -> tuple[float, tuple[float, float], float]:
        """Heading, place and activity at any frame, held at the ends."""
        k = np.arange(len(self.heading)) - float(MARGIN)
        rows = (self.heading, self.place[:, 0], self.place[:, 1], self.activity)
        heading, x, z, activity = (float(np.interp(frame, k, row)) for row in rows)
        return heading, (x, z), activity


@dataclass(frozen=True)
class Tread:
    """Settings of how a foot comes down and leaves.

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


def contacts(gait: Gait, side: str, tread: Tread) -> tuple[FootContact, ...]:
    """The stays of one foot along the way."""
    stays = []
    steps = [k for k in gait.steps if gait.side(k) == side]
    down = gait.down(side)
    if gait.starts:
        off = round(gait.strike(steps[0]) - (1.0 - down) * gait.stride)
        stays.append(_contact(gait, tread, -EVER, off, place_at=-MARGIN))
    for k in steps:
        strike, off = round(gait.strike(k)), round(gait.strike(k) + down * gait.stride)
        place_at = gait.strike(k) + tread.under * gait.stride
        if gait.stops and k >= gait.steps[-2]:
            off, place_at = EVER, float(EVER)
        stays.append(_contact(gait, tread, strike, off, place_at))
    return tuple(stays)


def _contact(gait: Gait, tread: Tread, strike: int, off: int, place_at: float) -> FootContact:
    heading, place, _ = gait.course.at(place_at)
    landing, leaving = gait.course.at(strike)[2], gait.course.at(off)[2]
    peel = max(round((tread.peel[0] + tread.peel[1] * leaving) * gait.stride), 3)
    return FootContact(
        place=place,
        width=gait.style.stance * (tread.width + (1.0 - tread.width) * (1.0 - landing)),
        heading=heading,
        toe_out=gait.style.toe_out,
        strike=strike,
        flat=strike + max(round(tread.flat * gait.stride), 2),
        lift=EVER if off == EVER else off - peel,
        off=off,
        strike_pitch=tread.landing[0] + tread.landing[1] * landing * gait.step,
        off_pitch=tread.leaving[0] + tread.leaving[1] * leaving * gait.step,
        lift_height=tread.lift[0] + tread.lift[1] * gait.style.bounce,
    )


_THIGH, _SHANK = 0.455, 0.468
"""Leg lengths, of a usual leg."""


def hung(thigh: np.ndarray, knee: np.ndarray, out: float | np.ndarray = 0.0) -> np.ndarray:
    """``(..., 3)`` reach from hip to ankle of a usual leg with the thigh so far forward and the knee so far
    bent, radians; ``out``: leg lengths outward."""
    shin = thigh - knee
    return rows(
        len(thigh),
        out,
        -_THIGH * np.cos(thigh) - _SHANK * np.cos(shin),
        _THIGH * np.sin(thigh) + _SHANK * np.sin(shin),
    )


@dataclass(frozen=True)
class Swing:
    """A foot's way between two contacts. shares, thigh, knee: degrees at shares of a swing. full: shares
    between which the foot is where these angles say, to the part ``most``. point: of the toes, radians.
    out: leg lengths outward. curve: through the angles."""

    shares: Sequence[float]
    thigh: Sequence[float]
    knee: Sequence[float]
    full: tuple[float, float] = (0.3, 0.75)
    most: float = 1.0
    point: float = 0.25
    out: float = -0.02
    curve: Callable[[np.ndarray, Sequence[float], Sequence[float]], np.ndarray] = through

    def air(self, contacts: Sequence[FootContact], frames: int) -> Air:
        """The air of every swing between contacts."""
        t, zero = np.arange(frames, dtype=float), np.zeros(frames)
        weight, thigh, knee = zero.copy(), zero.copy(), zero.copy()
        for contact, after in pairwise(contacts):
            inside = (t > contact.off) & (t < after.strike)
            share = (t[inside] - contact.off) / (after.strike - contact.off)
            weight[inside] = self.most * plateau(share, 0.0, *self.full, 1.0)
            thigh[inside] = np.radians(self.curve(share, self.shares, self.thigh))
            knee[inside] = np.radians(self.curve(share, self.shares, self.knee))
        return Air(hung(thigh, knee, self.out), weight, swivel=zero, point=zero + self.point)


def flowing(t: np.ndarray, times: Sequence[float], values: Sequence[float]) -> np.ndarray:
    """The natural cubic spline through points, between the first and the last: its acceleration is
    continuous, which ``through`` does not promise."""
    at, y = np.array(times, dtype=float), np.array(values, dtype=float)
    span, last = np.diff(at), len(at) - 1
    slope = np.diff(y) / span
    system, right = np.eye(last + 1), np.zeros(last + 1)
    for k in range(1, last):
        system[k, k - 1 : k + 2] = span[k - 1], 2.0 * (span[k - 1] + span[k]), span[k]
        right[k] = 6.0 * (slope[k] - slope[k - 1])
    bent = np.linalg.solve(system, right)
    piece = np.clip(np.searchsorted(at, t, side="right") - 1, 0, last - 1)
    since, left, h = t - at[piece], at[piece + 1] - t, span[piece]
    curve = (bent[piece] * left**3 + bent[piece + 1] * since**3) / (6.0 * h)
    curve += (y[piece] / h - bent[piece] * h / 6.0) * left
    curve += (y[piece + 1] / h - bent[piece + 1] * h / 6.0) * since
    return np.asarray(curve)


_QUICK = (1.5, 4.0)
"""Hertz, of the unsteadiness that is left in practised movements."""


def stepping(gait: Gait, tread: Tread, lame: Tread | None = None) -> dict[str, Foot]:
    """Feet that go by the gait, from place to place. lame: the tread of the spared one."""
    still, treads = np.zeros(gait.frames), dict.fromkeys(SIDES, tread)
    if lame is not None:
        treads[gait.lame] = lame
    return {side: Foot(contacts(gait, side, treads[side]), still) for side in SIDES}


def striding(
    stream: Stream,
    kind: str,
    gait: Gait,
    feet: Mapping[str, Foot],
    carriage: Carriage,
) -> Score:
    """The whole performance over given feet."""
    person, style, phase, course = (
        Performer(stream, gait.frames, gait.style),
        gait.style,
        gait.phase,
        gait.course,
    )
    inside = slice(MARGIN, MARGIN + gait.frames)
    active, heading = course.activity[inside], course.heading[inside]
    way = np.cos(gait.bearing)
    # lean to the left that keeps a body in balance along its bend
    into = way * gait.speed * active * np.gradient(course.heading)[inside] / GRAVITY
    over_left = phase - 0.6 * np.pi
    left = carriage.sway * active * np.cos(over_left) + person.wander(0.004) + 0.25 * into
    # hips stay behind a trunk that leans ahead
    leaning = way * (carriage.lean + style.posture - 0.05)
    ahead = 0.014 * active * np.sin(2.0 * over_left) - carriage.back * leaning * active
    sway = rows(gait.frames, *(row + person.wander(0.0022, *_QUICK) for row in (left, ahead)))
    # highest over either foot, lowest between them, and shaken a little by every landing
    over_left = phase - 0.64 * np.pi
    wave = np.cos(2.0 * over_left) + carriage.shock * np.cos(4.0 * over_left - 1.0)
    bob = carriage.bob * style.bounce * wave + person.wander(0.0021, *_QUICK)
    # while standing the weight is on both feet, before a start on the one that stays
    support = np.full(gait.frames, 0.5)
    if gait.starts:
        off = gait.strike(0) - (1.0 - gait.duty) * gait.stride
        support -= 0.42 * sign(gait.lead) * ramp(np.arange(gait.frames), off - 0.45 * gait.stride, off)
    return Score(
        kind=kind,
        heading=heading,
        path=course.place[inside],
        sway=sway,
        height=0.994 + active * (bob - carriage.low),
        balance=1.0 - active,
        support=support,
        trunk=_trunk(person, gait, carriage, active, heading, into),
        feet=feet,
        hands={side: _arm(person, gait, carriage, side, active) for side in SIDES},
        phase=phase / (2.0 * np.pi),
    )


def with_air(feet: Mapping[str, Foot], swing: Swing) -> dict[str, Foot]:
    """The same steps, carried higher."""
    return {
        side: replace(foot, air=swing.air(foot.contacts, len(foot.heel))) for side, foot in feet.items()
    }


def _trunk(
    person: Performer,
    gait: Gait,
    carriage: Carriage,
    active: np.ndarray,
    heading: np.ndarray,
    into: np.ndarray,
) -> Trunk:
    """The pelvis turns with the leg in front and drops on the swinging side, the chest counters both."""
    phase, size = gait.phase, active * gait.step / 0.7
    turn = -carriage.turn * np.cos(gait.bearing) * size * np.cos(phase)
    drop = -carriage.drop * size * person.style.bounce * np.cos(phase - 0.35 * np.pi)
    tilt = carriage.tilt * active + 0.02 * size * np.cos(2.0 * phase)
    lean = carriage.lean * active + 0.015 * size * np.cos(2.0 * phase - 0.8)
    ahead = np.array([gait.course.at(frame)[0] for frame in np.arange(person.frames) + 9.0])
    return person.trunk(
        pelvis=(turn, tilt, drop + 0.35 * into),
        chest=(-turn * carriage.counter * (1.0 + 0.8 * person.style.swing), lean, -0.8 * drop + 0.4 * into),
        gaze=(1.6 * (ahead - heading), carriage.gaze - 0.012 * size * np.cos(2.0 * phase), 0.0),
        follow=0.15,
    )


def _arm(person: Performer, gait: Gait, carriage: Carriage, side: str, active: np.ndarray) -> Hand:
    """Each arm swings with the other side's leg, a little late, and bends more in front."""
    style = person.style
    still = carriage.still[side == "right"]
    own = (1.0 + sign(side) * style.asymmetry) * (1.0 - still)
    way = np.cos(gait.bearing)
    wave = -sign(side) * way * np.cos(gait.phase - 0.15)
    swing = carriage.swing * style.swing * own * active * min(gait.step / 0.7, 1.3)
    ahead = swing * wave + (carriage.ahead + 0.14) * active - 0.14 + person.wander(0.03)
    ahead = ahead + person.wander(0.014, *_QUICK)
    lagging = -sign(side) * way * np.cos(gait.phase - 0.55)
    bend = style.elbow + (carriage.bend + 0.4 * still) * active
    bend = bend + swing * (0.2 + carriage.hinge * (0.35 + lagging))
    bend = bend + person.wander(0.05) + person.wander(0.028, *_QUICK)
    # elbows are eased where they would be straight
    bend = 0.5 * (bend + 0.12 + np.sqrt((bend - 0.12) ** 2 + 0.01))
    aside = style.aside + carriage.aside * active + person.wander(0.025)
    swivel = carriage.out * active + carriage.behind * swing * (1.0 - wave)
    return person.hand(hanging(ahead, aside, bend), upright=0.8, swivel=swivel)
