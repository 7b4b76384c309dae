"""Groups of methods that cannot be told apart: against all subsets, and against the table."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from stored import store

from retarget_bench.analysis.summary import separated, split_summary, tie_groups
from retarget_bench.results.result_matrix import result_matrices


@given(st.integers(1, 6), st.sets(st.tuples(st.integers(0, 5), st.integers(0, 5))))
def test_groups_are_all_largest_sets_without_a_pair_that_is_told_apart(count, drawn):
    pairs = {pair for pair in drawn if pair[0] < pair[1] < count}
    apart = np.zeros((count, count), dtype=bool)
    for first, second in pairs:
        apart[first, second] = apart[second, first] = True
    free = [
        set(members)
        for size in range(1, count + 1)
        for members in combinations(range(count), size)
        if not any(pair in pairs for pair in combinations(members, 2))
    ]
    largest = sorted(tuple(sorted(s)) for s in free if len(s) > 1 and not any(s < other for other in free))
    assert tie_groups(apart) == largest


def test_the_group_of_the_best_is_that_of_the_table(tmp_path: Path):
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 1, 20)
    for label, shift, own in (("a", 0.0, 0.1), ("b", 0.02, 0.1), ("c", 0.5, 1.5), ("d", 1.0, 0.1)):
        numbers = 10 + noise + shift + own * rng.normal(0, 1, 20)
        store(
            tmp_path, "cross", label,
            [("x>y", f"clip {k:02}", {"mpjpe_h.world": float(each)}) for k, each in enumerate(numbers)],
        )  # fmt: skip
    (panel,) = result_matrices(_places(tmp_path))
    ranking = split_summary(panel).rankings["mpjpe_h.world"]
    apart = separated(panel, ranking, "mpjpe_h.world")
    tied = {label for label, is_apart in zip(ranking.order, apart[0], strict=True) if not is_apart}
    assert tied == {ranking.best, *ranking.tied}
    assert (apart == apart.T).all()
    at = ranking.order.index
    assert apart[at("a"), at("d")]
    assert apart[at("b"), at("d")]


def _places(root: Path):
    from retarget_bench.results import store as records

    return records.find_results(root)
