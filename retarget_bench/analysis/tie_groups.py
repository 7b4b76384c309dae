"""Groups of ties: all sets of methods without a significant difference between any two."""

import numpy as np

from retarget_bench.analysis import statistics
from retarget_bench.analysis.summary import Ranking
from retarget_bench.results.result_matrix import ResultMatrix


def separated(matrix: ResultMatrix, ranking: Ranking, value: str) -> np.ndarray:
    """``(methods, methods)`` bool, symmetric, in the order of the ranking: significant differences.

    Every method is compared with those below it as the best is in the table: sign flips over the same
    clips, adjusted by Holm with all pairs of methods as the family. That rejects no more than Holm over all
    pairs at once, and its first row is the table's.
    """
    labels = [row.label for row in matrix.rows]
    numbers = matrix.numbers((value, ""))[[labels.index(label) for label in ranking.order]]
    declared = matrix.values[value]
    worse = statistics.losses(numbers, declared.better, declared.goal)
    there = ~np.isnan(worse).any(axis=0)
    means = statistics.per_clip(worse[:, there], matrix.clips[there])
    count = len(means)
    apart = np.zeros((count, count), dtype=bool)
    for row in range(count - 1):
        differences = statistics.differences(means[row + 1 :], means[row], declared.tolerance)
        p = statistics.holm(statistics.sign_flip(differences), count * (count - 1) // 2)
        apart[row, row + 1 :] = p < statistics.ALPHA
    found: np.ndarray = apart | apart.T
    return found


def tie_groups(apart: np.ndarray) -> list[tuple[int, ...]]:
    """All maximal groups without a significant difference inside; groups of one are left out.

    apart: ``(n, n)`` bool, symmetric. Piepho's (2004) insert and absorb: begin with one group of all, and
    split every group that holds a significantly different pair.
    """
    groups = [frozenset(range(len(apart)))]
    for first, second in np.argwhere(np.triu(apart)).tolist():
        split = [
            part
            for group in groups
            for part in ((group - {first}, group - {second}) if {first, second} <= group else (group,))
        ]
        unique = list(dict.fromkeys(split))
        groups = [group for group in unique if not any(group < other for other in unique)]
    return sorted(tuple(sorted(group)) for group in groups if len(group) > 1)
