"""Kicks, punches, throws and catches, pushing and pulling: the whole body behind a hand or a foot.

Punches and kicks hit nothing: muscles stop hand and foot over several frames, feet are set down softly,
and no velocity jumps. So none of them declares an impact.
"""

from dataclasses import replace

import numpy as np

from ...conventions import SIDES, other, sign
from ...randomness import Stream
from ..score import Air, Score
from .arms import Shape, Triple
from .scene import Scene, slots

_GUARD = Shape((-0.02, -0.30, 0.46), swivel=-0.1, palm=(-0.8, 0.1, -0.6), fingers=(0.0, 0.9, 0.4))


def kick(stream: Stream, frames: int, kind: str) -> Score:
    """``kick_front``: the knee comes up, the shin snaps forward and back; ``kick_side``: the body tips
    away, the leg is thrust out sideways, heel first. The foot is set down where it was."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.4), shift=0.1)
    first = stream.choice(SIDES)
    for number, (start, end) in enumerate(slots(stream, frames, 1.7, 2.4)):
        side = first if number % 2 == 0 else stream.choice(SIDES)
        room = end - start
        off = round(start + 0.17 * room)
        down = round(off + min(0.66 * room, 46.0))
        _kick(scene, kind, side, off, down, stream.uniform(0.0, 1.0))
    return scene.score(kind)


def _kick(scene: Scene, kind: str, side: str, off: int, down: int, high: float) -> None:
    """One kick between the foot's leaving the floor and its coming down again."""
    out, long = sign(side), down - off
    up, hit, back = off + 0.33 * long, off + 0.52 * long, off + 0.68 * long
    # in little time a smaller kick
    size = min(max((long - 14.0) / 34.0, 0.4), 1.0)
    scene.step(side, off - 5, lasting=down - off + 9)
    aloft = scene.held(off, up, back, down)
    struck = size * scene.held(up - 3.0, hit, hit + 1.0, back + 3.0)
    tipped = 0.5 * aloft + 0.5 * struck
    if kind == "kick_front":
        chamber, full, swivel = (0.02, -0.46, 0.30), (0.0, -0.42 + 0.42 * high, 0.84), 0.0 * struck
        scene.bend(tipped, (-0.10 * out, -0.20, 0.0), (0.05 * out, 0.12, 0.0))
        point = 0.5
    else:
        chamber, full, swivel = (0.16, -0.46, 0.30), (0.86, -0.40 + 0.30 * high, 0.08), 0.3 + 0.0 * struck
        scene.bend(
            tipped,
            pelvis=(-0.25 * out, 0.05, -0.42 * out),
            chest=(0.12 * out, 0.05, -0.20 * out),
            gaze=(0.65 * out, 0.0, -0.15 * out),
        )
        point = -0.05
    reach = np.array(chamber) + struck[:, None] * (np.array(full) - np.array(chamber))
    scene.air(side, Air(reach, aloft, swivel, 0.35 + (point - 0.35) * struck))
    scene.low += 0.025 * aloft
    for each in SIDES:
        scene.arm(each, off - 13.0, off + 0.3 * long, _GUARD, (0.0, 0.0, 0.05))
    scene.arm(side, up - 4.0, hit + 2.0, Shape((0.35, -0.60, -0.10), swivel=0.2))
    scene.arm(side, hit + 4.0, back + 9.0, _GUARD)
    for each in SIDES:
        scene.arm(each, down - 4.0, down + 13.0)


