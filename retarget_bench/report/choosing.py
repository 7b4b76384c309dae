"""Choice of the cases that a report plays: worst, typical and best, of many kinds and pairs."""

import difflib
import warnings
from collections import Counter
from collections.abc import Sequence

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.report.chapters import Chapter, Split

WANTED = (1.0, 0.5, 0.0)
"""Worst, median and best, as shares of the cases in order of how well they go."""
NEAR = 1 / 6
"""What stands within so large a share of the wanted place is as good as the one there."""

Chosen = tuple[int, int, int]
"""Numbers of chapter, split and case."""


def chosen(chapters: Sequence[Chapter], most: int, asked: Sequence[str] = ()) -> list[Chosen]:
    """The cases to show, in the order in which they are to be packed: those asked for by id, then of every
    split in turn, cross first, its worst, median, best, next worst, ... case, at most so many in all.

    How well a case goes is the mean of its places among the cases, over the ranked methods that answered
    it. Of the cases near the wanted place the one is taken whose kind, pair and bodies were shown least,
    then the nearest. Raises BenchError for an id that no result has.
    """
    splits = [
        (c, s, split)
        for c, chapter in enumerate(chapters)
        for s, split in reversed([*enumerate(chapter.splits)])
    ]
    known = {info.id for _, _, split in splits for info in split.matrix.cases}
    if unknown := [case for case in asked if case not in known]:
        near = difflib.get_close_matches(unknown[0], known, 3, 0.5) or sorted(known)[:3]
        raise BenchError(f"no case {unknown[0]!r} in these results; near it: {', '.join(near)}")
    found = [
        (c, s, case)
        for c, s, split in splits
        for case, info in enumerate(split.matrix.cases)
        if info.id in asked
    ]
    queues = [[(c, s, case) for case in order(split, most)] for c, s, split in splits]
    for turn in range(max(map(len, queues), default=0)):
        for queue in queues:
            if len(found) >= most:
                return found
            if turn < len(queue) and queue[turn] not in found:
                found.append(queue[turn])
    return found


def order(split: Split, most: int | None = None) -> list[int]:
    """The cases of a split that any method answered, in the order in which they are chosen, so many of
    them; of all where none was answered: their sources can be seen, and why there is no answer."""
    badness = _badness(split)
    if np.isnan(badness).all():
        badness = np.zeros(len(badness))
    by_badness = [int(case) for case in np.argsort(badness, kind="stable") if not np.isnan(badness[case])]
    last = max(1, len(by_badness) - 1)
    left = {case: place / last for place, case in enumerate(by_badness)}
    shown: Counter[str] = Counter()
    found: list[int] = []
    while left and len(found) != most:
        wanted = WANTED[len(found) % len(WANTED)]
        case = min(left, key=lambda each: _cost(split, each, abs(left[each] - wanted), shown))
        shown.update(_traits(split, case))
        found.append(case)
        del left[case]
    return found


def _cost(split: Split, case: int, away: float, shown: Counter[str]) -> tuple[bool, int, float]:
    return away > NEAR, sum(shown[trait] for trait in _traits(split, case)), away


def _traits(split: Split, case: int) -> list[str]:
    info = split.matrix.cases[case]
    level = split.groups.get("level")
    told = [f"kind {info.kind}", f"pair {info.pair}", f"source {info.source}", f"target {info.target}"]
    return told if level is None else [*told, f"level {level[case]}"]


def _badness(split: Split) -> np.ndarray:
    """``(cases,)``: the mean place over ranked methods (all where none is ranked); nan: nobody answered."""
    losses = split.losses[split.ranked] if split.ranked.any() else split.losses
    places = np.full(losses.shape, np.nan)
    for row, loss in enumerate(losses):
        there = np.flatnonzero(~np.isnan(loss))
        places[row, there[np.argsort(loss[there], kind="stable")]] = np.arange(len(there)) / max(
            1, len(there)
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of cases that nobody answered
        return np.nanmean(places, axis=0)
