"""Jogging and running: steps with a flight between them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...conventions import FPS, GRAVITY, SIDES
from ...curves import bump, hermite
from ...randomness import Stream
from ..score import FootContact, Score
from .striding import Gait, Swing, flowing, striding, with_air
from .style import Carriage, Style

Range = tuple[float, float]
Contact = tuple[int, int]
"""Frames of a foot's first touch and of its last, during which the body is borne."""


@dataclass(frozen=True)
class _Run:
    """Settings of a run or a jog. rate: steps a second. speed: leg lengths a second. down: seconds a foot
    is down. knee: most bent in the swing, thigh: most raised, degrees. lean: of the chest. tall: height of
    the hips at take-off, leg lengths. elbow: bend on top of the style's. swing: of the arms.

    Of the swinging leg, fitted for little jerk of the ankle in the air: shares, full: of ``Swing``.
    thighs: degrees as it leaves, soon after and as it lands; raised: between them shares of its most.
    knees: degrees as it leaves, towards landing and in it; bent: between them shares of its most."""

    rate: Range
    speed: Range
    down: Range
    knee: Range
    thigh: Range
    lean: Range
    tall: Range
    elbow: Range
    swing: Range
    shares: tuple[float, ...]
    thighs: tuple[float, float, float]
    raised: tuple[float, float, float]
    knees: tuple[float, float, float]
    bent: tuple[float, float, float]
    full: Range


_PLANS = {
    "jog": _Run(
        rate=(2.5, 2.85),
        speed=(2.0, 2.9),
        down=(0.22, 0.27),
        knee=(68.0, 95.0),
        thigh=(24.0, 38.0),
        lean=(0.00, 0.27),
        tall=(0.955, 0.980),
        elbow=(0.2, 1.25),
        swing=(0.36, 0.60),
        shares=(0.0, 0.20, 0.39, 0.67, 0.86, 1.0),
        thighs=(-16.0, 0.0, 15.0),
        raised=(0.77, 1.41, 0.96),
        knees=(29.0, 28.0, 19.0),
        bent=(0.55, 0.89, 0.79),
        full=(0.24, 0.69),
    ),
    "run": _Run(
        rate=(2.8, 3.25),
        speed=(3.1, 4.3),
        down=(0.17, 0.21),
        knee=(94.0, 124.0),
        thigh=(36.0, 52.0),
        lean=(0.14, 0.50),
        tall=(0.915, 0.960),
        elbow=(0.1, 1.15),
        swing=(0.52, 0.82),
        shares=(0.0, 0.18, 0.38, 0.66, 0.83, 1.0),
        thighs=(-19.0, 4.0, 38.0),
        raised=(0.71, 1.28, 1.02),
        knees=(34.0, 39.0, 35.0),
        bent=(0.58, 0.91, 0.77),
        full=(0.26, 0.77),
    ),
}


