"""Crawling: on hands and knees, opposite ones together or those of a side, along a bend, with pauses.

Bodies without collar bones (``h36m17``) have arms that reach no farther than their length: on all fours
their shoulders are held a little lower for it (``kneeling.all_fours``), so that every body can crawl.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...conventions import SIDES, other, sign
from ...curves import plateau, wander
from ...randomness import Stream
from ..score import Foot, FootContact, Hand, HandContact, Score
from .style import Performer, Style, rows

_DWELL = 2
"""Frames between two knees' being on their way, where the crawler does not pause."""
_BEFORE = 5
"""Half strides drawn before the clip's first frame and after its last one."""


@dataclass(frozen=True, eq=False)
class _Way:
    """starts, ends: frames between which the knee of each half stride is on its way. long: of a stride, leg
    lengths. heading: on the middle of the way. bend: radians a leg length; weave: radians, of a slow wave.
    lead: whose knee goes in even half strides. early: frames by which hands go before knees; pace: whether
    those of the same side go together. wide: of knees and hands, against usual. aside: how far the hand of
    each half stride is off its place (outward, ahead), leg lengths."""

    starts: tuple[int, ...]
    ends: tuple[int, ...]
    long: float
    heading: float
    bend: float
    weave: float
    lead: str
    early: int
    pace: bool
    wide: tuple[float, float]
    aside: tuple[tuple[float, float], ...]

    @classmethod
    def draw(cls, stream: Stream, frames: int) -> _Way:
        half, pauses = stream.uniform(15.0, 27.0), stream.choice((0.0, 0.12, 0.3))
        start, starts, ends = -_BEFORE * half - round(stream.uniform(0.0, 40.0)), [], []
        while start < frames + _BEFORE * half:
            rest = stream.uniform(14.0, 40.0) if stream.uniform(0.0, 1.0) < pauses else float(_DWELL)
            lasting = half * stream.uniform(0.9, 1.15)
            starts.append(round(start + rest))
            ends.append(round(start + rest + lasting))
            start = ends[-1]
        return cls(
            starts=tuple(starts),
            ends=tuple(ends),
            long=stream.uniform(0.22, 0.46),
            heading=stream.uniform(-np.pi, np.pi),
            bend=stream.uniform(-0.45, 0.45),
            weave=stream.uniform(0.0, 0.12),
            lead=stream.choice(SIDES),
            early=round(stream.uniform(0.05, 0.40) * half),
            pace=stream.choice((False, False, True)),
            wide=(stream.uniform(0.85, 1.30), stream.uniform(0.80, 1.30)),
            aside=tuple((stream.normal(0.008), stream.normal(0.012)) for _ in starts),
        )

    def turns(self, side: str) -> range:
        """The half strides in which a side's knee is on its way."""
        return range(0 if side == self.lead else 1, len(self.starts) - 2, 2)

    def travelled(self, frames: int) -> np.ndarray:
        """``(frames,)`` half strides done: even between starts and ends, rounded off by a Hann window."""
        reach = 7
        k = np.arange(-reach, frames + reach, dtype=float)
        times = np.stack([self.starts, self.ends], axis=-1).ravel()
        steps = np.arange(len(self.starts), dtype=float)
        straight = np.interp(k, times, np.stack([steps, steps + 1.0], axis=-1).ravel())
        weights = np.hanning(2 * reach + 3)[1:-1]
        return np.convolve(straight, weights / weights.sum(), mode="valid")

    @cached_property
    def _line(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Half strides, headings and places ``(n, 2)`` on a fine raster of the way."""
        u = np.linspace(-2.0, len(self.starts) + 2.0, 40 * len(self.starts) + 1)
        far = 0.5 * self.long * (u - 0.5 * len(self.starts))
        heading = self.heading + self.bend * far + self.weave * np.sin(2.2 * far)
        step = 0.5 * self.long * (u[1] - u[0])
        place = np.cumsum(step * np.stack([np.sin(heading), np.cos(heading)], axis=-1), axis=0)
        return u, heading, place

    def at(self, u: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Heading and place ``(..., 2)`` so many half strides along."""
        stations, heading, place = self._line
        spots = [np.interp(u, stations, row) for row in (heading, place[:, 0], place[:, 1])]
        return spots[0], np.stack(spots[1:], axis=-1)


def crawl(stream: Stream, frames: int) -> Score:
    """On hands and knees along a bend, diagonal or in a pace, with pauses, looking ahead or about."""
    person, way = Performer(stream, frames), _Way.draw(stream, frames)
    style, still = person.style, np.zeros(frames)
    travelled = way.travelled(frames)
    heading, path = way.at(travelled)
    tip = np.sin(np.pi * travelled + (0.0 if way.lead == "right" else np.pi))
    size, low = stream.uniform(0.5, 1.3), stream.uniform(0.0, 0.16)
    arch = stream.uniform(-0.24, 0.08) - 0.6 * low
    chest = (-0.08 * size * tip, arch + wander(stream, person.t, 0.02), -0.02 * size * tip)
    gaze = _gaze(stream, frames, 1.32 + low + arch) + rows(frames, 0.04 * tip, 0.0, 0.0)
    gaze[:, 0] += way.at(travelled + 0.8)[0] - heading
    return Score(
        kind="crawl",
        heading=heading,
        path=path,
        sway=np.zeros((frames, 2)),
        height=still + 0.55,
        balance=still,
        support=still + 0.5,
        trunk=person.trunk((0.05 * size * tip, low, 0.015 * size * tip), chest, gaze.T, follow=0.1),
        feet={side: _foot(side, way, frames, style) for side in SIDES},
        hands={side: _hand(person, side, way) for side in SIDES},
        phase=0.5 * travelled % 1.0,
        sit_back=still + stream.uniform(0.0, 0.16),
        prone=still + 1.0,
    )


def _gaze(stream: Stream, frames: int, prone: float) -> np.ndarray:
    """``(frames, 3)`` ahead on the floor or up, now and then to a side, from a chest that lies so far
    forward: the neck is bent back by at most three quarters of a radian on a usual body."""
    k, back = np.arange(frames, dtype=float), stream.uniform(0.35, 0.70)
    gaze = np.tile([stream.uniform(-0.12, 0.12), prone - back, 0.0], (frames, 1))
    start = stream.uniform(-20.0, 60.0)
    while start < frames:
        long, up = stream.uniform(40.0, 80.0), stream.uniform(14.0, 20.0)
        aside, rise = stream.sign() * stream.uniform(0.1, 0.5), stream.uniform(-0.2, 0.75 - back)
        glance = plateau(k, start, start + up, start + long - up, start + long)
        gaze += glance[:, None] * np.array([aside, -rise, 0.0])
        start += long + stream.uniform(10.0, 90.0)
    return gaze


def _foot(side: str, way: _Way, frames: int, style: Style) -> Foot:
    """Both knees stay down or glide just over the floor, the toes with them."""
    contacts, bears, k = [], np.ones(frames), np.arange(frames, dtype=float)
    for turn in way.turns(side):
        off, down = way.starts[turn + 2], way.ends[turn + 2] if turn + 2 < len(way.ends) else 0
        bears -= plateau(k, off, off + 6.0, down - 6.0, down)
        heading, place = way.at(turn + 1.5)
        strike = way.ends[turn]
        contacts.append(
            FootContact(
                place=(float(place[0]), float(place[1])),
                width=way.wide[0] * (0.95 + 0.1 * style.stance),
                heading=float(heading),
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
    return Foot(tuple(contacts), np.zeros(frames), kneel=np.ones(frames), bears=bears)


def _hand(person: Performer, side: str, way: _Way) -> Hand:
    """The hand goes a little before its knee: the opposite one, or in a pace that of its side."""
    stream = person.stream
    contacts, high, turned = [], stream.uniform(0.03, 0.08), stream.uniform(-0.1, 0.4)
    for turn in way.turns(side if way.pace else other(side)):
        heading, place = way.at(turn + 1.6)
        out, ahead = way.aside[turn]
        line = np.array([np.sin(heading), np.cos(heading)])
        place = place + ahead * line + sign(side) * out * np.array([line[1], -line[0]])
        coming = way.ends[turn] - way.starts[turn]
        contacts.append(
            HandContact(
                place=(float(place[0]), float(place[1])),
                heading=float(heading),
                strike=way.ends[turn] - way.early,
                off=way.starts[turn + 2] - way.early,
                coming=coming,
                leaving=0,
                under=1.0,
                width=way.wide[1] * (0.9 + 0.15 * person.style.stance),
                turned=turned,
                lift=high,
            )
        )
    below = np.tile([0.1, -0.6, 0.6], (person.frames, 1))
    arm = person.hand(below, upright=1.0, swivel=stream.uniform(-0.15, 0.25))
    return replace(arm, contacts=tuple(contacts))
