"""Walk, trot and gallop: periods of four paws, along any path.

The order of footfalls is that of the textbooks (Hildebrand 1989); periods, strides and speeds were tuned to
recorded dogs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..curves import wander
from ..performances.style import seconds
from ..randomness import Stream
from ..score import FPS, Trunk
from .manner import Habit, head_and_tail
from .score import LIMBS, DogScore, Paw, PawPlant, idle_hands


@dataclass(frozen=True)
class Gait:
    """phases: of the first touch of each paw (``LIMBS``), shares of the period. duty: share of the period
    that a paw is down. speed: leg lengths a second, slowest and fastest. stride: leg lengths at both.
    lift: of the paws, leg lengths. bounce: of the trunk, shares of the standing height, and how often in a
    period. roll_off: radians that the paw rolls over its tip. low: how much lower the body is carried."""

    phases: tuple[float, float, float, float]
    duty: float
    speed: tuple[float, float]
    stride: tuple[float, float]
    lift: float
    bounce: float
    beats: int
    roll_off: float
    low: float


WALK = Gait((0.0, 0.5, 0.22, 0.72), 0.64, (1.2, 2.3), (1.22, 1.55), 0.23, 0.028, 2, 0.55, 0.02)
TROT = Gait((0.0, 0.5, 0.52, 0.02), 0.45, (3.0, 5.2), (1.85, 2.55), 0.31, 0.055, 2, 0.65, 0.03)
GALLOP = Gait((0.0, 0.13, 0.46, 0.60), 0.25, (5.6, 7.6), (3.0, 3.5), 0.42, 0.085, 1, 0.80, 0.03)


@dataclass(frozen=True, eq=False)
class Way:
    """Where a dog goes: ``(frames,)`` heading and ``(frames, 2)`` path, leg lengths, and how fast."""

    heading: np.ndarray
    path: np.ndarray
    speed: float
    turning: float


def way(stream: Stream, frames: int, speed: float, most: float) -> Way:
    """A straight way or an even arc of up to ``most`` radians a second."""
    t = seconds(frames)
    turning = stream.choice((0.0, stream.uniform(-most, most)))
    facing = stream.uniform(-np.pi, np.pi)
    heading = facing + turning * t
    if turning == 0.0:
        path = speed * t[:, None] * np.array([np.sin(facing), np.cos(facing)])
    else:
        path = (
            speed
            / turning
            * np.stack([np.cos(facing) - np.cos(heading), np.sin(heading) - np.sin(facing)], axis=-1)
        )
    return Way(heading, path, speed, turning)


def paced(stream: Stream, frames: int, gait: Gait, kind: str, going: Way, habit: Habit) -> DogScore:
    """A gait along a way."""
    t = seconds(frames)
    share = (going.speed - gait.speed[0]) / (gait.speed[1] - gait.speed[0])
    stride = max(gait.stride[0] + share * (gait.stride[1] - gait.stride[0]), 0.7 * gait.stride[0])
    period = FPS * stride / going.speed
    start = stream.uniform(0.0, 1.0)
    phase = start + np.arange(frames) / period
    paws = _paws(stream.part("paws"), frames, gait, period, start, habit)
    beat = 2.0 * np.pi * gait.beats * (phase - gait.phases[0] - 0.5 * gait.duty)
    bounce = habit.bounce * gait.bounce
    height, fore, arch = _heaving(gait, phase, bounce)
    sway = 0.02 * habit.loose * np.sin(2.0 * np.pi * (phase - 0.25 * gait.duty))
    bend = np.clip(0.16 * going.turning, -0.45, 0.45) + np.zeros(frames)
    weave = (0.05 if gait.beats == 2 else 0.0) * np.sin(2.0 * np.pi * (phase - 0.1))
    still = np.zeros((frames, 3))
    pelvis = still.copy()
    pelvis[:, 0] = 0.06 * habit.loose * (gait.beats == 2) * np.sin(2.0 * np.pi * (phase - 0.5 * gait.duty))
    pelvis[:, 2] = 0.05 * habit.loose * (gait.beats == 2) * np.cos(2.0 * np.pi * (phase - 0.5 * gait.duty))
    chest = np.stack([bend + weave, arch, 0.02 * wander(stream, t, 1.0)], axis=-1)
    neck, gaze, tail = head_and_tail(stream, frames, habit, phase)
    neck = neck + (0.25 if kind == "dog_walk" else 0.10 if kind == "trot" else 0.45)
    neck = neck + 0.05 * habit.bounce * np.sin(beat)
    gaze[:, 0] += 0.6 * bend
    return DogScore(
        kind=kind,
        heading=going.heading,
        path=going.path,
        sway=np.stack([sway, np.zeros(frames)], axis=-1),
        height=height,
        balance=np.zeros(frames),
        support=np.full(frames, 0.5),
        trunk=Trunk(pelvis, chest, gaze),
        feet={},
        hands=idle_hands(frames),
        parameters={
            "speed": going.speed,
            "turning": going.turning,
            "stride": stride,
            "period": period / FPS,
        },
        phase=phase,
        fore=fore,
        anchor=np.full(frames, 0.5),
        neck=neck,
        tail=tail,
        spread=np.zeros((frames, 2)),
        paws=paws,
    )


def _heaving(gait: Gait, phase: np.ndarray, bounce: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights of rump and shoulders and the arch of the back, over the period."""
    turn = 2.0 * np.pi
    if gait.beats == 2:
        # highest over the standing leg
        ends = []
        for first in (gait.phases[0], gait.phases[2]):
            ends.append(1.0 - gait.low + bounce * np.cos(2.0 * turn * (phase - first - 0.5 * gait.duty)))
        return ends[0], ends[1], 0.02 * np.sin(turn * phase)
    # galloping: hind paws push, the body flies with paws gathered, the shoulders land; the back folds and
    # stretches once a period
    hind = phase - gait.phases[0] - 0.5 * (gait.duty + 0.13)
    fore = phase - gait.phases[2] - 0.5 * (gait.duty + 0.14)
    arch = 0.18 + 0.34 * np.cos(turn * (phase - 0.96))
    rise = [1.0 - gait.low - bounce * np.cos(turn * each) for each in (hind, fore)]
    return rise[0], rise[1], arch