def punch(stream: Stream, frames: int) -> Score:
    """Hands up, one foot ahead, then straight punches, hooks and uppercuts one after the other."""
    scene = Scene(stream, frames, width=stream.uniform(1.2, 1.6), shift=0.05)
    front = stream.choice(("left", "left", "right"))
    step, up = stream.uniform(0.20, 0.28), 18.0
    # in little time from where one stands
    if frames >= 110:
        scene.step(front, 6, step, 0.1)
        scene.step(front, frames - 24, -step, -0.1)
    ready = scene.held(4.0, 4.0 + up, frames - 24.0, frames - 5.0)
    scene.low += 0.06 * ready
    out = sign(front)
    # the trunk stays half turned away from the front foot
    scene.bend(ready, (-0.22 * out, 0.05, 0.0), (-0.10 * out, 0.12, 0.0), (0.0, 0.06, 0.0))
    for side in SIDES:
        scene.arm(side, 4.0, 4.0 + up, _GUARD, (0.0, 0.0, 0.06))
    at, side = 22.0, front
    while at == 22.0 or at + 25.0 < frames - 18.0:
        _blow(scene, side, stream.choice(("straight", "straight", "hook", "uppercut")), at, ready)
        at += stream.uniform(17.0, 25.0)
        side = other(side) if stream.uniform(0.0, 1.0) < 0.8 else side
    for side in SIDES:
        scene.arm(side, frames - 24.0, frames - 5.0)
    return scene.score("punch")


_BLOWS: dict[str, tuple[Triple, float, float, Triple, Triple, Triple]] = {
    # reach, swivel, upright, palm, fingers, arc
    "straight": ((-0.22, 0.02, 0.92), 0.35, 0.8, (-0.75, -0.65, 0.0), (-0.1, 0.1, 1.0), (0.0, 0.0, 0.0)),
    "hook": ((-0.30, 0.06, 0.62), 0.9, 0.7, (-0.45, -0.35, -0.8), (-0.75, 0.1, 0.6), (0.30, 0.0, 0.05)),
    "uppercut": ((-0.20, 0.14, 0.55), -0.1, 0.8, (-0.7, 0.1, -0.7), (-0.1, 0.95, 0.3), (0.06, -0.30, 0.06)),
}


def _blow(scene: Scene, side: str, blow: str, at: float, ready: np.ndarray) -> None:
    """A blow, out in eleven frames and back in thirteen, driven by hips and shoulders."""
    reach, swivel, upright, palm, fingers, arc = _BLOWS[blow]
    to = Shape(reach, swivel=swivel, upright=upright, palm=palm, fingers=fingers)
    scene.arm(side, at, at + 11.0, to, arc)
    scene.arm(side, at + 12.0, at + 25.0, _GUARD)
    turn, out = scene.held(at - 2.0, at + 10.0, at + 12.0, at + 26.0), -sign(side)
    scene.bend(turn * ready, (0.28 * out, 0.0, 0.0), (0.32 * out, 0.05, 0.0))
    scene.weight(turn, 0.5 - 0.22 * sign(side) * 0.5)


