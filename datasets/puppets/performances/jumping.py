"""Jumps on the spot and forward. Take-off, flight and landing follow each other like a
thrown body's; what the legs give in landing grows with the speed they stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..curves import plateau, spline, through, wander
from ..flight import GRAVITY
from ..randomness import Stream
from ..score import SIDES, Foot, Hand, Plant, Score, Trunk, sign
from .standing import EVER, shifting
from .style import Style, hand, hanging, seconds, trunk
from .swing import carried

STAND = 0.990
"""Height of the hip joints of who stands, leg lengths."""


@dataclass(frozen=True)
class _Jump:
    """One jump. down: frame at which the knees begin to bend. off, strike: last frame on the toes, first
    frame on them again. deep, soft: height of the hips at the lowest before and after. tall, land: at
    take-off and landing, leg lengths. far: how far the feet travel."""

    down: float
    off: int
    strike: int
    deep: float
    soft: float
    tall: float
    land: float
    far: float

    @property
    def rise(self) -> float:
        """Speed at take-off, leg lengths a frame."""
        time = self.strike - self.off
        return (self.land - self.tall) / time + 0.5 * GRAVITY * time

    @property
    def fall(self) -> float:
        return GRAVITY * (self.strike - self.off) - self.rise

    @property
    def low(self) -> float:
        """Frame of the lowest point before: the push has one acceleration."""
        return self.off - 1.8 * (self.tall - self.deep) / self.rise

    @property
    def caught(self) -> float:
        """Frame of the lowest point after."""
        return self.strike + 2.0 * (self.land - self.soft) / self.fall

    @property
    def up(self) -> float:
        """Frame at which the body stands again."""
        return self.caught + 14.0 + 22.0 * (STAND - self.soft)

    def heights(self) -> list[tuple[float, float, float]]:
        """Time, height and slope at the turning points."""
        return [
            (self.down, STAND, 0.0),
            (self.low, self.deep, 0.0),
            (float(self.off), self.tall, self.rise),
            (float(self.strike), self.land, -self.fall),
            (self.caught, self.soft, 0.0),
            (self.up, STAND, 0.0),
        ]


def _jumps(
    stream: Stream, frames: int, time: tuple[float, float], far: tuple[float, float], whole: bool
) -> list[_Jump]:
    """As many as the clip holds; the first begins soon, the last ends before the clip, or is cut off unless
    all are to be ``whole``."""
    shallow = 0.13 if whole and frames < 110 else 0.0
    deep, soft = stream.uniform(0.62 + shallow, 0.80), stream.uniform(0.66 + shallow, 0.84)
    air, travel = stream.uniform(*time), stream.uniform(*far)
    pause, at = stream.uniform(2.0, 22.0), stream.uniform(0.0 if whole else -4.0, 4.0 if shallow else 10.0)
    found: list[_Jump] = []
    while at < frames:
        off = round(at + 14.0 + 40.0 * (0.98 - deep) * stream.uniform(0.9, 1.3))
        jump = _Jump(
            down=at,
            off=off,
            strike=off + round(air * stream.uniform(0.93, 1.07)),
            deep=deep * stream.uniform(0.97, 1.03),
            soft=soft * stream.uniform(0.97, 1.03),
            tall=1.005,
            land=0.955,
            far=travel * stream.uniform(0.9, 1.1),
        )
        if whole and found and jump.up > frames - 2:
            break
        found.append(jump)
        at = jump.up + pause * stream.uniform(0.5, 1.5)
    return found


def jump(stream: Stream, frames: int, mode: str = "") -> Score:
    """Straight up from both feet, arms thrown up, legs hanging or drawn up."""
    style = Style.draw(stream)
    jumps = _jumps(stream, frames, (10.0, 15.5), (0.0, 0.0), mode == "there")
    tuck = stream.choice((0.0, 0.0, 0.6, 1.0))
    return _jumping(stream, "jump", frames, style, jumps, tuck)


def leap(stream: Stream, frames: int, mode: str = "") -> Score:
    """A standing long jump, feet together, arms swinging through."""
    style = Style.draw(stream)
    jumps = _jumps(stream, frames, (10.5, 14.5), (0.75, 1.45), mode == "there")
    return _jumping(stream, "leap", frames, style, jumps, stream.uniform(0.5, 1.0))


def _jumping(
    stream: Stream, kind: str, frames: int, style: Style, jumps: Sequence[_Jump], tuck: float
) -> Score:
    t, heading = np.arange(frames, dtype=float), stream.uniform(-np.pi, np.pi)
    knots = [knot for each in jumps for knot in each.heights()]
    way, loose = _way(jumps, t), np.zeros(frames)
    for each in jumps:
        if each.far > 0.0:
            loose += plateau(t, each.low - 6.0, each.off - 1.0, each.strike, each.caught + 16.0)
    crouch = _crouch(jumps, t)
    direction = np.array([np.sin(heading), np.cos(heading)])
    feet = {side: _feet(jumps, frames, style, heading, tuck) for side in SIDES}
    return Score(
        kind=kind,
        heading=np.full(frames, heading),
        path=way[:, None] * direction,
        sway=np.zeros((frames, 2)),
        height=spline(t, *zip(*knots, strict=True)),
        balance=1.0 - loose,
        support=shifting(stream, frames, 0.06),
        trunk=_trunk(stream, style, seconds(frames), crouch),
        feet=feet,
        hands={side: _arm(stream, style, jumps, side, t) for side in SIDES},
        parameters={"jumps": float(len(jumps)), "tuck": tuck, "far": jumps[0].far},
        flights=tuple((each.off, each.strike) for each in jumps if each.off < frames - 1),
        impacts=tuple(frame for each in jumps for frame in (each.off, each.strike) if frame < frames),
    )


def _way(jumps: Sequence[_Jump], t: np.ndarray) -> np.ndarray:
    """How far the body has come ``(frames,)``, leg lengths: falling forward before the take-off, landing
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


