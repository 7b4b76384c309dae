"""What pelvis, trunk and arms do over striding legs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..curves import wander
from ..flight import GRAVITY
from ..randomness import Stream
from ..score import SIDES, Air, Foot, Hand, Score, Trunk, sign
from .carriage import Carriage
from .gait import MARGIN, Course, Gait, Tread, plants, support
from .style import hand, hanging, seconds, trunk

_QUICK = (1.5, 4.0)
"""Hertz, of the unsteadiness that is left in practised movements."""


def striding(
    stream: Stream,
    kind: str,
    gait: Gait,
    course: Course,
    feet: Mapping[str, Foot],
    carriage: Carriage,
    **parameters: float | str,
) -> Score:
    """The whole performance over given feet."""
    style, t, phase = gait.style, seconds(gait.frames), gait.phase
    inside = slice(MARGIN, MARGIN + gait.frames)
    active = course.activity[inside]
    over_left = phase - 0.6 * np.pi
    told: dict[str, float | str] = {
        "mode": gait.mode,
        "step": gait.step,
        "stride": gait.stride,
        "turned": gait.turned,
    }
    sway = [carriage.sway * active * np.cos(over_left), 0.014 * active * np.sin(2.0 * over_left)]
    sway[0] = sway[0] + wander(stream, t, 0.004 * style.loose) + 0.25 * _into_the_bend(gait, course)
    # hips stay behind a trunk that leans ahead
    leaning = np.cos(gait.bearing) * (carriage.lean + style.posture - 0.05)
    sway[1] = sway[1] - carriage.back * leaning * active
    sway = [row + wander(stream, t, 0.0022 * style.loose, *_QUICK) for row in sway]
    return Score(
        kind=kind,
        heading=course.heading[inside],
        path=course.place[inside],
        sway=np.stack(sway, axis=-1),
        height=_height(stream, gait, carriage, t, active),
        balance=1.0 - active,
        support=support(gait),
        trunk=_trunk(stream, gait, course, carriage, t, active),
        feet=feet,
        hands={side: _arm(stream, gait, carriage, side, t, active) for side in SIDES},
        parameters=told | parameters,
        phase=phase / (2.0 * np.pi),
    )


def _height(
    stream: Stream, gait: Gait, carriage: Carriage, t: np.ndarray, active: np.ndarray
) -> np.ndarray:
    """Highest over either foot, lowest between them, and shaken a little by every landing."""
    over_left = gait.phase - 0.64 * np.pi
    wave = np.cos(2.0 * over_left) + carriage.shock * np.cos(4.0 * over_left - 1.0)
    bob = carriage.bob * gait.style.bounce * wave + wander(stream, t, 0.0021 * gait.style.loose, *_QUICK)
    return 0.994 + active * (bob - carriage.low)


def stepping(gait: Gait, course: Course, tread: Tread | Mapping[str, Tread]) -> dict[str, Foot]:
    """Feet that go by the gait, from place to place."""
    treads = dict.fromkeys(SIDES, tread) if isinstance(tread, Tread) else tread
    still = np.zeros(gait.frames)
    return {side: Foot(plants(gait, course, side, treads[side]), still) for side in SIDES}


def with_air(feet: Mapping[str, Foot], air: Mapping[str, Air]) -> dict[str, Foot]:
    """The same steps, carried higher."""
    return {side: Foot(foot.plants, foot.heel, air[side]) for side, foot in feet.items()}


def _trunk(
    stream: Stream, gait: Gait, course: Course, carriage: Carriage, t: np.ndarray, active: np.ndarray
) -> Trunk:
    """The pelvis turns with the leg in front and drops on the swinging side, the chest counters both."""
    style = gait.style
    size = active * gait.step / 0.7
    way = np.cos(gait.bearing)
    turn = -carriage.turn * way * size * np.cos(gait.phase)
    drop = -carriage.drop * size * style.bounce * np.cos(gait.phase - 0.35 * np.pi)
    tilt = carriage.tilt * active + 0.02 * size * np.cos(2.0 * gait.phase)
    ahead = np.array([course.at(frame)[0] for frame in np.arange(len(t)) + 9.0])
    looking = ahead - course.heading[MARGIN : MARGIN + len(t)]
    into = _into_the_bend(gait, course)
    pelvis = np.stack([turn, tilt, drop + 0.35 * into], axis=-1)
    chest = np.stack(
        [
            -turn * carriage.counter * (1.0 + 0.8 * style.swing),
            carriage.lean * active + 0.015 * size * np.cos(2.0 * gait.phase - 0.8),
            -0.8 * drop + 0.4 * into,
        ],
        axis=-1,
    )
    nod = carriage.gaze - 0.012 * size * np.cos(2.0 * gait.phase)
    gaze = np.stack([1.6 * looking, nod, 0.0 * t], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze, follow=0.15)


def _into_the_bend(gait: Gait, course: Course) -> np.ndarray:
    """Lean to the left ``(frames,)``, radians, that keeps a body in balance along its bend."""
    turning = np.gradient(course.heading)[MARGIN : MARGIN + gait.frames]
    active = course.activity[MARGIN : MARGIN + gait.frames]
    return np.cos(gait.bearing) * gait.speed * active * turning / GRAVITY


def _arm(
    stream: Stream, gait: Gait, carriage: Carriage, side: str, t: np.ndarray, active: np.ndarray
) -> Hand:
    """Each arm swings with the other side's leg, a little late, and bends more in front."""
    style = gait.style
    still = carriage.still[side == "right"]
    own = (1.0 + sign(side) * style.asymmetry) * (1.0 - still)
    way = np.cos(gait.bearing)
    wave = -sign(side) * way * np.cos(gait.phase - 0.15)
    swing = carriage.swing * style.swing * own * active * min(gait.step / 0.7, 1.3)
    ahead = swing * wave + (carriage.ahead + 0.14) * active - 0.14 + wander(stream, t, 0.03 * style.loose)
    ahead = ahead + wander(stream, t, 0.014 * style.loose, *_QUICK)
    lagging = -sign(side) * way * np.cos(gait.phase - 0.55)
    bend = (
        style.elbow
        + (carriage.bend + 0.4 * still) * active
        + swing * (0.2 + carriage.hinge * (0.35 + lagging))
    )
    bend = bend + wander(stream, t, 0.05 * style.loose) + wander(stream, t, 0.028 * style.loose, *_QUICK)
    aside = style.aside + carriage.aside * active + wander(stream, t, 0.025 * style.loose)
    swivel = carriage.out * active + carriage.behind * swing * (1.0 - wave)
    reach = hanging(ahead, aside, _flexed(bend))
    return hand(stream, t, reach, style, upright=0.8, swivel=swivel)


def _flexed(bend: np.ndarray) -> np.ndarray:
    """Bends of an elbow, eased where it would be straight."""
    return 0.5 * (bend + 0.12 + np.sqrt((bend - 0.12) ** 2 + 0.01))
