"""Down to the floor with the hands: touching it, and lifting a box that is not there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..curves import bump, plateau, ramp, wander
from ..randomness import Stream
from ..score import SIDES, Hand, HandPlant, Score
from .arms import Shape
from .cutting import cut
from .scene import Scene, slots
from .style import hanging


def touch_floor(stream: Stream, frames: int) -> Score:
    """With one hand or both, stooping with all but straight knees or squatting."""
    scene = Scene(stream, max(frames, 80), width=stream.uniform(1.3, 1.9), shift=0.1, loose=0.3)
    how, hands = stream.choice(("stoop", "squat")), stream.choice((SIDES, SIDES, ("left",), ("right",)))
    heading = float(scene.feet.heading[0])
    ahead = stream.uniform(0.25, 0.32)
    place = (ahead * float(np.sin(heading)), ahead * float(np.cos(heading)))
    plants: dict[str, list[HandPlant]] = {side: [] for side in SIDES}
    for start, end in slots(stream, scene.frames, 2.7, 4.2):
        down = min(40.0, 0.44 * (end - start))
        bent = scene.held(start, start + down, end - down, end)
        _bend_down(scene, how, bent)
        for side in hands:
            strike, off = round(start + down), round(end - down)
            go = round(0.62 * down)
            plants[side].append(
                HandPlant(
                    place, heading, strike, off, go, go, width=0.75, turned=-0.15, tilt=1.25, crouch=True
                )
            )
            reaching = Shape((0.0, -0.75, 0.52), swivel=0.15, upright=1.0)
            scene.arm(side, start + 0.1 * down, start + 0.8 * down, reaching)
            scene.arm(side, end - 0.8 * down, end)
    score = scene.score("touch_floor", how=how, hands=len(hands))
    score = replace(
        score,
        hands={side: replace(hand, plants=tuple(plants[side])) for side, hand in score.hands.items()},
    )
    return cut(score, 0, frames)


def _bend_down(scene: Scene, how: str, bent: np.ndarray) -> None:
    if how == "stoop":
        scene.low += 0.14 * bent
        scene.bend(bent, pelvis=(0.0, 0.88, 0.0), chest=(0.0, 0.64, 0.0), gaze=(0.0, 1.15, 0.0))
    else:
        scene.low += 0.38 * bent
        scene.bend(bent, pelvis=(0.0, 0.42, 0.0), chest=(0.0, 0.62, 0.0), gaze=(0.0, 0.75, 0.0))


@dataclass(frozen=True)
class _Box:
    """ahead: of the ankles, leg lengths. half: of its width, arm lengths. level: of the grip over the
    floor, leg lengths. carried: where the wrists hold it before the body (up, forward), arm lengths."""

    ahead: float
    half: float
    level: float
    carried: tuple[float, float]

    def plant(self, heading: float, strike: int, off: int, coming: int, going: int) -> HandPlant:
        x, z = self.ahead * float(np.sin(heading)), self.ahead * float(np.cos(heading))
        return HandPlant(
            (x, z),
            heading,
            strike,
            off,
            coming,
            going,
            width=0.0,
            apart=self.half,
            level=self.level,
            crouch=True,
        )


_DOWN, _GRIP, _UP = 44, 6, 46
"""Frames of going down, of taking or letting go, of going up."""


def lift(stream: Stream, frames: int) -> Score:
    """Down by the knees or the back, both hands to the box, up with it; where there is time, down again."""
    round_trip = 4 * (_DOWN + _GRIP) + 20
    back = frames >= round_trip
    whole = frames if back else max(frames, _DOWN + _GRIP + _UP + 16)
    scene = Scene(stream, whole, width=stream.uniform(1.3, 1.8), shift=0.1, loose=0.3)
    how = stream.choice(("squat", "squat", "stoop"))
    box = _Box(
        stream.uniform(0.34, 0.42),
        stream.uniform(0.26, 0.36),
        stream.uniform(0.34, 0.46),
        (stream.uniform(-0.52, -0.36), stream.uniform(0.50, 0.62)),
    )
    heading, start = float(scene.feet.heading[0]), 6
    grip = start + _DOWN
    plants = [box.plant(heading, grip, grip + _GRIP, round(0.6 * _DOWN), round(0.75 * _UP))]
    ends: tuple[float, float] = (1e6, 1e6 + 1.0)
    bent = scene.held(start, grip, grip + _GRIP, grip + _GRIP + _UP)
    if back:
        put = whole - 6 - _UP - _GRIP
        plants.append(box.plant(heading, put, put + _GRIP, round(0.75 * _DOWN), round(0.6 * _UP)))
        bent = bent + scene.held(put - _DOWN, put, put + _GRIP, put + _GRIP + _UP)
        ends = (put + _GRIP, put + _GRIP + 0.8 * _UP)
    deep = (0.32, 0.40, 0.62, 0.50) if how == "squat" else (0.14, 0.95, 0.60, 0.95)
    scene.low += deep[0] * bent
    scene.bend(bent, pelvis=(0.0, deep[1], 0.0), chest=(0.0, deep[2], 0.0), gaze=(0.0, deep[3], 0.0))
    taken = plateau(scene.k, start + 0.1 * _DOWN, start + 0.9 * _DOWN, *ends)
    held = taken * ramp(scene.k, grip, grip + _UP)
    scene.bend(held * (1.0 - bent), pelvis=(0.0, -0.05, 0.0), chest=(0.0, -0.08, 0.0))
    hands = _both_hands(scene, box, taken, tuple(plants))
    score = replace(scene.score("lift", how=how, width=2.0 * box.half, level=box.level), hands=hands)
    return cut(score, 0 if back else stream.choice((0, whole - frames)), frames)


def _both_hands(
    scene: Scene, box: _Box, taken: np.ndarray, plants: tuple[HandPlant, ...]
) -> dict[str, Hand]:
    """At ease, then as far apart as the box is wide, whatever else happens."""
    t, stream, style = scene.k / 30.0, scene.stream, scene.style
    shared = np.stack([0.0 * t, wander(stream, t, 0.008), wander(stream, t, 0.008)], axis=-1)
    carried = np.array([box.half, *box.carried]) + shared
    s, still = taken[:, None], np.zeros_like(t)
    hands = {}
    for side in SIDES:
        swing, aside, bend = (wander(stream, t, size * style.loose) for size in (0.03, 0.02, 0.05))
        hang = hanging(swing, style.aside + aside, style.elbow + bend)
        out = bump(taken)[:, None] * np.array([0.10, 0.0, 0.05])
        hands[side] = Hand(
            reach=hang + s * (carried - hang) + out,
            upright=0.7 + 0.3 * taken,
            middle=taken,
            swivel=0.15 * taken,
            wrist=np.stack([0.18 + still, still, still], axis=-1),
            aim=np.tile([-1.0, 0.0, 0.0, 0.0, -0.35, 0.94], (len(t), 1)),
            aimed=taken,
            plants=plants,
        )
    return hands