def _feet(jumps: Sequence[_Jump], frames: int, style: Style, heading: float, tuck: float) -> Foot:
    plants, start, strike, flat = [], 0.0, -EVER, -EVER
    for each in [*jumps, None]:
        off = each.off if each else EVER
        plants.append(
            Plant(
                place=(start * float(np.sin(heading)), start * float(np.cos(heading))),
                width=1.1 * style.stance,
                heading=heading,
                toe_out=style.toe_out,
                strike=strike,
                flat=flat,
                lift=off - 5 if each else EVER,
                off=off,
                strike_pitch=0.42,
                off_pitch=0.70,
                lift_height=0.12,
                hurry=0.6,
            )
        )
        if each:
            start += each.far
            strike, flat = each.strike, each.strike + 3
    reach = 1.0 if jumps[0].far > 0.0 else 0.0
    air = carried(
        plants,
        frames,
        (0.0, 0.3, 0.55, 0.8, 1.0),
        (-8.0, 20.0 * tuck, 12.0 + 55.0 * tuck, 14.0 + 32.0 * tuck + 8.0 * reach, 14.0 + 20.0 * reach),
        (22.0, 26.0 + 40.0 * tuck, 26.0 + 72.0 * tuck, 24.0 + 36.0 * tuck, 26.0),
        full=(0.50, 0.60),
        point=0.40,
        out=0.01,
    )
    return Foot(tuple(plants), np.zeros(frames), air)


def _trunk(stream: Stream, style: Style, t: np.ndarray, crouch: np.ndarray) -> Trunk:
    still = np.zeros_like(t)
    pelvis = np.stack([still, 0.02 + 0.34 * crouch, still], axis=-1)
    chest = np.stack([still, 0.32 * crouch, still], axis=-1)
    gaze = np.stack([still, 0.10 * crouch, still], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze)


def _arm(stream: Stream, style: Style, jumps: Sequence[_Jump], side: str, frame: np.ndarray) -> Hand:
    """Back with the crouch, thrown forward and up with the push, down again over the landing."""
    t, own = seconds(len(frame)), 1.0 + sign(side) * 0.5 * style.asymmetry
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
    late = frame - 1.4 * sign(side) * style.asymmetry / 0.08
    curve = [through(late, [*times, 2 * EVER], [*row, 0.0]) for row in (values, bends)]
    ahead = curve[0] - 0.08 + wander(stream, t, 0.03 * style.loose)
    bend = style.elbow + curve[1] + wander(stream, t, 0.03 * style.loose)
    aside = style.aside + 0.12 * np.abs(curve[0]) + wander(stream, t, 0.02 * style.loose)
    return hand(stream, t, hanging(ahead, aside, bend), style, upright=0.6)
