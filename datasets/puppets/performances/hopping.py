"""Hopping on one leg, from a stand to a stand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..curves import plateau, spline, through, wander
from ..flight import GRAVITY
from ..randomness import Stream
from ..score import SIDES, Air, Foot, Hand, Plant, Score, Trunk, sign
from .jumping import STAND
from .standing import EVER
from .style import Style, hand, hanging, idle_hand, seconds, trunk
from .swing import carried, hung


def hop(stream: Stream, frames: int) -> Score:
    """Standing, then several hops on one leg, on the spot or forward; the other leg is held up."""
    style, side = Style.draw(stream), stream.choice(SIDES)
    t, heading = np.arange(frames, dtype=float), stream.uniform(-np.pi, np.pi)
    contacts = _hops(stream, frames)
    step = stream.choice((0.0, stream.uniform(0.18, 0.5)))
    way = _hopping_way(contacts, step, t)
    first, last = contacts[0][1], contacts[-1][0]
    aloft = plateau(t, first - 20.0, first - 8.0, last + 8.0, last + 21.0)
    one = plateau(t, first - 28.0, first - 17.0, last + 16.0, last + 27.0)
    moving = plateau(t, first - 12.0, first - 2.0, last + 2.0, last + 14.0)
    foot, other = _hopping_feet(stream, contacts, step, heading, style, frames)
    direction = np.array([np.sin(heading), np.cos(heading)])
    over = sign(side)
    return Score(
        kind="hop",
        heading=np.full(frames, heading),
        path=way[:, None] * direction,
        sway=np.stack([0.075 * over * moving, 0.02 * moving], axis=-1),
        height=_hopping_height(contacts, t),
        balance=1.0 - moving,
        support=0.5 + 0.49 * over * one,
        trunk=_hopping_trunk(stream, style, seconds(frames), contacts, aloft * over),
        feet={side: foot, SIDES[side == "left"]: other},
        hands={each: _hopping_arm(stream, style, contacts, t, aloft) for each in SIDES},
        parameters={"side": side, "hops": float(len(contacts) - 1), "step": step},
        flights=_gaps(contacts),
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


def _gaps(contacts: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    return tuple((a[1], b[0]) for a, b in pairwise(contacts))


def _hopping_height(contacts: Sequence[tuple[int, int]], t: np.ndarray) -> np.ndarray:
    tall, first, last = 0.965, contacts[0][1], contacts[-1][0]
    knots = [(first - 19.0, STAND, 0.0), (first - 8.0, 0.895, 0.0)]
    for off, strike in _gaps(contacts):
        rise = 0.5 * GRAVITY * (strike - off)
        knots += [(float(off), tall, rise), (float(strike), tall, -rise)]
    knots += [(last + 5.0, tall - 2.4 * rise, 0.0), (last + 26.0, STAND, 0.0)]
    return spline(t, *zip(*knots, strict=True))


def _hopping_way(contacts: Sequence[tuple[int, int]], step: float, t: np.ndarray) -> np.ndarray:
    """Even travel from the first take-off to the last landing, over every foot half way of its stay."""
    first, last, count = contacts[0][1], contacts[-1][0], len(contacts) - 1
    speed = step * count / (last - first + 8.0)
    values = (0.0, 4.0 * speed, step * count - 4.0 * speed, step * count)
    way = spline(t, (first - 8.0, first, last, last + 8.0), values, (0.0, speed, speed, 0.0))
    return np.clip(way, 0.0, step * count)


def _hopping_feet(
    stream: Stream,
    contacts: Sequence[tuple[int, int]],
    step: float,
    heading: float,
    style: Style,
    frames: int,
) -> tuple[Foot, Foot]:
    """Of the hopping and of the other leg."""
    count = len(contacts) - 1

    def plant(k: float, strike: int, off: int, width: float, roll: int) -> Plant:
        place = (step * k * float(np.sin(heading)), step * k * float(np.cos(heading)))
        down, away = strike > -EVER, off < EVER
        return Plant(
            place=place,
            width=width * style.stance,
            heading=heading,
            toe_out=style.toe_out,
            strike=strike,
            flat=strike + 3 if down else strike,
            lift=off - roll if away else off,
            off=off,
            strike_pitch=0.30,
            off_pitch=0.68 if roll < 6 else 0.45,
            lift_height=0.10,
            hurry=0.6,
        )

    own = tuple(plant(k, *contact, 0.9, 4) for k, contact in enumerate(contacts))
    leaves, returns = contacts[0][1] - 18, contacts[-1][0] + 20
    held = (plant(0.0, -EVER, leaves, 0.9, 6), plant(float(count), returns, EVER, 0.9, 6))
    t, zero = np.arange(frames, dtype=float), np.zeros(frames)
    weight = plateau(t, leaves, leaves + 11.0, returns - 12.0, returns)
    thigh = np.radians(stream.uniform(-5.0, 45.0)) + wander(stream, seconds(frames), 0.08)
    thigh = thigh - 0.10 * _beat(contacts, t)
    knee = np.radians(stream.uniform(60.0, 95.0)) + 0.12 * _beat(contacts, t)
    air = Air(hung(thigh, knee, 0.02), weight, zero, zero + 0.4)
    hopping = carried(
        own, frames, (0.0, 0.5, 1.0), (0.0, 10.0, 14.0), (24.0, 38.0, 26.0), full=(0.35, 0.65), out=0.0
    )
    return Foot(own, zero, hopping), Foot(held, zero, air)


def _beat(contacts: Sequence[tuple[int, int]], t: np.ndarray) -> np.ndarray:
    """1 in the middle of every flight, -1 in the middle of every stay, 0 before and after."""
    times, values = [-float(EVER), contacts[0][1] - 18.0, contacts[0][1] - 8.0], [0.0, 0.0, -1.0]
    for off, strike in _gaps(contacts):
        times.append(0.5 * (off + strike))
        values.append(1.0)
    for strike, off in contacts[1:]:
        times.append(min(0.5 * (strike + off), strike + 5.0))
        values.append(-1.0)
    order = np.argsort(times)
    times, values = [times[k] for k in order], [values[k] for k in order]
    return through(t, [*times, times[-1] + 20.0, 2 * EVER], [*values, 0.0, 0.0])


def _hopping_trunk(
    stream: Stream, style: Style, t: np.ndarray, contacts: Sequence[tuple[int, int]], over: np.ndarray
) -> Trunk:
    beat, still = _beat(contacts, t * 30.0), np.zeros_like(t)
    pelvis = np.stack([still, 0.05 - 0.05 * beat, -0.05 * over], axis=-1)
    chest = np.stack([0.05 * over, 0.10 * np.abs(over) - 0.10 * beat, 0.12 * over], axis=-1)
    gaze = np.stack([still, 0.16 * np.abs(over), still], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze)


def _hopping_arm(
    stream: Stream,
    style: Style,
    contacts: Sequence[tuple[int, int]],
    frame: np.ndarray,
    aloft: np.ndarray,
) -> Hand:
    """Bent and off the body for balance, rising with every flight."""
    t = seconds(len(frame))
    calm = idle_hand(stream, len(frame), style)
    beat = _beat(contacts, frame - 1.5)
    ahead = 0.15 + 0.30 * style.swing * beat + wander(stream, t, 0.06 * style.loose)
    aside = 0.45 + 0.12 * beat + wander(stream, t, 0.06 * style.loose)
    bend = 1.1 + 0.25 * beat + wander(stream, t, 0.06 * style.loose)
    reach = calm.reach + aloft[:, None] * (hanging(ahead, aside, bend) - calm.reach)
    return hand(stream, t, reach, style, upright=0.7)
