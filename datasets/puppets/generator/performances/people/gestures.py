"""Gestures while standing: waving, pointing, clapping, saluting, bowing, and hands put on the own body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...conventions import SIDES, other, sign
from ...curves import plateau, ramp
from ...randomness import Stream
from ..score import Hand, Score, Touch
from . import arms
from .arms import Shape
from .scene import Scene, Stance, lift_heel, shifting, slots, small_step, stance, turn
from .style import Performer, Style, hanging, rows


def stand(stream: Stream, frames: int) -> Score:
    """Idle: the weight goes from foot to foot, the gaze about; a hand may rest on the hip for a while."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.6), shift=0.45)
    scene.fidget()
    for start, end in slots(stream, frames, 1.6, 3.2, calm=0.8):
        at, side = stream.uniform(-0.7, 0.7), stream.choice(SIDES)
        rise = min(stream.uniform(20.0, 32.0), 0.4 * (end - start))
        share = scene.held(start, start + rise, end - rise, end)
        scene.bend(share, (0.1 * at, 0.0, 0.0), (0.15 * at, 0.0, 0.0), (0.7 * at, 0.08, 0.0))
        if stream.choice((True, False, False, False)):
            rests = arms.on(stream.choice(("hip", "belly")), side)
            scene.hold(side, rests, start, end, rise, (0.10, 0.0, 0.10))
    return scene.score("stand")


def point(stream: Stream, frames: int) -> Score:
    """Pointing at things around: the gaze goes first, then arm and chest."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.5))
    scene.fidget()
    for start, end in slots(stream, frames, 1.9, 3.2, calm=0.9):
        side = stream.choice(SIDES)
        aside, rise = stream.uniform(-0.35, 1.2), stream.uniform(-0.45, 0.45)
        far = stream.uniform(0.90, 0.965)
        reach = (
            far * float(np.sin(aside) * np.cos(rise)),
            far * float(np.sin(rise)),
            far * float(np.cos(aside) * np.cos(rise)),
        )
        up = min(stream.uniform(20.0, 32.0), 0.38 * (end - start))
        to = Shape(reach, (-0.15, 0.0, 0.1), 0.2, 1.0)
        scene.hold(side, to, start, end, up, (0.05, 0.0, 0.12), (0.08, 0.0, 0.05))
        turned = sign(side) * aside
        looking = scene.held(start - 3.0, start + 0.6 * up, end - up, end)
        leaning = scene.held(start, start + up, end - up, end)
        scene.bend(looking, gaze=(0.75 * turned, -0.5 * rise, 0.0))
        scene.bend(leaning, (0.15 * turned, 0.0, 0.0), (0.25 * turned, 0.04, 0.03 * sign(side)))
        scene.weight(leaning, 0.5 + 0.25 * sign(side))
    return scene.score("point")


def clap(stream: Stream, frames: int) -> Score:
    """Applause: the palms meet in full for two frames at every clap."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.5))
    scene.fidget()
    level, forward = stream.uniform(-0.34, -0.10), stream.uniform(0.50, 0.62)
    wide, beat = stream.uniform(0.14, 0.24), round(stream.uniform(11.0, 18.0))
    # in long clips there is a while before and after the applause
    most = frames - max(frames - 110.0, 0.0) * stream.uniform(0.0, 1.0)
    start = 4.0 + round(stream.uniform(0.0, 1.0) * (frames - most))
    end, up, count = start + most - 9.0, 20.0, max(2, int((most - 44) / beat))
    tilt = stream.uniform(-0.03, 0.03)

    def shape(side: str, out: float, touch: str = "") -> Shape:
        """Palms face each other, finger tips a little up."""
        return Shape(
            (out, level + tilt * sign(side), forward),
            swivel=0.25,
            upright=0.4,
            middle=1.0,
            touch=touch if side == "right" else "",
            palm=(-1.0, 0.0, 0.0),
            fingers=(0.0, 0.35, 0.94),
        )

    met = [start + up + beat * number for number in range(count)]
    for side in SIDES:
        scene.arm(side, start, start + 0.62 * up, shape(side, wide), (0.0, 0.0, 0.06))
        for at in met:
            scene.arm(side, at - 0.42 * beat, at, shape(side, 0.035, "left_palm"))
            scene.arm(side, at + 1.0, at + 0.55 * beat, shape(side, wide))
        scene.arm(side, met[-1] + 0.55 * beat, min(met[-1] + 0.55 * beat + 22.0, end))
    nod = np.zeros(frames)
    for at in met:
        nod += scene.held(at - 0.4 * beat, at, at, at + 0.55 * beat)
    scene.lean(nod, chest=0.02, gaze=0.035)
    return scene.score("clap")


