"""Walking: forward, backward, sideways, along arcs, sneaking, marching, limping, turning on the spot, and
on stairs, which grow with the performer (``solver/scaling.py``)."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...conventions import FPS, SIDES, seconds, sign
from ...curves import ramp, wander
from ...randomness import Stream
from ..score import FootContact, Score, Stairs
from .striding import Gait, Swing, Tread, stepping, striding, with_air
from .style import Carriage, Style, along, personal

MODES = ("steady", "steady", "start", "stop", "there")

_Range = tuple[float, float]
_RANGES: dict[str, tuple[_Range, _Range, _Range, tuple[float, ...]]] = {
    # steps a second, leg lengths a step, share of a stride that a foot is down, radians turned in a hundred
    # frames to either side
    "walk": ((1.5, 2.15), (0.54, 0.90), (0.60, 0.65), (0.0, 0.0, 0.35, 0.8, 1.4)),
    "arc": ((1.6, 2.0), (0.50, 0.72), (0.60, 0.65), (1.6, 2.2, 2.8)),
    "walk_backwards": ((1.4, 1.9), (0.36, 0.58), (0.62, 0.68), (0.0, 0.0, 0.5)),
    "walk_sideways": ((1.5, 2.1), (0.14, 0.24), (0.60, 0.66), (0.0, 0.0, 0.3)),
    "turn": ((1.4, 1.9), (0.0, 0.0), (0.62, 0.68), (1.8, 2.6, 3.4)),
    "sneak": ((0.95, 1.35), (0.42, 0.62), (0.60, 0.66), (0.0, 0.0, 0.4, 0.9)),
    "march": ((1.6, 1.9), (0.40, 0.62), (0.56, 0.60), (0.0, 0.0, 0.0, 0.6)),
    "limp": ((1.2, 1.6), (0.34, 0.52), (0.64, 0.68), (0.0, 0.0, 0.5)),
    "stairs": ((1.25, 1.65), (0.5, 0.5), (0.60, 0.64), (0.0,)),
}

_TREADS = {
    # landing, leaving, flat, peel, lift, width, under
    "walk_backwards": Tread((0.10, 0.45), (0.12, 0.10), 0.14, (0.10, 0.04), (0.035, 0.015), 0.95, 0.30),
    "walk_sideways": Tread((0.16, 0.10), (0.26, 0.20), 0.09, (0.12, 0.0), (0.04, 0.02), 1.75, 0.30),
    "turn": Tread((0.20, 0.0), (0.42, 0.0), 0.10, (0.14, 0.0), (0.045, 0.02), 1.0, 0.30),
    "sneak": Tread((0.22, 0.20), (0.35, 0.30), 0.12, (0.16, 0.0), (0.05, 0.02), 0.9),
    "march": Tread((0.12, 0.08), (0.40, 0.35), 0.08, (0.12, 0.04), (0.06, 0.02), 0.85),
}
"""Treads other than that of a usual walk."""


def _gait(stream: Stream, frames: int, kind: str, mode: str) -> Gait:
    """A gait drawn from the ranges of a kind. mode: of ``Gait``; nothing: any."""
    rate, step, duty, turns = _RANGES[kind]
    mode = mode or stream.choice(MODES)
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
    )


def walk(stream: Stream, frames: int, mode: str = "", kind: str = "walk") -> Score:
    """Walking with heel strike and toe-off; ``arc``: round a narrow bend, the body leaning into it."""
    drawn = _gait(stream, frames, kind, mode)
    carriage = personal(stream, drawn.style, drawn.step)
    return striding(stream, kind, drawn, stepping(drawn, Tread()), carriage)


def walk_backwards(stream: Stream, frames: int, mode: str = "") -> Score:
    """Short careful steps, toe first, looking over a shoulder or straight ahead."""
    kind = "walk_backwards"
    drawn = replace(_gait(stream, frames, kind, mode), bearing=np.pi)
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
    return striding(stream, kind, drawn, stepping(drawn, _TREADS[kind]), carriage)


def sneak(stream: Stream, frames: int, mode: str = "steady") -> Score:
    """Slow, low and soft: the toe feels for the floor, the arms are held ready."""
    drawn = _gait(stream, frames, "sneak", mode)
    high = stream.uniform(0.0, 1.0)
    swing = Swing(
        (0.0, 0.45, 0.7, 1.0),
        (5.0, 48.0 + 12.0 * high, 50.0, 38.0),
        (60.0, 85.0 + 15.0 * high, 60.0, 40.0),
        full=(0.45, 0.55),
        most=0.7,
        point=0.05,
    )
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
    feet = with_air(stepping(drawn, _TREADS["sneak"]), swing)
    score = striding(stream, "sneak", drawn, feet, carriage)
    # one hand is held before and above the other
    size, hands = stream.sign() * stream.uniform(0.04, 0.14), {}
    for side, hand in score.hands.items():
        off = sign(side) * size
        reach = hand.reach * (1.0 - 0.4 * abs(size)) + np.array([-0.3 * off, off, 0.8 * off])
        hands[side] = replace(hand, reach=reach)
    return replace(score, hands=hands)


def march(stream: Stream, frames: int) -> Score:
    """Marching on parade: knees high, flat feet, stretched arms, everything on the beat."""
    drawn = _gait(stream, frames, "march", "steady")
    thigh = stream.uniform(46.0, 70.0)
    swing = Swing(
        (0.0, 0.25, 0.5, 0.75, 1.0),
        (-5.0, 0.6 * thigh, thigh, 0.7 * thigh, 20.0),
        (40.0, 75.0, thigh + 10.0, 0.7 * thigh + 8.0, 20.0),
        full=(0.48, 0.52),
        point=0.0,
    )
    feet = with_air(stepping(drawn, _TREADS["march"]), swing)
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
    score = striding(stream, "march", drawn, feet, carriage)
    strikes = sorted(contact.strike for foot in feet.values() for contact in foot.contacts)
    return replace(score, impacts=tuple(strike for strike in strikes if 0 <= strike < frames))


def limp(stream: Stream, frames: int, mode: str = "steady") -> Score:
    """One leg is spared: it bears weight for a short time only, hardly rolls, and the body dips over it."""
    lame, size = stream.choice(SIDES), stream.uniform(0.035, 0.085)
    drawn = replace(_gait(stream, frames, "limp", mode), lame=lame, limp=size)
    stiff = Tread(landing=(0.05, 0.0), leaving=(0.20, 0.15), flat=0.08, peel=(0.12, 0.0), under=0.22)
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
    feet = stepping(drawn, Tread(under=0.31), stiff)
    score = striding(stream, "limp", drawn, feet, carriage)
    # the trunk is thrown over the lame foot while that one is down, and the hip sinks
    over = np.exp(2.5 * (np.cos(drawn.phase - (0.0 if lame == "left" else np.pi) - 0.45 * np.pi) - 1.0))
    dip, chest = size / 0.06, score.trunk.chest.copy()
    chest[:, 2] += 0.13 * sign(lame) * dip * over
    chest[:, 1] += 0.08 * dip * over
    return replace(score, height=score.height - 0.030 * dip * over, trunk=replace(score.trunk, chest=chest))


def walk_sideways(stream: Stream, frames: int, mode: str = "") -> Score:
    """One foot steps aside, the other follows up to it; eyes forward or where it goes."""
    to = stream.sign()
    kind, drawn = "walk_sideways", _gait(stream, frames, "walk_sideways", mode)
    # the foot in front of the way goes first
    drawn = replace(drawn, bearing=0.5 * np.pi * to, lead="left" if to > 0 else "right")
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
    score = striding(stream, kind, drawn, stepping(drawn, _TREADS[kind]), carriage)
    gaze = score.trunk.gaze.copy()
    gaze[:, 0] += 0.55 * to * stream.choice((0.0, 1.0)) + wander(stream, seconds(frames), 0.08)
    return replace(score, trunk=replace(score.trunk, gaze=gaze))


def turn(stream: Stream, frames: int, mode: str = "") -> Score:
    """Round on the spot in small steps, the eyes first."""
    drawn = _gait(stream, frames, "turn", mode)
    drawn = replace(drawn, lead="left" if drawn.turned > 0.0 else "right")
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
    score = striding(stream, "turn", drawn, stepping(drawn, _TREADS["turn"]), carriage)
    # arms are flung outward a little by the turning
    size = stream.uniform(0.03, 0.10)
    flung = np.array([size, 0.02 * size, 0.0])
    hands = {side: replace(hand, reach=hand.reach + flung) for side, hand in score.hands.items()}
    return replace(score, hands=hands)


def stairs(stream: Stream, frames: int, kind: str) -> Score:
    """``stairs_up``: the whole sole on the tread, the knee high, the body lifted over it;
    ``stairs_down``: toe first, the other knee giving way until it touches."""
    up = 1 if kind == "stairs_up" else -1
    tread, rise = stream.uniform(0.36, 0.44), up * stream.uniform(0.14, 0.185)
    drawn = _gait(stream, frames, "stairs", "steady")
    # treads lie along the axes of the floor's height field
    drawn = replace(drawn, turned=0.0, step=tread, heading=0.5 * np.pi * stream.choice((-1, 0, 1, 2)))
    steps = list(drawn.steps)
    first = stream.choice((steps[0] - 2, steps[0] - 2, steps[2], steps[3]))
    last = stream.choice((steps[-1] + 2, steps[-1] + 2, steps[-3]))
    top = max(-rise, 0.0) * (last - first)
    levels = {k: top + rise * (min(max(k, first), last) - first) for k in steps}
    risers = {k: 0.5 * tread * up * (levels[k + (up > 0)] != levels[k - (up < 0)]) for k in steps[1:-1]}
    feet = drawn.feet(lambda k: _on_step(drawn, k, levels[k], risers.get(k, 0.0), up))
    usual = personal(stream, drawn.style, tread)
    carriage = replace(
        usual,
        low=0.036 if up > 0 else 0.035,
        bob=0.006,
        sway=0.032,
        lean=(0.08 if up > 0 else 0.0) + 0.6 * usual.lean,
        tilt=0.08,
        gaze=0.22 if up > 0 else 0.38,
        swing=0.6 * usual.swing,
        ahead=usual.ahead + (0.15 if up > 0 else 0.05),
        turn=0.08,
    )
    score = striding(stream, kind, drawn, feet, carriage)
    # the body rises over each step after the foot is on it, or sinks before it gets there
    begin, end = (0.10, 1.05) if up > 0 else (-0.70, 0.30)
    t, half, lifted = np.arange(frames, dtype=float), 0.5 * drawn.stride, np.full(frames, levels[steps[0]])
    for before, k in pairwise(steps):
        at = drawn.strike(k)
        lifted += (levels[k] - levels[before]) * ramp(t, at + begin * half, at + end * half)
    # step ``first`` is the last one on the lower (upper) floor: the riser follows half a tread later
    place, far = _over(drawn, steps[0]), along(drawn.heading, tread * (first - steps[0] + 0.5))
    edge = (place[0] + far[0], place[1] + far[1])
    flight = Stairs(edge, drawn.heading, tread, rise, last - first, top)
    return replace(score, height=score.height + lifted, stairs=flight)


def _over(drawn: Gait, k: int) -> tuple[float, float]:
    """Position of the body's line over the k-th step."""
    return drawn.course.at(drawn.strike(k) + 0.30 * drawn.stride)[1]


def _on_step(drawn: Gait, k: int, level: float, riser: float, up: int) -> FootContact:
    strike = round(drawn.strike(k))
    off = round(drawn.strike(k) + drawn.duty * drawn.stride)
    return FootContact(
        place=_over(drawn, k),
        width=0.8 * drawn.style.stance,
        heading=drawn.heading,
        toe_out=drawn.style.toe_out,
        strike=strike,
        flat=strike + max(round(0.09 * drawn.stride), 2),
        lift=off - max(round(0.22 * drawn.stride), 3),
        off=off,
        strike_pitch=0.18 if up > 0 else 0.30,
        off_pitch=0.70 if up > 0 else 0.42,
        lift_height=0.12 if up > 0 else 0.07,
        level=level,
        riser=riser,
    )
