"""Marks of a table and verdicts of ``bench compare`` on random clips: they should never contradict.

    python benchmarks/one_verdict.py RUNS [--subsets 1000]

Draws that many subsets of the clips of a run's splits, and compares every ranked method with the best.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tqdm import tqdm

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "tests" / "engine")]

from test_one_verdict import contradictions, subsets  # noqa: E402

from retarget_bench.analysis import pairwise, statistics  # noqa: E402
from retarget_bench.analysis.ranking import ranked_cases  # noqa: E402
from retarget_bench.analysis.selection import Selection  # noqa: E402
from retarget_bench.results import result_matrix, store  # noqa: E402

VALUES = ("mpjpe_h.world", "contact_recall", "foot_slide", "jerk_ratio")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=Path)
    parser.add_argument("--subsets", type=int, default=1000)
    given = parser.parse_args()
    statistics.paired_intervals = lambda rows: [None] * len(rows)  # which decide nothing
    matrices = Selection().parts(result_matrix.result_matrices(store.find_results(given.runs)))
    matrices = [each for each in matrices if each.clips.max() >= statistics.ENOUGH_CLIPS]
    found, drawn = [], 0
    for matrix in matrices:
        for some in tqdm(subsets(matrix, -(-given.subsets // len(matrices)), 2), desc=matrix.split):
            ranked = {value: ranked_cases(some, value) for value in VALUES}
            pairwise.ranked_cases = lambda _, value, known=ranked: known[value]  # once for all pairs
            found += contradictions(some, VALUES)
            drawn += 1
    print(f"{len(found)} contradictions in {drawn} subsets of clips", *found, sep="\n")


if __name__ == "__main__":
    main()
