"""Squatting, touching the floor, and lifting a box that is not there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...conventions import FPS, SIDES
from ...curves import bump, plateau, ramp, wander
from ...randomness import Stream
from ..score import Foot, Hand, HandPlant, Score, Touch, Trunk
from .arms import Shape
from .scene import STEP, Scene, Stance, shifting, slots, small_step, stance
from .sequencing import cut
from .style import Style, hand, hanging, idle_hand, seconds, trunk


@dataclass(frozen=True)
class _Squat:
    """arms: forward, knees, hips or clasped. deep: height of the hip joints at the bottom, leg lengths.
    lean: of the whole trunk at the bottom. times: per squat the seconds at which it begins, is deep, ends
    to be deep, and is over. toes: how far the heels rise after each squat. width: of the stance, half hip
    widths; ``steps_out``: it is taken by a step at the start."""

    arms: str
    deep: float
    lean: float
    times: tuple[tuple[float, float, float, float], ...]
    toes: float
    width: float
    steps_out: bool

    @classmethod
    def draw(cls, stream: Stream, frames: int) -> _Squat:
        arms = stream.choice(("forward", "knees", "hips", "clasped"))
        steps_out = stream.choice((True, False))
        # a wider stance is taken first
        first = (6.0 + STEP) / FPS if steps_out else 0.0
        count = max(1, int((frames / FPS - first) / 2.2))
        share = (frames / FPS - first) / count
        times = []
        for k in range(count):
            begin = first + share * (k + stream.uniform(0.04, 0.10))
            times.append(
                (
                    begin,
                    begin + share * stream.uniform(0.30, 0.36),
                    begin + share * stream.uniform(0.46, 0.56),
                    begin + share * stream.uniform(0.78, 0.86),
                )
            )
        knees = arms == "knees"
        return cls(
            arms=arms,
            deep=stream.uniform(0.66, 0.74) if knees else stream.uniform(0.50, 0.70),
            lean=stream.uniform(0.70, 0.84) if knees else stream.uniform(0.45, 0.75),
            times=tuple(times),
            toes=stream.choice((0.0, 0.0, 0.35)),
            width=stream.uniform(1.3, 2.0),
            steps_out=steps_out,
        )


def squat(stream: Stream, frames: int) -> Score:
    """Squatting down with the weight over both feet, a moment at the bottom, and up."""
    plan, style = _Squat.draw(stream, frames), Style.draw(stream)
    style = replace(style, toe_out=style.toe_out + stream.uniform(0.05, 0.25))
    heading = stream.uniform(-np.pi, np.pi)
    t, still = seconds(frames), np.zeros(frames)
    down = sum((plateau(t, *times) for times in plan.times), start=still)
    rising = sum(
        (plateau(t, up - 0.25, up + 0.1, up + 0.3, up + 0.7) for *_, up in plan.times), start=still
    )
    feet = _feet(stream, style, plan, heading, frames)
    heel = plan.toes * rising
    # the stance's feet, with heels that rise together
    risen = {side: Foot(foot.plants, heel) for side, foot in feet.feet.items()}
    return Score(
        kind="squat",
        heading=feet.heading,
        path=np.zeros((frames, 2)),
        sway=np.zeros((frames, 2)),
        height=0.994 - (0.994 - plan.deep) * down + 0.3 * heel,
        balance=still + 1.0,
        support=feet.support,
        trunk=_trunk(stream, style, plan, t, down),
        feet=risen,
        hands={side: _hand(stream, style, plan, t, down, side) for side in SIDES},
        parameters={"arms": plan.arms, "deep": plan.deep, "lean": plan.lean, "toes": plan.toes},
    )


def _feet(stream: Stream, style: Style, plan: _Squat, heading: float, frames: int) -> Stance:
    support, side = shifting(stream, frames, 0.08), stream.choice(SIDES)
    if not plan.steps_out:
        return stance(heading, style, frames, support, plan.width)
    narrow = stance(heading, style, frames, support, 0.6 * plan.width)
    # the whole difference is made by one foot; the balance brings the body between both
    return small_step(narrow, side, 5, wider=0.8 * plan.width)


def _trunk(stream: Stream, style: Style, plan: _Squat, t: np.ndarray, down: np.ndarray) -> Trunk:
    zero = np.zeros_like(t)
    pelvis = np.stack([zero, 0.03 + 0.55 * plan.lean * down, zero], axis=-1)
    chest = np.stack([zero, 0.45 * plan.lean * down, zero], axis=-1)
    gaze = np.stack([zero, 0.22 * plan.lean * down, zero], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze, follow=0.2)


def _hand(stream: Stream, style: Style, plan: _Squat, t: np.ndarray, down: np.ndarray, side: str) -> Hand:
    if plan.arms == "knees":
        return _on_knee(stream, style, plan, t, side)
    if plan.arms == "hips":
        return _on_hip(stream, style, t, side)
    if plan.arms == "clasped":
        return _clasped(stream, style, t, down, side)
    return _forward(stream, style, t, down)


def _forward(stream: Stream, style: Style, t: np.ndarray, down: np.ndarray) -> Hand:
    """Stretched out in front as a counterweight, a little ahead of the squat."""
    calm = hanging(wander(stream, t, 0.03 * style.loose), style.aside + 0.0 * t, style.elbow + 0.0 * t)
    out = np.array([0.06, -0.06 + 0.1 * style.posture, 0.93])
    share = down * (2.0 - down)
    reach = calm + share[:, None] * (out - calm) + wander(stream, t, 0.012 * style.loose)[:, None]
    return hand(stream, t, reach, style, upright=1.0, swivel=0.25 * share)


def _on_knee(stream: Stream, style: Style, plan: _Squat, t: np.ndarray, side: str) -> Hand:
    """A hand on the thigh just over the knee while the trunk is low."""
    still = np.zeros_like(t)
    held = [(a + 0.25 * (b - a), b - 0.05, c + 0.1, d - 0.2 * (d - c)) for a, b, c, d in plan.times]
    resting = sum((plateau(t, *times) for times in held), start=still)
    calm = idle_hand(stream, len(t), style, (Touch(f"{side}_knee", resting),))
    reached = plateau(t, plan.times[0][0], plan.times[0][1], *plan.times[-1][2:])
    reach = calm.reach + reached[:, None] * np.array([0.0, 0.12, 0.25])
    return replace(calm, reach=reach, upright=still + 1.0, swivel=calm.swivel + 0.35 * resting)


def _on_hip(stream: Stream, style: Style, t: np.ndarray, side: str) -> Hand:
    """A hand on the hip all the while."""
    calm = idle_hand(stream, len(t), style, (Touch(f"{side}_hip", np.ones_like(t)),))
    return replace(calm, swivel=calm.swivel + 0.6)


def _clasped(stream: Stream, style: Style, t: np.ndarray, down: np.ndarray, side: str) -> Hand:
    """Palm to palm before the chest."""
    low = wander(stream, t, 0.015 * style.loose)
    reach = np.stack([0.03 + 0.0 * t, -0.30 + 0.08 * down + low, 0.58 + 0.06 * down], axis=-1)
    touches = (Touch("left_palm", np.ones_like(t)),) if side == "right" else ()
    held = hand(stream, t, reach, style, upright=0.5, middle=1.0, touches=touches)
    # palms face each other, fingers ahead and up
    aim = np.tile([-1.0, 0.0, 0.0, 0.0, 0.45, 0.9], (len(t), 1))
    return replace(held, aim=aim, aimed=np.ones_like(t))


def touch_floor(stream: Stream, frames: int) -> Score:
    """Touching the floor with one hand or both, stooping with all but straight knees or squatting."""
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
        score, hands={side: replace(hand, plants=tuple(plants[side])) for side, hand in score.hands.items()}
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
    """Hands at ease, then as far apart as the box is wide, whatever else happens."""
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
