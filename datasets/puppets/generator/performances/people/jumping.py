"""Jumps on the spot and forward, and hopping on one leg.

Take-off, flight and landing follow each other like a thrown body's; how far the legs give in landing
grows with the speed they stop.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from ...conventions import GRAVITY, SIDES, other, sign
from ...curves import plateau, spline, through, wander
from ...randomness import Stream
from ..score import EVER, Air, Foot, FootContact, Hand, Score
from .scene import shifting
from .striding import Swing, hung
from .style import Performer, Style, along, hanging, rows

STAND, _TALL, _LAND = 0.990, 1.005, 0.955
"""Height of the hip joints standing, at take-off and at landing, leg lengths."""


@dataclass(frozen=True)
class _Jump:
    """One jump. down: frame at which the knees begin to bend. off, strike: last frame on the toes, first
    frame on them again. deep, soft: height of the hips at the lowest before and after, and far: how far
    the feet travel, leg lengths."""

    down: float
    off: int
    strike: int
    deep: float
    soft: float
    far: float

    @property
    def rise(self) -> float:
        """Speed at take-off, leg lengths a frame."""
        time = self.strike - self.off
        return (_LAND - _TALL) / time + 0.5 * GRAVITY * time

    @property
    def fall(self) -> float:
        return GRAVITY * (self.strike - self.off) - self.rise

    @property
    def low(self) -> float:
        """Frame of the lowest point before: the push has one acceleration."""
        return self.off - 1.8 * (_TALL - self.deep) / self.rise

    @property
    def caught(self) -> float:
        """Frame of the lowest point after."""
        return self.strike + 2.0 * (_LAND - self.soft) / self.fall

    @property
    def up(self) -> float:
        """Frame at which the body stands again."""
        return self.caught + 14.0 + 22.0 * (STAND - self.soft)

    def heights(self) -> list[tuple[float, float, float]]:
        """Time, height and slope at the turning points."""
        return [
            (self.down, STAND, 0.0),
            (self.low, self.deep, 0.0),
            (float(self.off), _TALL, self.rise),
            (float(self.strike), _LAND, -self.fall),
            (self.caught, self.soft, 0.0),
            (self.up, STAND, 0.0),
        ]


def _jumps(
    stream: Stream, frames: int, time: tuple[float, float], far: tuple[float, float], entire: bool
) -> list[_Jump]:
    """As many jumps as the clip holds; the first begins soon, the last ends before the clip, or is cut off
    unless all are to be ``entire``."""
    shallow = 0.13 if entire and frames < 110 else 0.0
    deep, soft = stream.uniform(0.62 + shallow, 0.80), stream.uniform(0.66 + shallow, 0.84)
    air, travel = stream.uniform(*time), stream.uniform(*far)
    pause, at = stream.uniform(2.0, 22.0), stream.uniform(0.0 if entire else -4.0, 4.0 if shallow else 10.0)
    jumps: list[_Jump] = []
    while at < frames:
        off = round(at + 14.0 + 40.0 * (0.98 - deep) * stream.uniform(0.9, 1.3))
        jump = _Jump(
            down=at,
            off=off,
            strike=off + round(air * stream.uniform(0.93, 1.07)),
            deep=deep * stream.uniform(0.97, 1.03),
            soft=soft * stream.uniform(0.97, 1.03),
            far=travel * stream.uniform(0.9, 1.1),
        )
        if entire and jumps and jump.up > frames - 2:
            break
        jumps.append(jump)
        at = jump.up + pause * stream.uniform(0.5, 1.5)
    return jumps


def jump(stream: Stream, frames: int, mode: str = "", kind: str = "jump") -> Score:
    """``jump``: straight up from both feet, arms thrown up, legs hanging or drawn up; ``leap``: a standing
    long jump, feet together, arms swinging through."""
    person, entire = Performer(stream, frames), mode == "there"
    if kind == "jump":
        jumps = _jumps(stream, frames, (10.0, 15.5), (0.0, 0.0), entire)
        tuck = stream.choice((0.0, 0.0, 0.6, 1.0))
    else:
        jumps = _jumps(stream, frames, (10.5, 14.5), (0.75, 1.45), entire)
        tuck = stream.uniform(0.5, 1.0)
    t, heading = np.arange(frames, dtype=float), stream.uniform(-np.pi, np.pi)
    knots = [knot for each in jumps for knot in each.heights()]
    loose = np.zeros(frames)
    for each in jumps:
        if each.far > 0.0:
            loose += plateau(t, each.low - 6.0, each.off - 1.0, each.strike, each.caught + 16.0)
    crouch = _crouch(jumps, t)
    pelvis, chest, gaze = 0.02 + 0.34 * crouch, 0.32 * crouch, 0.10 * crouch
    feet = {side: _feet(person, jumps, heading, tuck) for side in SIDES}
    return Score(
        kind=kind,
        heading=np.full(frames, heading),
        path=_way(jumps, t)[:, None] * np.array([np.sin(heading), np.cos(heading)]),
        sway=np.zeros((frames, 2)),
        height=spline(t, *zip(*knots, strict=True)),
        balance=1.0 - loose,
        support=shifting(stream, frames, 0.06),
        trunk=person.trunk((0.0, pelvis, 0.0), (0.0, chest, 0.0), (0.0, gaze, 0.0)),
        feet=feet,
        hands={side: _arm(person, jumps, side, t) for side in SIDES},
        flights=tuple((each.off, each.strike) for each in jumps if each.off < frames - 1),
        impacts=tuple(frame for each in jumps for frame in (each.off, each.strike) if frame < frames),
    )


def _way(jumps: Sequence[_Jump], t: np.ndarray) -> np.ndarray:
    """Distance gone by the body ``(frames,)``, leg lengths: falling forward before the take-off, landing
    behind the feet."""
    way, start = np.zeros_like(t), 0.0
    for each in jumps:
        ahead, behind = 0.24 * min(each.far, 1.0), 0.22 * min(each.far, 1.0)
        end = start + each.far
        speed = (each.far - ahead - behind) / (each.strike - each.off)
        times = (each.low - 4.0, each.off, each.strike, each.caught + 12.0)
        values = (start, start + ahead, end - behind, end)
        way = np.where(t >= times[0], spline(t, times, values, (0.0, speed, speed, 0.0)), way)
        way = np.where(t > times[-1], end, way)
        start = end
    return way


def _crouch(jumps: Sequence[_Jump], t: np.ndarray) -> np.ndarray:
    """0 standing, about 1 in the deepest crouch, below 0 stretched in the air."""
    times, values = [-float(EVER)], [0.0]
    for each in jumps:
        times += [each.down, each.low, each.off - 0.5, 0.5 * (each.off + each.strike)]
        values += [0.0, 3.2 * (STAND - each.deep), 0.0, -0.12]
        times += [float(each.strike), each.caught + 1.0, each.up]
        values += [0.2, 2.8 * (STAND - each.soft), 0.0]
    return through(t, [*times, 2 * EVER], [*values, 0.0])


def _contact(
    style: Style,
    heading: float,
    far: float,
    strike: int,
    off: int,
    roll: int,
    pitches: tuple[float, float],
    width: float = 0.9,
    lift: float = 0.10,
) -> FootContact:
    """A stay so far along the way. roll: frames of leaving over the toe. pitches: of landing and leaving.
    width: against the style's stance. lift: of the swing that follows."""
    return FootContact(
        place=along(heading, far),
        width=width * style.stance,
        heading=heading,
        toe_out=style.toe_out,
        strike=strike,
        flat=strike + 3 if strike > -EVER else strike,
        lift=off - roll if off < EVER else off,
        off=off,
        strike_pitch=pitches[0],
        off_pitch=pitches[1],
        lift_height=lift,
        hurry=0.6,
    )


