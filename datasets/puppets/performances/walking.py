"""Walking: forward and backward, along arcs, sneaking, marching, limping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..randomness import Stream
from ..score import FPS, SIDES, Score, sign
from .carriage import Carriage, personal
from .gait import Course, Gait, Tread
from .striding import stepping, striding, with_air
from .style import Style
from .swing import carried

MODES = ("steady", "steady", "start", "stop", "there")


def gait(
    stream: Stream,
    frames: int,
    *,
    mode: str,
    rate: tuple[float, float],
    step: tuple[float, float],
    duty: tuple[float, float],
    turns: tuple[float, ...] = (0.0,),
    bearing: float = 0.0,
    lame: str = "",
    limp: float = 0.0,
) -> Gait:
    """A gait drawn from ranges. rate: steps a second. turns: angles a hundred frames, to either side."""
    stride = 2.0 * FPS / stream.uniform(*rate)
    first = stream.uniform(0.0, 1.0)
    later = min(12.0, max(frames - 1.65 * stride, 0.0)) if mode == "there" else 12.0
    turned = stream.choice(turns) * stream.sign() * min(frames, 200) / 100.0
    if mode == "there" and frames < 1.65 * stride:
        mode = "start"
    return Gait(
        mode=mode,
        frames=frames,
        stride=stride,
        first=first * stride if mode in ("steady", "stop") else 0.62 * stride + later * first,
        lead=stream.choice(SIDES),
        step=stream.uniform(*step) * (1.0 - 0.12 * min(abs(turned), 2.0)),
        duty=stream.uniform(*duty),
        turned=turned + stream.normal(0.04),
        heading=stream.uniform(-np.pi, np.pi),
        style=Style.draw(stream),
        bearing=bearing,
        lame=lame,
        limp=limp,
    )


def walk(stream: Stream, frames: int, mode: str = "") -> Score:
    """Walking at 0.45 to 0.8 leg lengths a step, with heel strike and toe-off."""
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.5, 2.15),
        step=(0.54, 0.90),
        duty=(0.60, 0.65),
        turns=(0.0, 0.0, 0.35, 0.8, 1.4),
    )
    course = Course.of(drawn)
    carriage = personal(stream, drawn.style, drawn.step)
    return striding(stream, "walk", drawn, course, stepping(drawn, course, Tread()), carriage)


def arc(stream: Stream, frames: int, mode: str = "steady") -> Score:
    """Walking round a narrow bend, the body leaning into it."""
    drawn = gait(
        stream,
        frames,
        mode=mode,
        rate=(1.6, 2.0),
        step=(0.50, 0.72),
        duty=(0.60, 0.65),
        turns=(1.6, 2.2, 2.8),
    )
    course = Course.of(drawn)
    return striding(
        stream,
        "arc",
        drawn,
        course,
        stepping(drawn, course, Tread()),
        personal(stream, drawn.style, drawn.step),
    )


def walk_backwards(stream: Stream, frames: int, mode: str = "") -> Score:
    """Short careful steps, toe first, looking over a shoulder or straight ahead."""
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.4, 1.9),
        step=(0.36, 0.58),
        duty=(0.62, 0.68),
        turns=(0.0, 0.0, 0.5),
        bearing=np.pi,
    )
    course = Course.of(drawn)
    tread = Tread(
        landing=(0.10, 0.45),
        leaving=(0.12, 0.10),
        flat=0.14,
        peel=(0.10, 0.04),
        lift=(0.035, 0.015),
        width=0.95,
        under=0.30,
    )
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=stream.uniform(0.010, 0.024),
        bob=0.010,
        lean=0.6 * usual.lean,
        tilt=0.04 + 0.15 * usual.lean,
        swing=0.5 * usual.swing,
        aside=usual.aside + 0.06,
    )
    return striding(stream, "walk_backwards", drawn, course, stepping(drawn, course, tread), carriage)


def sneak(stream: Stream, frames: int, mode: str = "steady") -> Score:
    """Slow, low and soft: the toe feels for the floor, the arms are held ready."""
    drawn = gait(
        stream,
        frames,
        mode=mode,
        rate=(0.95, 1.35),
        step=(0.42, 0.62),
        duty=(0.60, 0.66),
        turns=(0.0, 0.0, 0.4, 0.9),
    )
    course = Course.of(drawn)
    tread = Tread(
        landing=(0.22, 0.20),
        leaving=(0.35, 0.30),
        flat=0.12,
        peel=(0.16, 0.0),
        lift=(0.05, 0.02),
        width=0.9,
    )
    feet = stepping(drawn, course, tread)
    high = stream.uniform(0.0, 1.0)
    shares, knee = (0.0, 0.45, 0.7, 1.0), (60.0, 85.0 + 15.0 * high, 60.0, 40.0)
    air = {
        side: carried(
            foot.plants,
            frames,
            shares,
            (5.0, 48.0 + 12.0 * high, 50.0, 38.0),
            knee,
            most=0.7,
            point=0.05,
            full=(0.45, 0.55),
        )
        for side, foot in feet.items()
    }
    low = stream.uniform(0.09, 0.17)
    carriage = Carriage(
        low=low,
        bob=0.012,
        lean=0.15 + 1.2 * low,
        tilt=0.15,
        gaze=0.02,
        turn=0.12,
        drop=0.03,
        swing=0.22,
        ahead=stream.uniform(0.0, 0.3),
        aside=stream.uniform(0.05, 0.25),
        bend=stream.uniform(0.7, 1.25),
    )
    score = striding(stream, "sneak", drawn, course, with_air(feet, air), carriage, low=low)
    return _groping(stream, score)


def _groping(stream: Stream, score: Score) -> Score:
    """One hand is held before and above the other."""
    size, hands = stream.sign() * stream.uniform(0.04, 0.14), {}
    for side, hand in score.hands.items():
        off = sign(side) * size
        reach = hand.reach * (1.0 - 0.4 * abs(size)) + np.array([-0.3 * off, off, 0.8 * off])
        hands[side] = replace(hand, reach=reach)
    return replace(score, hands=hands)


def march(stream: Stream, frames: int) -> Score:
    """On parade: knees high, flat feet, stretched arms, everything on the beat."""
    drawn = gait(
        stream,
        frames,
        mode="steady",
        rate=(1.6, 1.9),
        step=(0.40, 0.62),
        duty=(0.56, 0.60),
        turns=(0.0, 0.0, 0.0, 0.6),
    )
    course = Course.of(drawn)
    tread = Tread(
        landing=(0.12, 0.08),
        leaving=(0.40, 0.35),
        flat=0.08,
        peel=(0.12, 0.04),
        lift=(0.06, 0.02),
        width=0.85,
    )
    feet = stepping(drawn, course, tread)
    thigh = stream.uniform(46.0, 70.0)
    air = {
        side: carried(
            foot.plants,
            frames,
            (0.0, 0.25, 0.5, 0.75, 1.0),
            (-5.0, 0.6 * thigh, thigh, 0.7 * thigh, 20.0),
            (40.0, 75.0, thigh + 10.0, 0.7 * thigh + 8.0, 20.0),
            full=(0.48, 0.52),
            point=0.0,
        )
        for side, foot in feet.items()
    }
    carriage = Carriage(
        low=0.020,
        bob=0.012,
        lean=-0.06,
        tilt=0.0,
        gaze=-0.02,
        sway=0.022,
        turn=0.05,
        drop=0.03,
        swing=stream.uniform(0.65, 1.0),
        ahead=0.0,
        bend=stream.choice((-0.1, 0.2, 0.7)),
        hinge=0.1,
    )
    score = striding(stream, "march", drawn, course, with_air(feet, air), carriage, thigh=thigh)
    strikes = sorted(plant.strike for foot in feet.values() for plant in foot.plants)
    return replace(score, impacts=tuple(strike for strike in strikes if 0 <= strike < frames))


def limp(stream: Stream, frames: int, mode: str = "steady") -> Score:
    """One leg is spared: it bears weight for a short time only, hardly rolls, and the body dips over it."""
    lame, size = stream.choice(SIDES), stream.uniform(0.035, 0.085)
    drawn = gait(
        stream,
        frames,
        mode=mode,
        rate=(1.2, 1.6),
        step=(0.34, 0.52),
        duty=(0.64, 0.68),
        turns=(0.0, 0.0, 0.5),
        lame=lame,
        limp=size,
    )
    course = Course.of(drawn)
    stiff = Tread(landing=(0.05, 0.0), leaving=(0.20, 0.15), flat=0.08, peel=(0.12, 0.0), under=0.22)
    treads = {side: stiff if side == lame else Tread(under=0.31) for side in SIDES}
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=0.035,
        bob=0.012,
        sway=0.034,
        lean=0.08 + 0.7 * usual.lean,
        gaze=0.10 + usual.gaze,
        swing=0.6 * usual.swing,
        turn=0.07,
    )
    score = striding(
        stream, "limp", drawn, course, stepping(drawn, course, treads), carriage, lame=lame, limp=size
    )
    return _dipping(score, drawn)


def _dipping(score: Score, drawn: Gait) -> Score:
    """The trunk is thrown over the lame foot while that one is down, and the hip sinks."""
    shift = 0.0 if drawn.lame == "left" else np.pi
    over = np.exp(2.5 * (np.cos(drawn.phase - shift - 0.45 * np.pi) - 1.0))
    size = drawn.limp / 0.06
    chest, to = score.trunk.chest.copy(), 1.0 if drawn.lame == "left" else -1.0
    chest[:, 2] += 0.13 * to * size * over
    chest[:, 1] += 0.08 * size * over
    return replace(
        score, height=score.height - 0.030 * size * over, trunk=replace(score.trunk, chest=chest)
    )
