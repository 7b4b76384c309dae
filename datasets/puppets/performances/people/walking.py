"""Walking: forward, backward, sideways, along arcs, sneaking, marching, limping, turning on the spot."""

from dataclasses import replace

import numpy as np

from ...conventions import FPS, SIDES, sign
from ...curves import wander
from ...randomness import Stream
from ..score import Score
from .striding import Course, Gait, Tread, carried, stepping, striding, with_air
from .style import Carriage, Style, personal, seconds

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
    """Marching on parade: knees high, flat feet, stretched arms, everything on the beat."""
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


_SIDEWAYS = Tread(
    landing=(0.16, 0.10),
    leaving=(0.26, 0.20),
    flat=0.09,
    peel=(0.12, 0.0),
    lift=(0.04, 0.02),
    width=1.75,
    under=0.30,
)
_ON_THE_SPOT = Tread(
    landing=(0.20, 0.0),
    leaving=(0.42, 0.0),
    flat=0.10,
    peel=(0.14, 0.0),
    lift=(0.045, 0.02),
    width=1.0,
    under=0.30,
)


def walk_sideways(stream: Stream, frames: int, mode: str = "") -> Score:
    """One foot steps aside, the other follows up to it; eyes forward or where it goes."""
    to = stream.sign()
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.5, 2.1),
        step=(0.14, 0.24),
        duty=(0.60, 0.66),
        turns=(0.0, 0.0, 0.3),
        bearing=0.5 * np.pi * to,
    )
    # the foot in front of the way goes first
    drawn = replace(drawn, lead="left" if to > 0 else "right")
    course = Course.of(drawn)
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=stream.uniform(0.03, 0.09),
        bob=0.012,
        sway=0.0,
        lean=0.04 + 0.7 * usual.lean,
        drop=0.05,
        swing=0.0,
        aside=stream.uniform(0.05, 0.30),
    )
    score = striding(stream, "walk_sideways", drawn, course, stepping(drawn, course, _SIDEWAYS), carriage)
    return _looking(stream, score, 0.55 * to * stream.choice((0.0, 1.0)))


def turn(stream: Stream, frames: int, mode: str = "") -> Score:
    """Round on the spot in small steps, the eyes first."""
    drawn = gait(
        stream,
        frames,
        mode=mode or stream.choice(MODES),
        rate=(1.4, 1.9),
        step=(0.0, 0.0),
        duty=(0.62, 0.68),
        turns=(1.8, 2.6, 3.4),
    )
    drawn = replace(drawn, lead="left" if drawn.turned > 0.0 else "right")
    course = _turning(Course.of(drawn), drawn.turned, frames)
    usual = personal(stream, drawn.style, drawn.step)
    carriage = replace(
        usual,
        low=0.018,
        bob=0.008,
        sway=0.038,
        drop=0.0,
        turn=0.0,
        tilt=0.02,
        lean=0.5 * usual.lean,
        swing=0.3 * usual.swing,
    )
    score = striding(stream, "turn", drawn, course, stepping(drawn, course, _ON_THE_SPOT), carriage)
    return _stepping_arms(stream, score)


def _turning(course: Course, turned: float, frames: int) -> Course:
    """The same course, turning only while the feet step."""
    rate = course.activity * turned / frames
    heading = np.cumsum(rate)
    return replace(course, heading=heading - heading[len(heading) // 2] + course.heading[len(heading) // 2])


def _looking(stream: Stream, score: Score, aside: float) -> Score:
    gaze = score.trunk.gaze.copy()
    gaze[:, 0] += aside + wander(stream, seconds(score.frames), 0.08)
    return replace(score, trunk=replace(score.trunk, gaze=gaze))


def _stepping_arms(stream: Stream, score: Score) -> Score:
    """Arms that are flung outward a little by the turning."""
    size = stream.uniform(0.03, 0.10)
    hands = {
        side: replace(hand, reach=hand.reach + np.array([size, 0.02 * size, 0.0]))
        for side, hand in score.hands.items()
    }
    return replace(score, hands=hands)