def _feet(person: Performer, jumps: Sequence[_Jump], heading: float, tuck: float) -> Foot:
    way = accumulate((each.far for each in jumps), initial=0.0)
    strikes, offs = [-EVER, *(each.strike for each in jumps)], [*(each.off for each in jumps), EVER]
    contacts = [
        _contact(person.style, heading, far, strike, off, 5, (0.42, 0.70), 1.1, 0.12)
        for far, strike, off in zip(way, strikes, offs, strict=True)
    ]
    reach = 1.0 if jumps[0].far > 0.0 else 0.0
    swing = Swing(
        (0.0, 0.3, 0.55, 0.8, 1.0),
        (-8.0, 20.0 * tuck, 12.0 + 55.0 * tuck, 14.0 + 32.0 * tuck + 8.0 * reach, 14.0 + 20.0 * reach),
        (22.0, 26.0 + 40.0 * tuck, 26.0 + 72.0 * tuck, 24.0 + 36.0 * tuck, 26.0),
        full=(0.50, 0.60),
        point=0.40,
        out=0.01,
    )
    return Foot(tuple(contacts), np.zeros(person.frames), swing.air(contacts, person.frames))


def _arm(person: Performer, jumps: Sequence[_Jump], side: str, frame: np.ndarray) -> Hand:
    """Back with the crouch, thrown forward and up with the push, down again over the landing."""
    style, own = person.style, 1.0 + sign(side) * 0.5 * person.style.asymmetry
    high = own * (0.95 + 0.65 * style.swing)
    times, values, bends = [-float(EVER)], [0.0], [0.0]
    for each in jumps:
        back = each.down + 0.55 * (each.low - each.down)
        times += [each.down - 2.0, back, each.low + 1.0, 0.5 * (each.off + each.strike)]
        values += [0.0, -0.75 * own * style.swing, 0.1, high]
        bends += [0.0, 0.1, 0.45, 0.3]
        times += [each.strike + 1.0, each.caught + 5.0, each.up + 3.0]
        values += [1.0, -0.05 + 0.4 * min(each.far, 1.0), 0.0]
        bends += [0.45, 0.40, 0.0]
    lagged = frame - 1.4 * sign(side) * style.asymmetry / 0.08
    raised, bent = (through(lagged, [*times, 2 * EVER], [*row, 0.0]) for row in (values, bends))
    ahead = raised - 0.08 + person.wander(0.03)
    bend = style.elbow + bent + person.wander(0.03)
    aside = style.aside + 0.12 * np.abs(raised) + person.wander(0.02)
    return person.hand(hanging(ahead, aside, bend), upright=0.6)


