"""How well FID of people and FID per structure agree on the order of methods, in results that have both.

    bench run ik ... -d 'puppets[size=default]' -m position -m fid_structure -m fid --out RUNS
    python tests/benchmarks/fid_agreement.py RUNS [--least WINDOWS]

Spearman's rank correlation over the methods, per split and structure, with its two-sided p-value, and the
number of windows of the structure. ``fid.structure`` of fewer windows than it asks for is left out, unless
``--least`` says otherwise; methods without both values are, too.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

from scipy.stats import spearmanr

from retarget_bench.api import TWO_LEGS
from retarget_bench.evaluation import set_metrics
from retarget_bench.results import store


def main() -> None:
    """Print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--least", type=int, default=0, help="windows of a structure")
    given = parser.parse_args()
    people: dict[tuple[str, str], float] = {}
    structures: dict[tuple[str, str], dict[str, tuple[float, int]]] = defaultdict(dict)
    for place in store.find_results(given.runs):
        label = store.read_header(place.header).method.label
        for each in set_metrics.read(place):
            if each.value is None or each.kind:
                continue
            if (each.value_id, each.structure) == ("fid", TWO_LEGS):
                people[place.split, label] = each.value
            elif each.value_id == "fid.structure" and each.n >= given.least:
                structures[place.split, each.structure][label] = each.value, each.n
    print("| split | structure | methods | windows | Spearman | p |")
    print("|---|---|---:|---:|---:|---:|")
    for (split, structure), values in sorted(structures.items()):
        both = sorted(label for label in values if (split, label) in people)
        if len(both) < 3:
            continue
        found = spearmanr([people[split, each] for each in both], [values[each][0] for each in both])
        windows = min(values[each][1] for each in both)
        rank = f"{found.statistic:.2f} | {found.pvalue:.1g}"
        print(f"| {split} | {structure} | {len(both)} | {windows} | {rank} |")


if __name__ == "__main__":
    main()
