"""Sitting down, on an imagined seat or on the floor, and getting up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..curves import smooth
from ..randomness import Stream
from ..score import SIDES, HandPlant, Score
from . import arms
from .arms import Shape
from .cutting import cut
from .kneeling import rising
from .scene import Scene

_DOWN, _UP = 42.0, 40.0
"""Frames of sitting down and getting up, on a seat; on the floor half as long again."""


def sit(stream: Stream, frames: int) -> Score:
    """Down on a seat or on the floor, and a while there."""
    return _sitting(stream, frames, "sit", stream.choice(("seat", "seat", "floor")), rises=False)


def get_up(stream: Stream, frames: int) -> Score:
    """Up to standing from a seat, from the floor or from both knees."""
    begins = stream.choice(("seat", "floor", "knees"))
    if begins == "knees":
        return rising(stream, frames)
    return _sitting(stream, frames, "get_up", begins, rises=True)


def _sitting(stream: Stream, frames: int, kind: str, on: str, rises: bool) -> Score:
    """The whole of sitting down and getting up, of which the clip shows one part."""
    slow = 1.5 if on == "floor" else 1.0
    down, up = slow * _DOWN, slow * _UP
    whole = round(frames + down + up + 60.0)
    scene = Scene(stream, whole, width=stream.uniform(1.1, 1.5), shift=0.1)
    first, last = 5.0, whole - 6.0
    low = 0.46 if on == "seat" else 0.90
    far = stream.uniform(0.42, 0.47) if on == "seat" else stream.uniform(0.66, 0.74)
    low -= stream.uniform(0.0, 0.05) if on == "seat" else 0.0
    late, soon = (0.10, 0.96) if on == "seat" else (0.22, 0.84)
    lowered = scene.held(first + late * down, first + down, last - up, last - late * up)
    behind = scene.held(first, first + soon * down, last - (soon + 0.02) * up, last - 0.05 * up)
    scene.low = low * lowered
    _lean(scene, on, first, down, up, last)
    if on == "seat":
        _hands_on_thighs(scene, first, down, up, last)
        plants: dict[str, tuple[HandPlant, ...]] = {}
    else:
        plants = _floor_hands(scene, far, first, down, up, last)
    heading = scene.feet.heading
    back = np.stack([-np.sin(heading), -np.cos(heading)], axis=-1)
    score = scene.score(kind, on=on)
    score = replace(
        score,
        path=far * behind[:, None] * back,
        balance=1.0 - smooth((lowered - 0.35) / 0.6),
        hands={side: replace(hand, plants=plants.get(side, ())) for side, hand in score.hands.items()},
    )
    return cut(score, whole - frames if rises else 0, frames)


def _lean(scene: Scene, on: str, first: float, down: float, up: float, last: float) -> None:
    """Forward while the hips go back or come forward, upright or leaning back when seated."""
    deep = 0.50 if on == "seat" else 0.02
    for share in (
        scene.held(first, first + 0.55 * down, first + 0.60 * down, first + 1.15 * down),
        scene.held(last - 1.2 * up, last - 0.72 * up, last - 0.66 * up, last),
    ):
        scene.bend(
            share, pelvis=(0.0, 0.55 * deep, 0.0), chest=(0.0, 0.45 * deep, 0.0), gaze=(0.0, 0.15, 0.0)
        )
    seated = scene.held(first + 0.6 * down, first + 1.1 * down, last - 1.1 * up, last - 0.7 * up)
    tilt = -0.10 if on == "seat" else -0.66
    scene.bend(seated, pelvis=(0.0, tilt, 0.0), chest=(0.0, -0.17 * tilt, 0.0), gaze=(0.0, 0.05, 0.0))
    for _ in range(2):
        at = scene.stream.uniform(-0.5, 0.5)
        start = first + down + scene.stream.uniform(0.0, 30.0)
        share = scene.held(start, start + 24.0, start + 40.0, start + 66.0)
        scene.bend(share, chest=(0.15 * at, 0.0, 0.0), gaze=(at, 0.06, 0.0))


def _hands_on_thighs(scene: Scene, first: float, down: float, up: float, last: float) -> None:
    """On the knees or lying in the lap; at ease before and after."""
    style = scene.stream.choice(("knees", "lap"))
    scene.parameters["arms"] = style
    for side in SIDES:
        late = scene.stream.uniform(0.0, 4.0)
        start, end = first + 0.45 * down + late, last - 0.55 * up - late
        if style == "knees":
            scene.touch(side, arms.on_knee(side), start, end, 28.0)
            continue
        lap = Shape((0.05, -0.70, 0.46), (-0.25, 0.0, -0.1), swivel=0.3, upright=1.0)
        scene.arm(side, start, start + 28.0, lap, (0.06, 0.0, 0.06))
        scene.arm(side, end - 28.0, end)


def _floor_hands(
    scene: Scene, far: float, first: float, down: float, up: float, last: float
) -> dict[str, tuple[HandPlant, ...]]:
    """Both on the floor behind the hips, fingers outward; ahead as a counterweight on the way."""
    heading = float(scene.feet.heading[0])
    place = (-far * float(np.sin(heading)), -far * float(np.cos(heading)))
    strike, off = round(first + 1.0 * down), round(last - 1.0 * up)
    ahead = Shape((0.10, -0.25, 0.80), swivel=0.2, upright=1.0)
    plants: dict[str, tuple[HandPlant, ...]] = {}
    for side in SIDES:
        scene.arm(side, first + 0.05 * down, first + 0.5 * down, ahead, (0.05, 0.0, 0.0))
        scene.arm(side, last - 0.5 * up, last - 0.05 * up)
        plants[side] = (
            HandPlant(
                place,
                heading,
                strike,
                off,
                coming=round(0.42 * down),
                going=round(0.40 * up),
                ahead=-0.62,
                width=1.25,
                turned=0.9,
            ),
        )
    return plants
