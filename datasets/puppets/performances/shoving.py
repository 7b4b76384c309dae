"""Pushing and pulling: a lunge, and the weight behind the arms."""

from __future__ import annotations

import numpy as np

from ..randomness import Stream
from ..score import SIDES, Score, sign
from .arms import Shape
from .scene import Scene


def push(stream: Stream, frames: int) -> Score:
    """Both palms ahead at the chest, a step into it, and the weight behind stretching arms."""
    return _shove(stream, frames, "push")


def pull(stream: Stream, frames: int) -> Score:
    """Both hands out to grip, a step back, and the weight behind bending arms."""
    return _shove(stream, frames, "pull")


def _shove(stream: Stream, frames: int, kind: str) -> Score:
    """A lunge with the weight on one foot at first and on the other in the end, once or several times."""
    scene = Scene(stream, frames, width=stream.uniform(1.1, 1.5), shift=0.05)
    moving = stream.choice(SIDES)
    way = 1.0 if kind == "push" else -1.0
    step = way * stream.uniform(0.26, 0.38)
    out = sign(moving)
    first, last = 22.0, frames - 26.0
    count = max(1, int((last - first) / (30.0 * stream.uniform(1.1, 1.7))))
    share = (last - first) / count
    lunge = scene.held(16.0, 30.0, frames - 46.0, frames - 26.0)
    scene.low += 0.075 * lunge
    level, wide = stream.uniform(-0.30, -0.05), stream.uniform(0.20, 0.32)
    near, far = _grips(kind, level, wide)
    away = [scene.held(*times) for times in _strokes(first, share, count)]
    there = sum(away, start=np.zeros(frames))
    start_pose, end_pose = (near, far) if kind == "push" else (far, near)
    for side in SIDES:
        scene.arm(side, 0.0, first + 2.0, start_pose, (0.04, 0.0, 0.08))
        for rise, top, fall, end in _strokes(first, share, count):
            scene.arm(side, rise, top, end_pose)
            scene.arm(side, fall, end, start_pose)
        scene.arm(side, last - 1.0, frames - 1.0)
    # on the standing foot at first, then over the one that stepped
    begun, over = 0.5 - 0.22 * out, 0.5 + 0.34 * out
    hold = scene.held(20.0, 32.0, frames - 48.0, frames - 32.0)
    scene.shift_weight(hold, begun + (over - begun) * there)
    scene.low += 0.03 * there
    if frames >= 105:
        scene.step(moving, 5, step, 0.1, lasting=21)
        scene.step(moving, frames - 28, -step, -0.1, lasting=22)
    scene.bend(lunge, pelvis=(0.0, 0.10 * way, 0.0), chest=(0.0, 0.10 * way, 0.0), gaze=(0.0, 0.04, 0.0))
    scene.bend(
        there, pelvis=(0.0, 0.08 * way, 0.0), chest=(0.0, 0.10 * way - 0.02, 0.0), gaze=(0.0, 0.05, 0.0)
    )
    return scene.score(kind, times=count)


def _strokes(first: float, share: float, count: int) -> list[tuple[float, float, float, float]]:
    """Frames at which each stroke begins, is full, is let go, and is back."""
    parts = np.round(first + share * (np.arange(count)[:, None] + np.array([0.0, 0.52, 0.57, 1.0])))
    return [(a, b, c, d) for a, b, c, d in parts.tolist()]


def _grips(kind: str, level: float, wide: float) -> tuple[Shape, Shape]:
    """The hands near the chest and far from it: open palms that push, or a grip that pulls."""
    if kind == "push":
        palm, fingers = (0.0, -0.4, 0.9), (0.1, 0.9, 0.45)
    else:
        palm, fingers = (-0.9, -0.3, 0.0), (-0.05, 0.1, 1.0)
    near = Shape(
        (wide + 0.06, level - 0.08, 0.53), swivel=0.2, upright=0.9, middle=1.0, palm=palm, fingers=fingers
    )
    far = Shape((wide, level, 0.88), swivel=0.15, upright=0.9, middle=1.0, palm=palm, fingers=fingers)
    return near, far
