"""Crawling: on hands and knees, the opposite hand and knee together."""

from __future__ import annotations

import numpy as np

from ..curves import plateau
from ..randomness import Stream
from ..score import SIDES, Foot, Hand, HandPlant, Plant, Score
from .arms import other
from .style import Style, hand, seconds, trunk

_DWELL = 2
"""Frames between two knees' being on their way."""


def crawl(stream: Stream, frames: int) -> Score:
    """Straight ahead at 0.3 to 0.5 leg lengths a stride, looking where it goes."""
    style, heading = Style.draw(stream), stream.uniform(-np.pi, np.pi)
    half, long = round(stream.uniform(18.0, 25.0)), stream.uniform(0.28, 0.42)
    lead, offset = stream.choice(SIDES), round(stream.uniform(0.0, 40.0))
    t, k = seconds(frames), np.arange(frames, dtype=float)
    still = np.zeros(frames)
    cycle = np.pi * (k + offset) / half
    tip = np.sin(cycle + (0.0 if lead == "right" else np.pi))
    zero = np.zeros_like(tip)
    hips = np.stack([0.05 * tip, zero, 0.015 * tip], axis=-1)
    chest = np.stack([-0.08 * tip, zero - 0.12, -0.02 * tip], axis=-1)
    ahead, down = stream.uniform(0.45, 0.75), stream.uniform(-0.15, 0.15)
    gaze = np.stack([0.04 * tip + down, ahead + zero, zero], axis=-1)
    at = long * (k + offset) / (2.0 * half)
    line = np.stack([np.sin(heading) + zero, np.cos(heading) + zero], axis=-1)
    return Score(
        kind="crawl",
        heading=still + heading,
        path=at[:, None] * line,
        sway=np.zeros((frames, 2)),
        height=still + 0.55,
        balance=still,
        support=still + 0.5,
        trunk=trunk(stream, t, style, pelvis=hips, chest=chest, gaze=gaze, follow=0.1),
        feet={side: _foot(side, lead, half, long, offset, heading, frames, style) for side in SIDES},
        hands={
            side: _hand(stream, side, lead, half, long, offset, heading, frames, style) for side in SIDES
        },
        parameters={"stride": long, "frames": 2 * half},
        phase=(k + offset) / (2.0 * half) % 1.0,
        sit_back=still + stream.uniform(0.02, 0.12),
        prone=still + 1.0,
    )


def _turns(side: str, lead: str, half: int, offset: int, frames: int) -> range:
    """Numbers of the half strides in which a side's knee is on its way, also before and after the clip."""
    first = 0 if side == lead else 1
    return range(first - 4, (frames + offset) // half + 6, 2)


def _foot(
    side: str, lead: str, half: int, long: float, offset: int, heading: float, frames: int, style: Style
) -> Foot:
    """Both knees stay down or glide just over the floor, the toes with them."""
    plants, bears, k = [], np.ones(frames), np.arange(frames, dtype=float)
    for turn in _turns(side, lead, half, offset, frames):
        strike, off = (turn + 1) * half - _DWELL - offset, (turn + 2) * half - offset
        bears -= plateau(k, off, off + 6.0, off + half - _DWELL - 6.0, off + half - _DWELL)
        at = 0.5 * long * (turn + 1.5)
        plants.append(
            Plant(
                place=(at * float(np.sin(heading)), at * float(np.cos(heading))),
                width=0.95 + 0.1 * style.stance,
                heading=heading,
                toe_out=0.03,
                strike=strike,
                flat=strike,
                lift=off,
                off=off,
                strike_pitch=0.0,
                off_pitch=0.0,
                lift_height=0.022,
                hurry=0.25,
            )
        )
    return Foot(tuple(plants), np.zeros(frames), kneel=np.ones(frames), bears=bears)


def _hand(
    stream: Stream,
    side: str,
    lead: str,
    half: int,
    long: float,
    offset: int,
    heading: float,
    frames: int,
    style: Style,
) -> Hand:
    """The hand goes a little before the opposite knee."""
    early = round(0.15 * half)
    plants = []
    for turn in _turns(other(side), lead, half, offset, frames):
        strike = (turn + 1) * half - _DWELL - offset - early
        at = 0.5 * long * (turn + 1.6)
        plants.append(
            HandPlant(
                place=(at * float(np.sin(heading)), at * float(np.cos(heading))),
                heading=heading,
                strike=strike,
                off=(turn + 2) * half - offset - early,
                coming=half - _DWELL,
                going=0,
                under=1.0,
                width=0.9 + 0.15 * style.stance,
                turned=0.1,
                lift=0.05,
            )
        )
    t = seconds(frames)
    below = np.tile([0.1, -0.6, 0.6], (frames, 1))
    arm = hand(stream, t, below, style, upright=1.0, swivel=-0.1)
    return Hand(arm.reach, arm.upright, arm.middle, arm.swivel, arm.wrist, plants=tuple(plants))