def _paws(
    stream: Stream, frames: int, gait: Gait, period: float, start: float, habit: Habit
) -> Mapping[str, Paw]:
    """Plants from well before the clip to well after it, no two quite alike."""
    count = int(np.ceil(frames / period)) + 4
    found = {}
    for limb, phase in zip(LIMBS, gait.phases, strict=True):
        plants = []
        lift = gait.lift * habit.lift * (1.0 if "fore" in limb else 0.85 if gait.beats == 2 else 0.6)
        for number in range(-3, count):
            first = period * (number + phase - start)
            down = gait.duty * period
            strike, off = round(first), round(first + down)
            roll = max(2, round(0.36 * (off - strike)))
            plants.append(
                PawPlant(
                    moment=0.5 * (strike + off),
                    out=habit.stance + stream.normal(0.06 * habit.loose),
                    ahead=stream.normal(0.022 * habit.loose),
                    strike=strike,
                    flat=strike + max(1, round(0.14 * (off - strike))),
                    lift=off - roll,
                    off=off,
                    strike_pitch=-0.18,
                    off_pitch=gait.roll_off * habit.roll,
                    lift_height=lift * stream.uniform(0.85, 1.15),
                    curl=0.75 if "fore" in limb else 0.25,
                )
            )
        found[limb] = Paw(tuple(plants), np.zeros(frames))
    return found


# --------------------------------------------------------------------------------------------- kinds
def _kind(stream: Stream, frames: int, gait: Gait, name: str, most: float) -> DogScore:
    habit = Habit.draw(stream)
    speed = stream.uniform(*gait.speed)
    return paced(stream, frames, gait, name, way(stream, frames, speed, most), habit)


def walk(stream: Stream, frames: int) -> DogScore:
    """Four beats, each hind paw followed by the fore paw of its side."""
    return _kind(stream, frames, WALK, "dog_walk", 0.7)


def trot(stream: Stream, frames: int) -> DogScore:
    """Two beats of diagonal pairs."""
    return _kind(stream, frames, TROT, "trot", 0.8)


def gallop(stream: Stream, frames: int) -> DogScore:
    """Hind paws, fore paws, flight; the back folds and stretches."""
    return _kind(stream, frames, GALLOP, "gallop", 0.6)
