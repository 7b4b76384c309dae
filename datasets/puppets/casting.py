"""Which bodies perform which clip, and who is retargeted to whom: fixed lists, evenly mixed.

Every choice takes what was taken least so far, counted in whole numbers: the lists are the same everywhere,
every body comes as often as the others of its family, in either role, and so does every kind. Among those
taken equally often pairs of unlike build come first, since for bodies that are built alike copying is an
answer; a hash settles what is left.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import product

from .build import unlikeness
from .clips import SIZES, Clip, clips
from .exclusions import unable
from .families import Family, families
from .held_out import ASIDE
from .parts import Part, bodies

Chosen = tuple[Clip, str, str]
"""Clip, source and target."""


@cache
def cases(size: str, part: Part, seed: int, split: str) -> tuple[Chosen, ...]:
    """The cases of a split, clip by clip."""
    listed = clips(size, seed, part)
    offers = _offers(size, part, seed, split)
    numbers = _numbers(list(offers), _most(size, part, seed)[split], offers)
    deal = _Deal(split)
    dealt: dict[Clip, list[tuple[str, str]]] = {clip: [] for clip in listed}
    for turn in range(max(numbers.values(), default=0)):
        for clip, number in numbers.items():
            if turn < number:
                dealt[clip].append(deal.best(clip, [p for p in offers[clip] if p not in dealt[clip]]))
    return tuple((clip, *pair) for clip in listed for pair in dealt[clip])


_AGAIN = 30
"""How much less unlike, in hundredths, a pair counts for each time that it was dealt."""


class _Deal:
    """Pairs given out so far."""

    def __init__(self, split: str) -> None:
        self.split = split
        self.sources: Counter[str] = Counter()
        self.targets: Counter[str] = Counter()
        self.pairs: Counter[tuple[str, str]] = Counter()

    def best(self, clip: Clip, offered: Sequence[tuple[str, str]]) -> tuple[str, str]:
        unlike = unlikeness(clip.family)

        def rank(pair: tuple[str, str]) -> tuple[int, int, int]:
            return (
                self.sources[pair[0]] + self.targets[pair[1]],
                _AGAIN * self.pairs[pair] - unlike[pair],
                _hash(self.split, clip.name, *pair),
            )

        chosen = min(offered, key=rank)
        self.sources[chosen[0]] += 1
        self.targets[chosen[1]] += 1
        self.pairs[chosen] += 1
        return chosen


@cache
def _offers(size: str, part: Part, seed: int, split: str) -> Mapping[Clip, tuple[tuple[str, str], ...]]:
    """Clip -> its possible pairs, of clips that have some."""
    troupes = _troupes(size, part, seed)
    found = {clip: _pairs(clip.family, names, split) for clip, names in troupes.items()}
    if part == "validation":
        found = {
            clip: tuple(p for p in pairs if not set(p).isdisjoint(ASIDE)) for clip, pairs in found.items()
        }
    return {clip: offered for clip, offered in found.items() if offered}


@cache
def _most(size: str, part: Part, seed: int) -> Mapping[str, int]:
    """How many cases each split has: what the size says, or more for every clip to have one, while the sum
    over the splits stays what the size says."""
    asked = SIZES[size].cases if part == "test" else SIZES[size].validation
    least = {split: len(_offers(size, part, seed, split)) for split in asked}
    most = {split: max(number, least[split]) for split, number in asked.items()}
    while sum(most.values()) > sum(asked.values()):
        richest = max(
            most, key=lambda split: (most[split] > least[split], most[split] - least[split], split)
        )
        most[richest] -= 1
    return most


def _numbers(listed: Sequence[Clip], most: int, offers: Mapping[Clip, Sequence[object]]) -> dict[Clip, int]:
    """How many cases each clip has: as many as the others, a third of that where it is long."""
    if most < len(listed):
        return {listed[k * len(listed) // most]: 1 for k in range(most)}
    weights = {clip: 1 if clip.long else 3 for clip in listed}
    total = sum(weights.values())
    numbers = {clip: max(most * weights[clip] // total, 1) for clip in listed}
    for clip in listed:
        numbers[clip] += sum(numbers.values()) < most and not clip.long
    return {clip: min(number, len(offers[clip])) for clip, number in numbers.items()}


@cache
def _troupes(size: str, part: Part, seed: int) -> Mapping[Clip, tuple[str, ...]]:
    """The bodies that perform each clip; those that cannot are left out."""
    used: Counter[str] = Counter()
    found = {}
    for clip in clips(size, seed, part):
        asked = bodies(clip.family, part)
        names = [name for name in asked if name not in unable(clip, asked)]
        sure = ASIDE if part == "validation" else ()
        chosen = _troupe(clip, names, SIZES[size].troupe, used, sure)
        used.update(chosen)
        found[clip] = chosen
    return found


def _troupe(
    clip: Clip, names: Sequence[str], most: int, used: Counter[str], sure: Sequence[str]
) -> tuple[str, ...]:
    """Out of every structure its share, and at least two: those who are sure to be asked, then those who
    performed least so far."""
    if not most or len(names) <= most:
        return tuple(names)
    by_structure: dict[str, list[str]] = {}
    for name in names:
        by_structure.setdefault(_structure(clip.family, name), []).append(name)
    chosen = []
    for mine in by_structure.values():
        share = max(most * len(mine) // len(names), 2)
        chosen += sorted(mine, key=lambda name: (name not in sure, used[name], _hash(clip.name, name)))[
            :share
        ]
    return tuple(name for name in names if name in chosen)


@cache
def _pairs(family: Family, troupe: tuple[str, ...], split: str) -> tuple[tuple[str, str], ...]:
    return tuple((a, b) for a, b in product(troupe, troupe) if split_of(family, a, b) == split)


def split_of(family: Family, source: str, target: str) -> str:
    if source == target:
        return "self"
    return "intra" if _structure(family, source) == _structure(family, target) else "cross"


def _structure(family: Family, name: str) -> str:
    return family.bodies[name].structure.name


@cache
def _hash(*names: str) -> int:
    return int.from_bytes(hashlib.sha256("/".join(names).encode()).digest()[:6], "big")


def performers(size: str, part: Part, seed: int) -> Mapping[Clip, tuple[tuple[str, ...], tuple[str, ...]]]:
    """Clip -> the bodies that perform it in any case, and those of them that are targets."""
    all_of: dict[Clip, dict[str, bool]] = {}
    for split in SIZES[size].cases:
        for clip, source, target in cases(size, part, seed, split):
            mine = all_of.setdefault(clip, {})
            mine.setdefault(source, False)
            mine[target] = True
    return {
        clip: (tuple(mine), tuple(name for name, asked in mine.items() if asked))
        for clip, mine in all_of.items()
    }


def everybody() -> dict[str, Family]:
    """Body -> its family."""
    return {name: family for family in families() for name in family.bodies}