def throw(stream: Stream, frames: int) -> Score:
    """Overarm: weight back and arm cocked, a step, the whip of hip, chest and arm, the follow-through."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.4), shift=0.08)
    side = stream.choice(("right", "right", "left"))
    lead, out = other(side), sign(side)
    for start, end in slots(stream, frames, 2.4, 3.4):
        room = end - start
        # with time enough both hands meet first
        gathered = start + 0.16 * room if room > 70.0 else start - 4.0
        cocked = gathered + max(0.20 * room, 19.0)
        let_go, calm = cocked + 13.0, cocked + 24.0
        rest = min(calm, end - 20.0)
        before = scene.held(start, start + 0.2 * room, cocked - 4.0, cocked + 9.0)
        scene.weight(before, 0.5 + 0.38 * out)
        scene.weight(scene.held(cocked, let_go - 2.0, max(rest, let_go), end - 4.0), 0.5 - 0.30 * out)
        step = stream.uniform(0.30, 0.45)
        if room > 92.0:
            scene.step(lead, round(cocked) - 11, step)
            scene.step(lead, round(end) - 22, -step, lasting=21)
        back = scene.held(start, cocked - 3.0, cocked, let_go)
        through = scene.held(cocked, let_go + 2.0, max(rest, let_go + 2.0), end + 2.0)
        scene.bend(back, (-0.55 * out, -0.05, 0.0), (-0.45 * out, -0.10, -0.10 * out))
        scene.bend(through, (0.28 * out, 0.10, 0.0), (0.40 * out, 0.25, 0.06 * out), (0.0, 0.05, 0.0))
        scene.low += 0.05 * through + 0.02 * back
        both = Shape((-0.05, -0.40, 0.42), upright=0.6, palm=(-0.9, 0.2, -0.2), fingers=(-0.1, 0.4, 0.9))
        for each in SIDES if gathered > start else ():
            scene.arm(each, start - 2.0, gathered, both)
        drawn_back = Shape((0.52, 0.20, -0.26), (-0.35, 0.0, -0.4), 0.1, 0.3)
        scene.arm(side, gathered, cocked, drawn_back, (0.15, -0.25, -0.05))
        thrown = Shape((0.28, 0.42, 0.72), (0.25, 0.0, -0.2), 0.2, 0.4)
        scene.arm(side, cocked + 3.0, let_go, thrown, (0.05, 0.12, 0.0))
        scene.arm(side, let_go - 3.0, calm, Shape((-0.35, -0.60, 0.45), (0.2, 0.0, 0.0), 0.1, 0.4))
        scene.arm(side, calm - 2.0, end + 2.0)
        scene.arm(lead, gathered, cocked - 1.0, Shape((0.10, 0.05, 0.85), (-0.1, 0.0, 0.0), 0.3, 0.7))
        scene.arm(lead, cocked + 1.0, let_go + 1.0, Shape((0.30, -0.45, 0.10), swivel=0.1))
        scene.arm(lead, calm - 4.0, end)
    return scene.score("throw")


def catch(stream: Stream, frames: int) -> Score:
    """The hands go to meet it, close, and bring it in to the belly, knees giving way; then down."""
    scene = Scene(stream, frames, width=stream.uniform(1.2, 1.8), shift=0.1)
    wide = stream.uniform(0.13, 0.20)
    for start, end in slots(stream, frames, 1.9, 3.0):
        room = end - start
        aside, level = stream.uniform(-0.30, 0.30), stream.uniform(-0.35, 0.45)
        met = start + 0.36 * room
        caught = met + 9.0
        away = end - 0.24 * room
        for side in SIDES:
            to = aside * sign(side)
            reach, wrist = (wide + to, level, 0.80), (0.0, 0.0, 0.3)
            palm, fingers = (-0.75, 0.0, 0.65), (0.15, 0.95, 0.3)
            out = Shape(reach, wrist, 0.2, 0.8, 1.0, palm=palm, fingers=fingers)
            reach, palm, fingers = (wide + 0.2 * to, -0.52, 0.42), (-1.0, 0.0, -0.1), (-0.1, 0.3, 0.95)
            held = Shape(reach, wrist, 0.35, 0.6, 1.0, palm=palm, fingers=fingers)
            scene.arm(side, start, met - 2.0, out, (0.05, 0.0, 0.05))
            scene.arm(side, met - 1.0, caught + 4.0, held)
            scene.arm(side, away, end)
        ready = scene.held(start, met - 4.0, met, caught + 4.0)
        give = scene.held(met - 2.0, caught, caught + 4.0, caught + 18.0)
        scene.low += 0.05 * ready + 0.07 * give
        scene.bend(
            ready,
            pelvis=(-0.2 * aside, 0.06, 0.0),
            chest=(-0.3 * aside, 0.10, 0.0),
            gaze=(-0.5 * aside, -0.3 * level, 0.0),
        )
        scene.lean(give, 0.04, 0.14, 0.25)
        scene.weight(scene.held(start, met - 2.0, caught, end - 4.0), 0.5 + 0.3 * aside)
    return scene.score("catch")


def shove(stream: Stream, frames: int, kind: str) -> Score:
    """``push``: both palms ahead, a step into it, and the weight behind stretching arms; ``pull``: both
    hands out to grip, a step back, and the weight behind bending arms. The weight is on one foot at first
    and on the other in the end, once or several times."""
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
    scene.weight(hold, begun + (over - begun) * there)
    scene.low += 0.03 * there
    if frames >= 105:
        scene.step(moving, 5, step, 0.1, lasting=21)
        scene.step(moving, frames - 28, -step, -0.1, lasting=22)
    scene.lean(lunge, 0.10 * way, 0.10 * way, 0.04)
    scene.lean(there, 0.08 * way, 0.10 * way - 0.02, 0.05)
    return scene.score(kind)


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
    far = replace(near, reach=(wide, level, 0.88), swivel=0.15)
    return near, far
