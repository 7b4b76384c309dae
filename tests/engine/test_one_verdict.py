"""Table and comparison never contradict each other, whatever the clips."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stored import store

from retarget_bench.analysis import pairwise
from retarget_bench.results import result_matrix
from retarget_bench.results import store as records
from retarget_bench.results.header import WAITING, Problem
from retarget_bench.results.result_matrix import ResultMatrix
from retarget_bench.tables import comparing


def subsets(matrix: ResultMatrix, count: int, seed: int) -> Iterator[ResultMatrix]:
    """The matrix of some of its clips, drawn at random."""
    random = np.random.default_rng(seed)
    clips = int(matrix.clips.max()) + 1
    for _ in range(count):
        kept = random.permutation(clips) < random.integers(2, clips + 1)
        yield matrix.restricted(kept[matrix.clips], "")


def contradictions(matrix: ResultMatrix, values: Sequence[str]) -> list[str]:
    """What a table's marks and the comparisons with its best say differently, of these values."""
    rankings = comparing.table_rankings(matrix)
    rows = {row.label: row for row in matrix.rows}
    conflicts = []
    for value in values:
        if value not in rankings:
            continue
        ranking = rankings[value]
        pairs = [(best, label) for best in ranking.order[: ranking.equal] for label in ranking.order]
        for best, label in [(best, label) for best, label in pairs if best != label]:
            comparison = pairwise.compare(matrix, rows[best], rows[label], values, rankings)
            (one,) = (each for each in comparison.differences if each.value == value)
            claims = {
                "best": one.verdict in ("same", "equal"),
                "tied": one.verdict == "open",
                "": one.verdict == "first" or label in ranking.unclear,
            }
            if best != ranking.best and one.verdict == "same":
                continue  # no clip differs by more than the tolerance, though some do from the very best
            mark = ranking.mark(label)
            agree = claims[mark] if ranking.separable else one.verdict in ("few", "same", "equal")
            if not agree:
                conflicts.append(
                    f"{value}, {best}, {label}: {mark or 'unmarked'} in the table, {one.verdict}"
                )
    return conflicts


def stored(
    root: Path,
    numbers: Mapping[str, Sequence[float]],
    value: str = "mpjpe_h.world",
    tolerance: float | None = None,
) -> ResultMatrix:
    """The matrix of methods with these numbers of clips."""
    for label, each in numbers.items():
        store(
            root, "cross", label, [("x>y", f"clip {n:02}", {value: float(x)}) for n, x in enumerate(each)]
        )
    (matrix,) = result_matrix.result_matrices(records.find_results(root))
    if tolerance is not None:
        matrix.values[value] = replace(matrix.values[value], tolerance=tolerance)
    return matrix


def test_a_tie_with_one_of_two_that_share_the_best_mark_is_no_equality(tmp_path):
    """Means of 0, 0.9 and 1.5 tolerances. The second shares the mark of the first, and the third is tied
    with it, though it is as near to the second; its p is 1, since others differ more in most flips."""
    noise = np.random.default_rng(0).normal(size=(3, 12))
    numbers = 5.0 + noise - noise.mean(axis=1, keepdims=True) + [[0.0], [0.009], [0.015]]
    matrix = stored(tmp_path, dict(zip("abc", numbers, strict=True)), tolerance=0.01)
    ranking = comparing.table_rankings(matrix)["mpjpe_h.world"]
    assert (ranking.order, ranking.equal, ranking.p["c"]) == (("a", "b", "c"), 2, 1.0)
    assert contradictions(matrix, ["mpjpe_h.world"]) == []


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
        unclear += len(comparing.table_rankings(some)["mpjpe_h.world"].unclear)
    assert unclear, "no draw had a worse method that varies too much to be told from the best"


