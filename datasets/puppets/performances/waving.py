"""Waving, standing: one hand or both, with shifts of weight, gaze, and now and then a small step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..curves import plateau, ramp, wander
from ..randomness import Stream
from ..score import SIDES, Hand, Score, Touch, Trunk, sign
from .standing import Stance, lift_heel, shifting, small_step, stance, turn
from .style import Style, hand, hanging, idle_hand, seconds, trunk

_SHAPES = {
    # reach of the raised hand (out, up, forward); how far it swings outward and up; elbow; palm
    "small": ((0.34, 0.10, 0.48), (0.10, 0.03), -0.1, -0.9),
    "usual": ((0.42, 0.40, 0.34), (0.17, 0.05), -0.3, -1.0),
    "high": ((0.26, 0.84, 0.22), (0.28, 0.08), 0.0, -0.7),
}


@dataclass(frozen=True)
class _Wave:
    """hands: which ones wave. shape: of the arm. rate: hertz. size: 1 is usual. up, down: seconds between
    which the hand is raised. at: direction of the gaze. rest: what the other hand does."""

    hands: tuple[str, ...]
    shape: str
    rate: float
    size: float
    up: float
    down: float
    at: float
    rest: str

    @classmethod
    def draw(cls, stream: Stream, frames: int) -> _Wave:
        length = frames / 30.0
        shape = stream.choice(("small", "usual", "usual", "high"))
        hands = stream.choice((("left",), ("right",), ("right",), SIDES))
        up = stream.uniform(-0.2, 0.3 * length)
        return cls(
            hands=hands,
            shape="high" if len(hands) == 2 else shape,
            rate=stream.uniform(0.9, 1.9) * (0.75 if shape == "high" or len(hands) == 2 else 1.0),
            size=stream.uniform(0.7, 1.25),
            up=up,
            down=min(up + stream.uniform(2.0, 4.5), length + stream.uniform(-0.5, 0.5)),
            at=stream.uniform(-0.6, 0.6),
            rest=stream.choice(("hang", "hip")),
        )


def wave(stream: Stream, frames: int) -> Score:
    """A greeting: the hand goes up, swings from the elbow, the rest of the body takes part."""
    plan, style = _Wave.draw(stream, frames), Style.draw(stream)
    soft, upright = 0.065 * stream.uniform(0.0, 1.0) ** 2.2 - 0.008, stream.normal(0.075)
    style = replace(
        style,
        aside=style.aside + 0.42 * stream.uniform(0.0, 1.0) ** 1.5,
        posture=style.posture + upright,
    )
    heading = stream.uniform(-np.pi, np.pi)
    t, still = seconds(frames), np.zeros(frames)
    feet = _feet(stream, style, heading, frames)
    raised = plateau(t, plan.up, plan.up + 0.85, plan.down, plan.down + 0.9)
    swing = plan.size * raised * np.sin(2.0 * np.pi * plan.rate * (t - plan.up))
    lift = raised * float(sum(sign(side) for side in plan.hands))
    return Score(
        kind="wave",
        heading=feet.heading,
        path=np.zeros((frames, 2)),
        sway=np.zeros((frames, 2)),
        height=0.990 - soft - 0.012 * np.abs(feet.tip) + 0.004 * np.abs(swing),
        balance=still + 1.0,
        support=feet.support,
        trunk=_trunk(stream, style, plan, t, feet, raised, lift, swing),
        feet=feet.feet,
        hands={
            side: _waving(stream, style, plan, t, raised, swing)
            if side in plan.hands
            else _resting(stream, style, plan, t, side)
            for side in SIDES
        },
        parameters={
            "hands": "+".join(plan.hands),
            "shape": plan.shape,
            "rate": plan.rate,
            "rest": plan.rest,
        },
    )


def _feet(stream: Stream, style: Style, heading: float, frames: int) -> Stance:
    """The weight wanders; the body turns to whom it greets, or a foot steps aside, or a heel lifts."""
    width = style.stance * stream.uniform(1.0, 1.7)
    feet = stance(heading, style, frames, shifting(stream, frames, 0.40), width)
    what, side = stream.choice(("turn", "turn", "step", "heel")), stream.choice(SIDES)
    start = round(stream.uniform(0.05, 0.45) * frames)
    if what == "turn":
        return turn(feet, round(0.3 * start) + 6, stream.sign() * stream.uniform(0.5, 1.1))
    if what == "step":
        return small_step(feet, side, start, stream.uniform(-0.15, 0.20), stream.uniform(-0.3, 0.8))
    length = round(stream.uniform(24.0, 45.0))
    return lift_heel(feet, side, start, start + length, stream.uniform(0.25, 0.5))


def _trunk(
    stream: Stream,
    style: Style,
    plan: _Wave,
    t: np.ndarray,
    feet: Stance,
    raised: np.ndarray,
    lift: np.ndarray,
    swing: np.ndarray,
) -> Trunk:
    """The hip drops over the idle leg, the chest evens that out and leans off the raised arm."""
    zero = np.zeros_like(t)
    pelvis = np.stack([0.06 * feet.tip + 0.25 * plan.at * raised, 0.02 + zero, -0.08 * feet.tip], axis=-1)
    side = 0.10 * feet.tip - 0.06 * lift - 0.015 * swing * np.sign(lift)
    chest = np.stack([0.30 * plan.at * raised + 0.05 * lift, -0.04 * raised, side], axis=-1)
    # the eyes turn before the feet
    ahead = 0.8 * (feet.heading[-1] - feet.heading) * ramp(t, -0.1, 0.5)
    gaze = np.stack([0.85 * plan.at * raised + ahead, -0.05 * raised, 0.05 * lift], axis=-1)
    return trunk(stream, t, style, pelvis=pelvis, chest=chest, gaze=gaze, follow=0.1)


def _waving(
    stream: Stream,
    style: Style,
    plan: _Wave,
    t: np.ndarray,
    raised: np.ndarray,
    swing: np.ndarray,
) -> Hand:
    """Up in front of the body, then from side to side about the elbow, the wrist trailing."""
    base, (wide, rise), elbow, palm = _SHAPES[plan.shape]
    still = np.zeros_like(t)
    down = hanging(wander(stream, t, 0.03 * style.loose), still + style.aside, still + style.elbow)
    # two hands wave in and out together
    up = np.stack([base[0] + wide * swing, base[1] - rise * swing * swing, base[2] + still], axis=-1)
    reach = down + raised[:, None] * (up - down)
    reach[:, 2] += 1.2 * raised * (1.0 - raised)
    late = raised * np.sin(2.0 * np.pi * plan.rate * (t - plan.up) - 0.7) * plan.size
    wrist = np.stack([-0.25 * raised, -0.30 * late, palm * raised], axis=-1)
    return hand(stream, t, reach, style, upright=0.6, swivel=elbow * raised, wrist=wrist)


def _resting(stream: Stream, style: Style, plan: _Wave, t: np.ndarray, side: str) -> Hand:
    """The other hand hangs, or rests on the hip."""
    if plan.rest == "hang":
        return idle_hand(stream, len(t), style)
    on_hip = plateau(t, plan.up - 0.5, plan.up + 0.2, plan.down + 0.3, plan.down + 1.0)
    touch = Touch(f"{side}_hip", on_hip)
    calm = idle_hand(stream, len(t), style, (touch,))
    return replace(calm, swivel=calm.swivel + 0.6 * on_hip)
