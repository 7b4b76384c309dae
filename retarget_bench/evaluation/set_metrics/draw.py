"""The choice of windows for the real, the generated and the floor's set.

Results are to be compared with real motion of *other* clips: against the references of the same clips a
distance would measure accuracy, and be 0 for the references themselves. So the clips of a unit are dealt
into two halves, and the real windows of either half stand against the generated windows of the other. Put
the references instead of the results, and the same two comparisons give the floor.

A metric may ask for halves made of stretches of every clip by turns instead (``Stretches``). With few
clips, no two of one kind, halves of whole clips differ by what is done in them more than by any fault. The
real windows of a stretch then stand against generated ones of other stretches, never of the same frames.

Where cases have no references, the real windows are of other motion of the target's structure and stand
against generated ones of all clips (``draw_apart``). The floor compares the two halves of the real motion.

Distances (``SetMetric.distances``) take the halves for their floor alone: the answers' is measured between
all real and all generated windows, and added. What shows other frames than it should, a late answer or
another clip, would else come nearer to the real windows of the other half than the truth does.

Everything is decided by names and by the real motion, nothing by what a method made of it.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from retarget_bench.api import CaseFeatures, CaseInfo, Sample, Stretches
from retarget_bench.files import digest

MOST = 1200
"""Windows in a set, at most, as PAN draws."""
BINS = 10
"""Stretches of root speed from which equally many windows are drawn, as far as they go."""
SEED = 0

Window = tuple[str, int]
"""A case and the number of one of its windows."""


@dataclass(frozen=True, eq=False)
class Draw:
    """Two halves of a unit, n windows of each: real and generated windows of the same cases and frames.

    hash:  of the real windows.
    apart: the real windows are of other clips; both generated samples are then one, of all answers.
    """

    real: tuple[Sample, Sample]
    generated: tuple[Sample, Sample]
    hash: str
    apart: bool = False

    @cached_property
    def whole(self) -> tuple[Sample, Sample]:
        """All real and all generated windows, both halves together."""
        return _together(*self.real), _together(*self.generated)

    @property
    def n(self) -> int:
        return len(self.real[0].clips)

    @property
    def clips(self) -> list[str]:
        """Of real and generated windows; apart, of those that have fewer."""
        real = sorted({str(clip) for half in self.real for clip in half.clips})
        generated = sorted(set(map(str, self.generated[0].clips))) if self.apart else real
        return min(real, generated, key=len)


def _together(a: Sample, b: Sample) -> Sample:
    return Sample(np.concatenate([a.features, b.features]), np.concatenate([a.clips, b.clips]))


def draw(
    features: Mapping[str, CaseFeatures], infos: Mapping[str, CaseInfo], stretches: Stretches | None = None
) -> Draw:
    """The sets of one unit: features and facts of its cases, by case id."""
    first, second, real = _real(features, infos, MOST, stretches)
    generated = _sample(first, "generated", features, infos), _sample(second, "generated", features, infos)
    return Draw(real, generated, _hash((first, second), real))


def draw_apart(
    features: Mapping[str, CaseFeatures],
    infos: Mapping[str, CaseInfo],
    real: Mapping[str, CaseFeatures],
    real_infos: Mapping[str, CaseInfo],
) -> Draw:
    """The sets of cases without references, and of real motion of bodies of their targets' structure.

    Generated windows are drawn evenly over the root speed of the sources, real ones over their own.
    """
    answers = _rows(features, infos)
    first, second, both = _real(real, real_infos, min(MOST, len(answers)))
    windows = _even(answers, features, _edges(_speeds(answers, features)), len(first))
    generated = _sample(windows, "generated", features, infos)
    # by names alone: what was made of the sources is the method's
    names = digest("\n".join(f"{case} {at}" for case, at in windows), 64)
    total = digest(f"{_hash((first, second), both)}\n{names}", 16)
    return Draw(both, (generated, generated), total, apart=True)


def _real(
    features: Mapping[str, CaseFeatures],
    infos: Mapping[str, CaseInfo],
    most: int,
    stretches: Stretches | None = None,
) -> tuple[list[Window], list[Window], tuple[Sample, Sample]]:
    """Equally many windows of either half, at most so many, evenly over the root speed of both; and their
    real features."""
    rows = _rows(features, infos)
    if stretches is None:
        half_of = halves(rows, infos)
        side = [half_of[infos[case].clip] for case, _ in rows]
    else:
        half_at = by_turns(rows, infos, stretches)
        side = [half_at.get((infos[case].clip, at), -1) for case, at in rows]
    sides = [[row for row, number in zip(rows, side, strict=True) if number == half] for half in (0, 1)]
    n, edges = min(most, *map(len, sides)), _edges(_speeds(rows, features))
    first, second = (_even(side, features, edges, n) for side in sides)
    return (
        first,
        second,
        (_sample(first, "real", features, infos), _sample(second, "real", features, infos)),
    )


def _speeds(rows: Sequence[Window], features: Mapping[str, CaseFeatures]) -> np.ndarray:
    return np.array([features[case].speed[at] for case, at in rows])


def _even(
    rows: Sequence[Window], features: Mapping[str, CaseFeatures], edges: np.ndarray, n: int
) -> list[Window]:
    """n of the windows, evenly over root speed."""
    return [rows[index] for index in flat(np.digitize(_speeds(rows, features), edges), n)]


def _rows(features: Mapping[str, CaseFeatures], infos: Mapping[str, CaseInfo]) -> list[Window]:
    """(case, window), in an order like a shuffle: of all sources of a clip on a target, one a window."""
    best: dict[tuple[str, str, int], tuple[str, str, int]] = {}
    for case, each in features.items():
        info = infos[case]
        for at in range(len(each.speed)):
            window = (info.clip, info.target, at)
            best[window] = min(best.get(window, ("g", "", 0)), (_chance(f"{case}\n{at}"), case, at))
    return [(case, at) for _, case, at in sorted(best.values())]


def halves(rows: Sequence[Window], infos: Mapping[str, CaseInfo]) -> dict[str, int]:
    """Clip -> 0 or 1: about equally many windows on either side, and chance, not content, decides.

    Kinds of performance are not shared out evenly: halves more alike than chance makes them would let the
    unbiased KID of real motion fall below 0.
    """
    windows = Counter(infos[case].clip for case, _ in rows)
    rank = {clip: _chance(clip) for clip in windows}
    ordered = sorted(windows, key=lambda clip: (-windows[clip], rank[clip]))
    sides: dict[str, int] = {}
    for number in range(0, len(ordered), 2):
        pair = sorted(ordered[number : number + 2], key=lambda clip: rank[clip])
        sides |= {clip: (side + number // 2) % 2 for side, clip in enumerate(pair)}
    return sides


def by_turns(
    rows: Sequence[Window], infos: Mapping[str, CaseInfo], stretches: Stretches
) -> dict[tuple[str, int], int]:
    """(clip, window) -> 0 or 1, an even number of stretches by turns, the same for all bodies of a clip.

    Windows across two stretches are left out. Every other clip, by chance, begins with the other half.
    """
    counts: dict[str, int] = {}
    for case, at in rows:
        clip = infos[case].clip
        counts[clip] = max(counts.get(clip, 0), at + 1)
    sides: dict[tuple[str, int], int] = {}
    for number, clip in enumerate(sorted(counts, key=_chance)):
        steps = counts[clip] + stretches.overlap - 1
        many = 2 * max(1, round(steps / (2 * stretches.length)))
        stretch = np.arange(steps) * many // steps
        for at in range(counts[clip]):
            if stretch[at] == stretch[at + stretches.overlap - 1]:
                sides[clip, at] = int(number + stretch[at]) % 2
    return sides


def _chance(name: str) -> str:
    """Hex digits that order names at random, the same on every machine."""
    return digest(f"{SEED}\n{name}", 64)


def flat(bins: np.ndarray, n: int) -> np.ndarray:
    """``(n,)`` increasing indices: of every bin equally many first ones, or all where it has fewer."""
    counts = np.bincount(bins)
    level = 0
    while np.minimum(counts, level).sum() < n:
        level += 1
    taken = np.minimum(counts, level)
    for over in np.flatnonzero(counts >= level)[: taken.sum() - n]:
        taken[over] -= 1
    rank = np.zeros(len(bins), dtype=int)
    for each in np.flatnonzero(counts):
        rank[bins == each] = np.arange(counts[each])
    return np.flatnonzero(rank < taken[bins])


def _edges(speeds: np.ndarray) -> np.ndarray:
    """Inner edges of the bins; the last one holds all that is faster than 95 in 100."""
    return np.linspace(0.0, np.quantile(speeds, 0.95) if len(speeds) else 0.0, BINS)[1:]


def _sample(
    rows: Sequence[Window],
    part: Literal["real", "generated"],
    features: Mapping[str, CaseFeatures],
    infos: Mapping[str, CaseInfo],
) -> Sample:
    vectors = [getattr(features[case], part)[at] for case, at in rows] or np.zeros((0, 1))
    clips = np.array([infos[case].clip for case, _ in rows], dtype=str)
    return Sample(np.array(vectors, dtype=np.float64), clips)


def _hash(chosen: Sequence[Sequence[Window]], real: Sequence[Sample]) -> str:
    total = hashlib.sha256()
    for rows, sample in zip(chosen, real, strict=True):
        total.update("\n".join(f"{case} {at}" for case, at in rows).encode())
        total.update(sample.features.astype(np.float32).tobytes())
    return total.hexdigest()[:16]