def test_who_is_equal_to_the_best_has_its_p_values(tmp_path):
    """The worst fails on few clips: beside the best alone it would be another family."""
    random = np.random.default_rng(1)
    hard = random.gamma(2.0, 1.0, 20)
    numbers = {"a": hard, "b": hard[::-1] + 1e-7, "c": 1.2 * hard, "d": 1.1 * hard + random.normal(size=20)}
    matrix = stored(tmp_path, numbers)
    rankings = comparing.table_rankings(matrix)
    ranking = rankings["mpjpe_h.world"]
    assert (ranking.order[:2], ranking.equal) == (("a", "b"), 2)
    rows = {row.label: row for row in matrix.rows}
    for label in "cd":
        comparison = pairwise.compare(matrix, rows["b"], rows[label], ["mpjpe_h.world"], rankings)
        assert comparison.differences[0].adjusted == ranking.p[label]
    assert contradictions(matrix, ["mpjpe_h.world"]) == []


def test_who_is_told_from_the_best_is_told_from_its_equals(tmp_path):
    """0.8 and 1.5 tolerances behind the best: the latter is worse, and 0.7 behind the former."""
    steps = {"a": np.zeros(20), "b": np.tile([0.0, 0.016], 10), "c": np.full(20, 0.015)}
    matrix = stored(tmp_path, {label: 1.0 + each for label, each in steps.items()}, tolerance=0.01)
    ranking = comparing.table_rankings(matrix)["mpjpe_h.world"]
    assert [ranking.mark(label) for label in "abc"] == ["best", "best", ""]
    (comparison,) = comparing.compare([matrix], "b", "c")
    assert comparison.differences[0].verdict == "first"
    assert contradictions(matrix, ["mpjpe_h.world"]) == []


@pytest.mark.parametrize(("tolerance", "verdict"), [(1e-3, "equal"), (1e-4, "second")])
def test_a_winner_is_who_has_the_better_mean_by_more_than_the_tolerance(tmp_path, tolerance, verdict):
    """Better by a little on most clips, worse by more on few: 0.0005 on average."""
    better = [2.0 - 9e-4] * 35 + [2.0 + 1.2e-3] * 8
    matrix = stored(tmp_path, {"one": [2.0] * 43, "two": better}, tolerance=tolerance)
    rankings = comparing.table_rankings(matrix)
    ranking = rankings["mpjpe_h.world"]
    (one,) = pairwise.compare(matrix, *matrix.rows, ["mpjpe_h.world"], rankings).differences
    assert ranking.best == "two"
    assert one.difference == pytest.approx((35 * 9e-4 - 8 * 1.2e-3) / 43)
    assert one.verdict == verdict
    assert ranking.mark("one") == ("best" if verdict == "equal" else "")
    assert contradictions(matrix, ["mpjpe_h.world"]) == []


def test_where_a_table_ranks_nobody_a_comparison_has_no_verdict(tmp_path):
    matrix = stored(tmp_path, {"one": [1.0] * 12, "two": [2.0 + n / 100 for n in range(12)]})
    (one,) = pairwise.compare(matrix, *matrix.rows, ["mpjpe_h.world"]).differences
    assert one.verdict == "first"
    waiting = (Problem(status="missing", message=WAITING, cases=("x",)),)
    rows = tuple(replace(row, header=replace(row.header, problems=waiting)) for row in matrix.rows)
    comparison = pairwise.compare(replace(matrix, rows=rows), *rows, ["mpjpe_h.world"])
    assert comparison.differences[0].verdict == "withheld"
    assert "no verdict by world: cases are missing" in comparison.notes


def test_a_method_beside_itself_is_the_same(tmp_path):
    matrix = stored(tmp_path, {"one": [1.0] * 12, "two": [2.0] * 12})
    for name in ("one", "two"):
        (comparison,) = comparing.compare([matrix], name, name)
        assert [(each.verdict, each.adjusted) for each in comparison.differences] == [("same", 1.0)]


def test_a_value_of_ones_own_is_compared_where_there_is_no_usual_one(tmp_path):
    matrix = stored(tmp_path, {"one": [1.0] * 12, "two": [2.0] * 12}, value="ratio")
    (comparison,) = comparing.compare([matrix], "one", "two")
    assert [each.value for each in comparison.differences] == ["ratio"]
