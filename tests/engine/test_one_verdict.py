"""Table and comparison never contradict each other, whatever the clips."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from stored import store

from retarget_bench.analysis import pairwise, selection
from retarget_bench.analysis.ranking import ranked_cases
from retarget_bench.results import result_matrix
from retarget_bench.results import store as records
from retarget_bench.results.result_matrix import ResultMatrix

ROWS = Path(__file__).parents[2] / "results" / "golden"
VALUES = ("mpjpe_h.world", "contact_recall", "foot_slide", "jerk_ratio")


def subsets(matrix: ResultMatrix, count: int, seed: int) -> Iterator[ResultMatrix]:
    """The matrix of some of its clips, drawn at random."""
    random = np.random.default_rng(seed)
    clips = int(matrix.clips.max()) + 1
    for _ in range(count):
        kept = random.permutation(clips) < random.integers(2, clips + 1)
        yield matrix.restricted(kept[matrix.clips], "")


def contradictions(matrix: ResultMatrix, values: Sequence[str]) -> list[str]:
    """What a table's marks and the comparisons with its best say differently, of these values."""
    table = selection.without_variants(matrix)
    rows = {row.label: row for row in matrix.rows}
    found = []
    for value in values:
        if (ranked := ranked_cases(table, value)) is None:
            continue
        ranking, _ = ranked
        for label in ranking.order[1:]:
            comparison = pairwise.compare(matrix, rows[ranking.best], rows[label], values, table)
            (one,) = (each for each in comparison.differences if each.value == value)
            same = one.verdict in ("same", "open")
            told = {"tied": same, "": one.verdict == "first" or label in ranking.unclear}
            mark = ranking.mark(label)
            agree = told[mark] if ranking.separable else one.verdict in ("few", "same")
            if not agree:
                found.append(f"{value}, {label}: {mark or 'unmarked'} in the table, {one.verdict}")
    return found


def test_marks_and_verdicts_agree_on_random_clips(tmp_path):
    random = np.random.default_rng(0)
    hard = random.gamma(2.0, 1.0, 30)
    fails = np.where(random.random(30) < 0.1, 30.0, 0.0)  # the last method, on few clips
    for label, worse, own in (("a", 1.0, 0.3), ("b", 1.05, 0.3), ("c", 1.2, 0.3), ("d", 1.0, 0.3)):
        entries = [
            (
                "x>y",
                f"clip {n:02}",
                {
                    "mpjpe_h.world": float(
                        worse * each + own * random.gamma(1.0, 1.0) + (label == "d") * fails[n]
                    ),
                    "ratio": float(np.exp(own * random.normal())),
                },
            )
            for n, each in enumerate(hard)
        ]
        store(tmp_path, "cross", label, entries)
    (matrix,) = result_matrix.result_matrices(records.find_results(tmp_path))
    unclear = 0
    for some in subsets(matrix, 25, 1):
        assert contradictions(some, ("mpjpe_h.world", "ratio")) == []
        unclear += len(ranked_cases(some, "mpjpe_h.world")[0].unclear)
    assert unclear, "no draw had a worse method that varies too much to be told from the best"


@pytest.mark.slow
def test_they_agree_on_a_thousand_subsets_of_shipped_rows():
    matrices = result_matrix.result_matrices(records.find_results(ROWS))
    for matrix in matrices:
        for some in subsets(matrix, -(-1000 // len(matrices)), 2):
            assert contradictions(some, VALUES) == []
