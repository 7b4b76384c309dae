"""Lunging, and kneeling down on one knee or both and getting up again."""

from dataclasses import dataclass, replace

import numpy as np

from ...conventions import SIDES, other
from ...curves import plateau, smooth
from ...randomness import Stream
from ..score import Foot, FootContact, Score
from . import arms
from .arms import Shape
from .scene import Scene
from .sequencing import cut
from .style import along, rows


def lunge(stream: Stream, frames: int) -> Score:
    """A long step ahead, down until the hind knee is a hand above the floor, and back; the heel rises."""
    count = max(1, int((frames - 6) / stream.uniform(108.0, 140.0)))
    length = max(frames, 112)
    scene = Scene(stream, length, width=stream.uniform(0.9, 1.2), shift=0.1, loose=0.3)
    long, deep = stream.uniform(0.68, 0.84), stream.uniform(0.28, 0.35)
    style, front = stream.choice(("hips", "ahead", "hang")), stream.choice(SIDES)
    share = (length - 6.0) / count
    for number in range(count):
        start, end = round(4.0 + share * number), round(share * (number + 1.0))
        _one_lunge(scene, front, start, end, long, deep, style)
        front = other(front)
    score = _carried(scene.score("lunge"), scene, 0.48 * long)
    return cut(score, stream.choice((0, length - frames)), frames)


def _one_lunge(
    scene: Scene, front: str, start: int, end: int, long: float, deep: float, style: str
) -> None:
    back = other(front)
    scene.step(front, start, ahead=long, lasting=24)
    scene.step(front, end - 26, ahead=-long, lasting=24)
    top, fall = start + 48.0, end - 58.0
    if fall < top:
        top = fall = 0.5 * (top + fall)
    down = scene.held(start + 18.0, top, fall, end - 20.0)
    scene.low += deep * down
    risen = scene.held(start + 4.0, top, fall, end - 8.0)
    foot = scene.feet.feet[back]
    scene.feet = scene.feet.moved(back, replace(foot, heel=foot.heel + 1.15 * risen))
    scene.lean(down, 0.12, -0.02, 0.08)
    scene.ahead += scene.held(start + 2.0, start + 28.0, end - 34.0, end - 6.0)
    for side in SIDES:
        if style == "hips":
            scene.arm(side, start, top - 12.0, arms.on("hip", side), (0.12, 0.0, 0.06))
            scene.arm(side, fall + 12.0, end)
        elif style == "ahead":
            to = Shape((0.02, -0.08, 0.90), (0.0, 0.0, 0.2), 0.2, 1.0)
            scene.arm(side, start + 6.0, top - 4.0, to)
            scene.arm(side, fall + 6.0, end)


def _carried(score: Score, scene: Scene, far: float) -> Score:
    """The score with the body carried ``far`` leg lengths ahead where ``scene.ahead`` is 1, whatever its
    balance."""
    heading = scene.feet.heading
    line = rows(scene.frames, np.sin(heading), np.cos(heading))
    free = smooth(3.0 * scene.ahead)
    return replace(score, path=(far * scene.ahead)[:, None] * line, balance=1.0 - free)


_SWING = 30
"""Frames in which a foot goes from before the body to kneeling, or back."""


@dataclass(frozen=True)
class _Times:
    """Frames of kneeling down: the step begins, the hind knee is down, the fore foot leaves for the second
    knee and that one is down, and mirrored for getting up. The time that is left over is spent on the
    knees."""

    forth: int
    rise: int
    close: int
    step: int = 5
    knee: int = 46
    leave: int = 50
    both: int = 56 + _SWING


def kneel(stream: Stream, frames: int, rises: bool = False) -> Score:
    """Kneeling down on one knee, or on both and back on the heels, a while there, and up the same way.
    rises: up from both knees alone."""
    kind = "get_up" if rises else "kneel"
    # which part of it is shown where the clip is too short for all
    offset = 1.0 if rises else stream.choice((0.0, 1.0))
    second = rises or stream.choice((True, False))
    length = max(frames, 240 if rises or second else 112)
    if rises and frames > 120:
        length = frames + 110
    times = _Times(forth=length - 60 - _SWING, rise=length - 54, close=length - 28)
    scene = Scene(stream, length, width=stream.uniform(0.9, 1.15), shift=0.1, loose=0.3)
    scene.style = replace(scene.style, toe_out=0.6 * scene.style.toe_out)
    hind = stream.choice(SIDES)
    fore, long = other(hind), stream.uniform(0.72, 0.82)
    one = plateau(scene.k, times.step + 10.0, times.knee, times.rise, times.close + 6.0)
    # how far the body sits back on its heels
    back = 0.0 * one
    if second:
        back = scene.held(times.both, times.both + 26.0, times.forth - 30.0, times.forth - 2.0)
    _upper(scene, times, fore, one, back, second)
    score = scene.score(kind)
    scene.ahead = scene.held(times.step + 2.0, times.step + 28.0, times.close - 10.0, times.close + 18.0)
    # the hind foot bears the weight while the other is on its way
    feet = scene.feet
    for start in (times.step, times.close):
        feet = feet.relieved(fore, start, start + 24, 0.9)
    score = replace(
        _carried(score, scene, 0.45 * long),
        feet={hind: _hind(scene, hind, times, one), fore: _fore(scene, fore, times, second, long)},
        support=feet.support,
        height=score.height - 0.40 * one,
        sit_back=back * stream.uniform(0.45, 0.85) + 0.05 * one,
    )
    return cut(score, round(offset * (length - frames)), frames)