def hop(stream: Stream, frames: int) -> Score:
    """Standing, then several hops on one leg, on the spot or forward; the other leg is held up."""
    person, side = Performer(stream, frames), stream.choice(SIDES)
    t, heading = np.arange(frames, dtype=float), stream.uniform(-np.pi, np.pi)
    contacts = _hops(stream, frames)
    step = stream.choice((0.0, stream.uniform(0.18, 0.5)))
    gaps = [(a[1], b[0]) for a, b in pairwise(contacts)]
    first, last = contacts[0][1], contacts[-1][0]
    tall, knots = 0.965, [(first - 19.0, STAND, 0.0), (first - 8.0, 0.895, 0.0)]
    for off, strike in gaps:
        rise = 0.5 * GRAVITY * (strike - off)
        knots += [(float(off), tall, rise), (float(strike), tall, -rise)]
    knots += [(last + 5.0, tall - 2.4 * rise, 0.0), (last + 26.0, STAND, 0.0)]
    # even travel from the first take-off to the last landing, over every foot half way of its stay
    far = step * len(gaps)
    speed = far / (last - first + 8.0)
    values = (0.0, 4.0 * speed, far - 4.0 * speed, far)
    way = spline(t, (first - 8.0, first, last, last + 8.0), values, (0.0, speed, speed, 0.0))
    way = np.clip(way, 0.0, far)
    aloft = plateau(t, first - 20.0, first - 8.0, last + 8.0, last + 21.0)
    one = plateau(t, first - 28.0, first - 17.0, last + 16.0, last + 27.0)
    moving = plateau(t, first - 12.0, first - 2.0, last + 2.0, last + 14.0)
    foot, spare = _hopping_feet(person, contacts, step, heading)
    out = sign(side)
    # over the hopping leg, shaken by every landing
    beat, over = _beat(contacts, person.t * 30.0), aloft * out
    return Score(
        kind="hop",
        heading=np.full(frames, heading),
        path=way[:, None] * np.array([np.sin(heading), np.cos(heading)]),
        sway=rows(frames, 0.075 * out * moving, 0.02 * moving),
        height=spline(t, *zip(*knots, strict=True)),
        balance=1.0 - moving,
        support=0.5 + 0.49 * out * one,
        trunk=person.trunk(
            pelvis=(0.0, 0.05 - 0.05 * beat, -0.05 * over),
            chest=(0.05 * over, 0.10 * np.abs(over) - 0.10 * beat, 0.12 * over),
            gaze=(0.0, 0.16 * np.abs(over), 0.0),
        ),
        feet={side: foot, other(side): spare},
        hands={each: _hopping_arm(person, contacts, t, aloft) for each in SIDES},
        flights=tuple(gaps),
        impacts=tuple(frame for contact in contacts for frame in contact if 0 < frame < frames),
    )


