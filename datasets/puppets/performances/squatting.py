"""Squatting: once or twice, hands in front, on knees, on hips or clasped, sometimes rising on the toes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..curves import plateau, wander
from ..randomness import Stream
from ..score import FPS, SIDES, Foot, Hand, Score, Touch, Trunk
from .standing import STEP, Stance, shifting, small_step, stance
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
    """Down with the weight over both feet, a moment at the bottom, and up."""
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
    """On the thigh just over the knee while the trunk is low."""
    still = np.zeros_like(t)
    held = [(a + 0.25 * (b - a), b - 0.05, c + 0.1, d - 0.2 * (d - c)) for a, b, c, d in plan.times]
    resting = sum((plateau(t, *times) for times in held), start=still)
    calm = idle_hand(stream, len(t), style, (Touch(f"{side}_knee", resting),))
    reached = plateau(t, plan.times[0][0], plan.times[0][1], *plan.times[-1][2:])
    reach = calm.reach + reached[:, None] * np.array([0.0, 0.12, 0.25])
    return replace(calm, reach=reach, upright=still + 1.0, swivel=calm.swivel + 0.35 * resting)


def _on_hip(stream: Stream, style: Style, t: np.ndarray, side: str) -> Hand:
    """On the hip all the while."""
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