def _hind(scene: Scene, side: str, times: _Times, kneel: np.ndarray) -> Foot:
    """Stays on its toes while the heel rises and the knee goes down."""
    k, foot = scene.k, scene.feet.feet[side]
    # the heel is up before the knee goes down and comes down after the hips are up
    heel = 0.45 * plateau(k, times.step + 6.0, times.step + 18.0, times.step + 20.0, times.knee - 4.0)
    heel += 0.55 * plateau(k, times.rise, times.close - 2.0, times.close + 6.0, times.close + 24.0)
    return replace(foot, heel=heel, kneel=kneel)


def _fore(scene: Scene, side: str, times: _Times, second: bool, long: float) -> Foot:
    """Steps ahead; for the second knee back beside the other foot, ahead again to rise; at last back."""
    stands = scene.feet.feet[side].contacts[0]
    ahead = replace(stands, place=along(scene.heading, long))
    start, close = times.step, times.close
    contacts: list[FootContact] = [
        replace(stands, lift=start, off=start + 5, off_pitch=0.45, lift_height=0.06),
        replace(ahead, strike=start + 20, flat=start + 24, strike_pitch=0.12),
    ]
    kneel, heel = None, np.zeros(scene.frames)
    if second:
        down, up = times.leave, times.forth
        contacts[-1] = replace(contacts[-1], lift=down + 4, off=down + 4, off_pitch=0.0, lift_height=0.03)
        kneeling = replace(
            stands,
            strike=down + _SWING,
            flat=down + _SWING,
            lift=up,
            off=up,
            off_pitch=0.0,
            strike_pitch=0.0,
        )
        contacts += [
            replace(kneeling, lift_height=0.03),
            replace(ahead, strike=up + _SWING - 8, flat=up + _SWING - 8, strike_pitch=0.0),
        ]
        kneel = plateau(scene.k, down + 9.0, down + _SWING + 6.0, up - 4.0, up + 18.0)
        heel = 0.86 * plateau(scene.k, down - 8.0, down + 8.0, down + 14.0, down + _SWING + 6.0)
        heel += 0.85 * plateau(scene.k, up - 4.0, up + 12.0, up + _SWING - 12.0, up + _SWING + 4.0)
    contacts[-1] = replace(contacts[-1], lift=close, off=close + 5, off_pitch=0.15, lift_height=0.06)
    contacts.append(replace(stands, strike=close + 20, flat=close + 24, strike_pitch=0.18))
    return Foot(tuple(contacts), heel, kneel=kneel)


def _upper(scene: Scene, times: _Times, fore: str, one: np.ndarray, back: np.ndarray, second: bool) -> None:
    """The trunk leans into going down and up; hands on the fore knee, on the thighs or at ease."""
    stream = scene.stream
    for start, end in ((times.step + 8.0, times.knee + 6.0), (times.rise - 8.0, times.close + 6.0)):
        middle = 0.5 * (start + end)
        lean = scene.held(start, middle, middle, end)
        scene.lean(lean, 0.14, 0.16, 0.22)
    scene.lean(back, 0.22, -0.06, 0.05)
    scene.lean(one, gaze=0.10)
    if second:
        lap = Shape((0.02, -0.74, 0.40), (-0.2, 0.0, -0.2), swivel=0.35, upright=1.0)
        for side in SIDES:
            scene.hold(side, lap, times.both - 4.0, times.forth, 26.0, (0.08, 0.0, 0.04))
    elif stream.choice((True, True, False)):
        scene.touch(fore, arms.on("knee", fore), times.knee - 24.0, times.rise + 20.0, 24.0)
        scene.lean(one, 0.08, 0.12)