def _hops(stream: Stream, frames: int) -> list[tuple[int, int]]:
    """(first, last) frames of every stay of the hopping foot; the outer ones last as the standing does."""
    time, down = stream.uniform(7.0, 10.0), stream.uniform(7.0, 10.0)
    at = round(stream.uniform(21.0, 27.0))
    contacts = [(-EVER, at)]
    while at + 2.0 * time + down < frames - 24.0 or len(contacts) < 2:
        strike = at + round(time * stream.uniform(0.94, 1.06))
        at = strike + round(down * stream.uniform(0.95, 1.05))
        contacts.append((strike, at))
    return [*contacts[:-1], (contacts[-1][0], EVER)]


def _hopping_feet(
    person: Performer, contacts: Sequence[tuple[int, int]], step: float, heading: float
) -> tuple[Foot, Foot]:
    """Feet of the hopping and of the other leg."""
    frames, stream = person.frames, person.stream
    own = tuple(
        _contact(person.style, heading, step * k, strike, off, 4, (0.30, 0.68))
        for k, (strike, off) in enumerate(contacts)
    )
    leaves, returns = contacts[0][1] - 18, contacts[-1][0] + 20
    held = (
        _contact(person.style, heading, 0.0, -EVER, leaves, 6, (0.30, 0.45)),
        _contact(person.style, heading, step * (len(contacts) - 1), returns, EVER, 6, (0.30, 0.45)),
    )
    t, zero = np.arange(frames, dtype=float), np.zeros(frames)
    weight = plateau(t, leaves, leaves + 11.0, returns - 12.0, returns)
    beat = _beat(contacts, t)
    thigh = np.radians(stream.uniform(-5.0, 45.0)) + wander(stream, person.t, 0.08)
    thigh = thigh - 0.10 * beat
    knee = np.radians(stream.uniform(60.0, 95.0)) + 0.12 * beat
    air = Air(hung(thigh, knee, 0.02), weight, zero, zero + 0.4)
    swing = Swing((0.0, 0.5, 1.0), (0.0, 10.0, 14.0), (24.0, 38.0, 26.0), full=(0.35, 0.65), out=0.0)
    return Foot(own, zero, swing.air(own, frames)), Foot(held, zero, air)


def _beat(contacts: Sequence[tuple[int, int]], t: np.ndarray) -> np.ndarray:
    """1 in the middle of every flight, -1 in the middle of every stay, 0 before and after."""
    times, values = [-float(EVER), contacts[0][1] - 18.0, contacts[0][1] - 8.0], [0.0, 0.0, -1.0]
    for (_, off), (strike, again) in pairwise(contacts):
        times += [0.5 * (off + strike), min(0.5 * (strike + again), strike + 5.0)]
        values += [1.0, -1.0]
    return through(t, [*times, times[-1] + 20.0, 2 * EVER], [*values, 0.0, 0.0])


def _hopping_arm(
    person: Performer, contacts: Sequence[tuple[int, int]], frame: np.ndarray, aloft: np.ndarray
) -> Hand:
    """Bent and off the body for balance, rising with every flight."""
    calm = person.idle_hand().reach
    beat = _beat(contacts, frame - 1.5)
    ahead = 0.15 + 0.30 * person.style.swing * beat + person.wander(0.06)
    aside = 0.45 + 0.12 * beat + person.wander(0.06)
    bend = 1.1 + 0.25 * beat + person.wander(0.06)
    return person.hand(calm + aloft[:, None] * (hanging(ahead, aside, bend) - calm))