def hands_on_hips(stream: Stream, frames: int) -> Score:
    """Arms akimbo, chest out, looking about."""
    scene = Scene(stream, frames, width=stream.uniform(1.2, 1.7), shift=0.35)
    scene.fidget()
    first, last = 5.0, frames - 6.0
    up = min(24.0, 0.3 * frames)
    for side in SIDES:
        lag = stream.uniform(0.0, 5.0)
        scene.arm(side, first + lag, first + lag + up, arms.on("hip", side), (0.14, 0.05, 0.06))
        scene.arm(side, last - up - lag, last - lag, None, (0.12, 0.0, 0.0))
    share = scene.held(first, first + up, last - up, last)
    scene.lean(share, -0.03, -0.06, -0.02)
    for start, end in slots(stream, frames, 1.4, 2.6):
        at = stream.uniform(-0.6, 0.6)
        half = 0.5 * (start + end)
        share = scene.held(start, half - 3.0, half + 3.0, end)
        scene.bend(share, chest=(0.3 * at, 0.0, 0.0), gaze=(at, 0.05, 0.0))
    return scene.score("hands_on_hips")


def arms_crossed(stream: Stream, frames: int) -> Score:
    """One hand tucked under the other arm, the other laid on the upper arm."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.6), shift=0.42)
    scene.fidget()
    below = stream.choice(SIDES)
    above = other(below)
    first, last = 5.0, frames - 6.0
    up = min(22.0, 0.28 * frames)
    scene.hold(below, arms.on("ribs", below), first, last, up, (0.05, 0.0, 0.14), (0.05, 0.0, 0.12))
    on_top = arms.on("upper_arm", above)
    scene.hold(above, on_top, first + 4.0, last - 4.0, up, (0.05, 0.05, 0.22), (0.05, 0.0, 0.20))
    scene.lean(scene.held(first, first + up, last - up, last), -0.03, -0.02, 0.03)
    return scene.score("arms_crossed")


def touch_head(stream: Stream, frames: int) -> Score:
    """One hand or both to the head, which inclines towards it."""
    scene = Scene(stream, frames, width=stream.uniform(1.0, 1.5))
    scene.fidget()
    for start, end in slots(stream, frames, 1.9, 3.2, calm=0.6):
        hands = stream.choice((("left",), ("right",), SIDES))
        up = min(28.0, 0.42 * (end - start))
        share = scene.held(start, start + up, end - up, end)
        for side in hands:
            scene.touch(side, arms.on("head", side), start, end, up)
        lean = float(sum(sign(side) for side in hands))
        bow = stream.uniform(0.05, 0.25)
        scene.bend(share, chest=(0.0, 0.03, -0.03 * lean), gaze=(0.1 * lean, bow, 0.14 * lean))
    return scene.score("touch_head")


def touch_toe(stream: Stream, frames: int) -> Score:
    """Bending down with nearly straight legs to the own toes, with one hand or both, and up again."""
    scene = Scene(stream, frames, width=stream.uniform(1.2, 2.2), shift=0.1)
    for start, end in slots(stream, frames, 2.2, 3.6):
        hands = stream.choice((("left",), ("right",), SIDES, SIDES))
        down = min(0.40 * (end - start), 40.0)
        share = scene.held(start, start + down, end - down, end)
        for side in hands:
            scene.arm(side, start + 0.15 * down, start + down, arms.on("toe", side), (0.05, 0.0, 0.15))
            scene.arm(side, end - down, end - 0.1 * down, None, (0.05, 0.0, 0.12))
        if len(hands) == 1:
            free = other(hands[0])
            scene.hold(free, Shape((0.40, -0.70, 0.02), upright=0.9), start, end, down)
        lean = float(sum(sign(side) for side in hands))
        knees = stream.uniform(0.05, 0.12)
        # the deeper the knees bend, the less the trunk has to
        scene.low += knees * share
        scene.bend(
            share,
            pelvis=(-0.15 * lean, 1.32 - 0.8 * knees, 0.0),
            chest=(-0.14 * lean, 0.26, 0.05 * lean),
            gaze=(0.0, 1.15, 0.0),
        )
    return scene.score("touch_toe")


def salute(stream: Stream, frames: int) -> Score:
    """Heels drawn up, finger tips to the temple, held, and smartly down."""
    scene = Scene(stream, frames, width=stream.uniform(0.8, 1.1), shift=0.08)
    side = stream.choice(("right", "right", "left"))
    for start, end in slots(stream, frames, 2.0, 3.6, calm=0.8):
        up = min(28.0, 0.4 * (end - start))
        scene.touch(side, arms.on("brow", side), start, end, up)
        straight = scene.held(start - 4.0, start + up, end - up, end)
        scene.lean(straight, -0.02, -0.07, -0.04)
    return scene.score("salute")


def bow(stream: Stream, frames: int) -> Score:
    """Bowing from the hips, arms along the thighs, or one hand on the belly and the other swept aside."""
    scene = Scene(stream, frames, width=stream.uniform(0.8, 1.2), shift=0.1)
    courtly, side = stream.choice((True, False)), stream.choice(SIDES)
    for start, end in slots(stream, frames, 2.2, 3.8, calm=0.7):
        down = 0.38 * (end - start)
        share = scene.held(start, start + down, end - down, end)
        deep = stream.uniform(0.4, 1.0)
        scene.lean(share, 0.62 * deep, 0.38 * deep, 0.95 * deep)
        scene.low += 0.02 * deep * share
        if courtly:
            belly, swept = arms.on("belly", side), Shape((0.75, -0.45, -0.05), (0.0, 0.0, 0.8), 0.1)
            scene.hold(side, belly, start, end, 0.8 * down, (0.12, 0.0, 0.12), (0.10, 0.0, 0.10))
            scene.hold(other(side), swept, start, end, down)
        else:
            for each in SIDES:
                scene.hold(each, Shape((0.06, -0.92, 0.20), (0.1, 0.0, 0.0), 0.0, 0.85), start, end, down)
    return scene.score("bow")


_SHAPES = {
    # reach of the raised hand (out, up, forward); how far it swings outward and up; elbow; palm
    "small": ((0.34, 0.10, 0.48), (0.10, 0.03), -0.1, -0.9),
    "usual": ((0.42, 0.40, 0.34), (0.17, 0.05), -0.3, -1.0),
    "high": ((0.26, 0.84, 0.22), (0.28, 0.08), 0.0, -0.7),
}


def wave(stream: Stream, frames: int) -> Score:
    """A greeting: the hand goes up, swings from the elbow, the rest of the body takes part."""
    length = frames / 30.0
    shape = stream.choice(("small", "usual", "usual", "high"))
    hands = stream.choice((("left",), ("right",), ("right",), SIDES))
    up = stream.uniform(-0.2, 0.3 * length)
    rate = stream.uniform(0.9, 1.9) * (0.75 if shape == "high" or len(hands) == 2 else 1.0)
    shape = "high" if len(hands) == 2 else shape
    size = stream.uniform(0.7, 1.25)
    down = min(up + stream.uniform(2.0, 4.5), length + stream.uniform(-0.5, 0.5))
    at, rests = stream.uniform(-0.6, 0.6), stream.choice(("hang", "hip"))
    person = Performer(stream, frames)
    soft, upright = 0.065 * stream.uniform(0.0, 1.0) ** 2.2 - 0.008, stream.normal(0.075)
    aside = person.style.aside + 0.42 * stream.uniform(0.0, 1.0) ** 1.5
    person.style = replace(person.style, aside=aside, posture=person.style.posture + upright)
    t, feet = person.t, _feet(stream, person.style, stream.uniform(-np.pi, np.pi), frames)
    raised = plateau(t, up, up + 0.85, down, down + 0.9)
    swing = size * raised * np.sin(2.0 * np.pi * rate * (t - up))
    lagged = raised * np.sin(2.0 * np.pi * rate * (t - up) - 0.7) * size
    lift = raised * float(sum(sign(side) for side in hands))
    # the hip drops over the idle leg, the chest evens that out and leans off the raised arm
    over = 0.10 * feet.tip - 0.06 * lift - 0.015 * swing * np.sign(lift)
    # the eyes turn before the feet
    ahead = 0.8 * (feet.heading[-1] - feet.heading) * ramp(t, -0.1, 0.5)
    trunk = person.trunk(
        pelvis=(0.06 * feet.tip + 0.25 * at * raised, 0.02, -0.08 * feet.tip),
        chest=(0.30 * at * raised + 0.05 * lift, -0.04 * raised, over),
        gaze=(0.85 * at * raised + ahead, -0.05 * raised, 0.05 * lift),
        follow=0.1,
    )
    on_hip = plateau(t, up - 0.5, up + 0.2, down + 0.3, down + 1.0) if rests == "hip" else None
    both: dict[str, Hand] = {}
    for side in SIDES:
        if side in hands:
            both[side] = _waving(person, shape, raised, swing, lagged)
        else:
            both[side] = _resting(person, side, on_hip)
    height = 0.990 - soft - 0.012 * np.abs(feet.tip) + 0.004 * np.abs(swing)
    return feet.score("wave", height, trunk, both)


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


def _waving(
    person: Performer, shape: str, raised: np.ndarray, swing: np.ndarray, lagged: np.ndarray
) -> Hand:
    """Up in front of the body, then from side to side about the elbow, the wrist trailing."""
    base, (wide, rise), elbow, palm = _SHAPES[shape]
    still = np.zeros(person.frames)
    down = hanging(person.wander(0.03), still + person.style.aside, still + person.style.elbow)
    # two hands wave in and out together
    up = rows(person.frames, base[0] + wide * swing, base[1] - rise * swing * swing, base[2])
    reach = down + raised[:, None] * (up - down)
    reach[:, 2] += 1.2 * raised * (1.0 - raised)
    wrist = rows(person.frames, -0.25 * raised, -0.30 * lagged, palm * raised)
    return person.hand(reach, upright=0.6, swivel=elbow * raised, wrist=wrist)


def _resting(person: Performer, side: str, on_hip: np.ndarray | None) -> Hand:
    """The other hand hangs, or rests on the hip."""
    if on_hip is None:
        return person.idle_hand()
    calm = person.idle_hand((Touch(f"{side}_hip", on_hip),))
    return replace(calm, swivel=calm.swivel + 0.6 * on_hip)