def run(stream: Stream, frames: int, kind: str = "run") -> Score:
    """Running, fast on mid- or forefoot with heels high behind; or a ``jog`` with short flights."""
    plan = _PLANS[kind]
    stride = 2.0 * FPS / stream.uniform(*plan.rate)
    turned = stream.choice((0.0, 0.0, 0.5, 1.0)) * stream.sign() * frames / 100.0
    speed = stream.uniform(*plan.speed)
    gait = Gait(
        mode="steady",
        frames=frames,
        stride=stride,
        first=stream.uniform(0.0, 1.0) * stride,
        lead=stream.choice(SIDES),
        step=0.5 * stride * speed / FPS,
        duty=stream.uniform(*plan.down) * FPS / stride,
        turned=turned + stream.normal(0.04),
        heading=stream.uniform(-np.pi, np.pi),
        style=replace(Style.draw(stream), asymmetry=stream.normal(0.04)),
    )
    landing = stream.uniform(-0.22, 0.16)
    feet = gait.feet(lambda k: _contact(gait, round(gait.strike(k)), landing))
    knee, thigh = stream.uniform(*plan.knee), stream.uniform(*plan.thigh)
    (back, soon, lands), (leaves, late, ends) = plan.thighs, plan.knees
    swing = Swing(
        plan.shares,
        (back, soon, *(share * thigh for share in plan.raised), lands),
        (leaves, *(share * knee for share in plan.bent), late, ends),
        full=plan.full,
        point=0.05,
        out=-0.025,
        curve=flowing,
    )
    lean = stream.uniform(*plan.lean) + stream.normal(0.07)
    carriage = Carriage(
        bob=0.0,
        sway=0.012,
        turn=stream.uniform(0.04, 0.12),
        drop=stream.uniform(0.02, 0.05),
        tilt=0.07 + 0.3 * lean,
        lean=lean,
        gaze=0.02 + 0.15 * lean,
        back=0.05,
        counter=1.6,
        swing=stream.uniform(*plan.swing),
        ahead=stream.uniform(-0.50, -0.30),
        aside=stream.uniform(-0.06, 0.14),
        bend=stream.uniform(*plan.elbow),
        hinge=stream.uniform(0.35, 0.75),
        out=stream.uniform(-0.2, 0.5),
        behind=0.4,
        still=stream.choice(((0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.6, 0.0), (0.0, 0.6))),
    )
    score = striding(stream, kind, gait, with_air(feet, swing), carriage)
    contacts = sorted((each.strike, each.off) for foot in feet.values() for each in foot.contacts)
    # from the last frame borne to the first one borne again, as far as the clip shows them
    gaps = [(before[1], after[0]) for before, after in pairwise(contacts) if after[0] > before[1]]
    tall, soft = stream.uniform(*plan.tall), 0.018 * gait.style.bounce
    return replace(
        score,
        height=_bouncing(contacts, frames, tall, soft),
        flights=tuple((off, strike) for off, strike in gaps if strike > 0 and off < frames - 1),
        impacts=tuple(frame for contact in contacts for frame in contact if 0 <= frame < frames),
    )


def _contact(gait: Gait, strike: int, landing: float) -> FootContact:
    """Feet come down a little before the body, nearly flat, and leave far behind it."""
    down = max(round(gait.duty * gait.stride), 4)
    heading, place, _ = gait.course.at(strike + 0.39 * down)
    return FootContact(
        place=place,
        width=0.35 * gait.style.stance,
        heading=heading,
        toe_out=0.5 * gait.style.toe_out,
        strike=strike,
        flat=strike + 2,
        lift=strike + min(2 + round(0.25 * (down - 2)), down - 2),
        off=strike + down,
        strike_pitch=landing,
        off_pitch=0.64,
        lift_height=0.20,
        hurry=1.0,
    )


def _bouncing(contacts: Sequence[Contact], frames: int, tall: float, soft: float) -> np.ndarray:
    """Height of the hips ``(frames,)``, leg lengths: parabolas in the flights, and between them the legs
    give way so that no speed jumps. tall: at every landing and take-off. soft: how much more they give."""
    t, height = np.arange(frames, dtype=float), np.full(frames, tall)
    gaps = [after[0] - before[1] for before, after in pairwise(contacts)]
    speeds = [0.5 * GRAVITY * gap for gap in gaps]
    fall, rise = [0.0, *speeds], [*speeds, 0.0]
    for k, (strike, off) in enumerate(contacts):
        borne = (t >= strike) & (t <= off)
        height[borne] = hermite(t[borne], (strike, off), (tall, tall), (-fall[k], rise[k]))
        height[borne] -= soft * bump((t[borne] - strike) / (off - strike))
        if k < len(gaps):
            aloft = (t > off) & (t < off + gaps[k])
            since = t[aloft] - off
            height[aloft] = tall + 0.5 * GRAVITY * since * (gaps[k] - since)
    return height
