"""Marks of a table and verdicts of ``bench compare`` on random clips: they should never contradict.

    python benchmarks/one_verdict.py RUNS [--subsets 1000]

Draws that many subsets of the clips of a run's splits, and for values of whole sets, which are over all
clips, of the methods; and compares every ranked method with the best.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tqdm import tqdm

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "tests" / "engine")]

from test_one_verdict import contradictions, some_methods, subsets  # noqa: E402

from retarget_bench.analysis import statistics  # noqa: E402
from retarget_bench.analysis.selection import Selection  # noqa: E402
from retarget_bench.results import result_matrix, store  # noqa: E402

VALUES = ("mpjpe_h.world", "contact_recall", "foot_slide", "jerk_ratio")
OF_SETS = ("fid",)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=Path)
    parser.add_argument("--subsets", type=int, default=1000)
    options = parser.parse_args()
    matrices = Selection().parts(result_matrix.result_matrices(store.find_results(options.runs)))
    matrices = [each for each in matrices if each.clips.max() >= statistics.ENOUGH_CLIPS]
    problems, drawn = [], 0
    for matrix in matrices:
        count = -(-options.subsets // len(matrices))
        for some in tqdm(subsets(matrix, count, 2), desc=matrix.split):
            problems += contradictions(some, VALUES)
            drawn += 1
        for some in some_methods(matrix, count, 2):
            problems += contradictions(some, OF_SETS)
    print(f"{len(problems)} contradictions in {drawn} subsets of clips", *problems, sep="\n")


if __name__ == "__main__":
    main()
