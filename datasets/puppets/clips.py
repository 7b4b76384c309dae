"""The corpus' list of clips and cases, for every size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from .characters import CAST
from .performances import KINDS
from .randomness import Stream
from .score import FPS, Score


@dataclass(frozen=True)
class Size:
    """clips: of each kind, counted from ``first`` so that no two sizes share a name. seconds: shortest and
    longest. per_clip: of each split, how many cases a clip has; 0 for all."""

    clips: int
    first: int
    seconds: tuple[float, float]
    per_clip: Mapping[str, int]


SIZES = {
    "tiny": Size(5, 1, (2.0, 4.0), {"self": 2, "intra": 4, "cross": 4}),
    "default": Size(18, 101, (3.0, 8.0), {"self": 0, "intra": 0, "cross": 0}),
}


@dataclass(frozen=True)
class Clip:
    """One performance: ``name`` also names its random numbers."""

    name: str
    kind: str
    frames: int
    seed: int

    def score(self) -> Score:
        return KINDS[self.kind](Stream("puppets", self.seed, self.name), self.frames)


@cache
def clips(size: str, seed: int) -> tuple[Clip, ...]:
    """The clips of a size, kind by kind."""
    shortest, longest = SIZES[size].seconds
    found = []
    for kind in KINDS:
        for number in range(SIZES[size].clips):
            name = f"{kind}-{SIZES[size].first + number:03d}"
            length = Stream("puppets", seed, name, "length").uniform(shortest, longest)
            found.append(Clip(name, kind, round(length * FPS), seed))
    return tuple(found)


@cache
def pairs(split: str) -> tuple[tuple[str, str], ...]:
    """All (source, target) names of a split, so ordered that any stretch of them is well mixed."""
    cast = [body.name for body in CAST]
    structure = {body.name: body.structure.name for body in CAST}
    turns = len(cast)
    ordered = [(cast[k], cast[(k + step) % turns]) for step in range(turns) for k in range(turns)]
    return tuple((a, b) for a, b in ordered if _split(a, b, structure[a] == structure[b]) == split)


def _split(source: str, target: str, alike: bool) -> str:
    if source == target:
        return "self"
    return "intra" if alike else "cross"


@cache
def cases(size: str, seed: int, split: str) -> tuple[tuple[Clip, str, str], ...]:
    """(clip, source, target) of a split: every clip with its share of the pairs, going round the pairs, so
    that characters and kinds come equally often."""
    every, count = pairs(split), SIZES[size].per_clip[split]
    found, at = [], 0
    for clip in clips(size, seed):
        mine = [every[(at + k) % len(every)] for k in range(count)] if count else every
        at += count
        found += [(clip, source, target) for source, target in mine]
    return tuple(found)
