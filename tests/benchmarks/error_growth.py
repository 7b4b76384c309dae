"""Draws error against time for methods side by side, from folders of results.

    python tests/benchmarks/error_growth.py RESULTS... [-o growth.png] [--at-least 60] [--split intra]

One panel per split; a line per method, the mean over source clips in every second, and its 95 % interval
over clips where there are ten or more. Only clips that last so long count, so that every second stands on
the same ones. Prints the mean of the first and the last five seconds, and what the error grows by per
minute (least squares over the curve). The same as data:

    bench table RESULTS... --columns growth.world --at-least 60 -f csv
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from retarget_bench.analysis import summary
from retarget_bench.analysis.statistics import ENOUGH_CLIPS
from retarget_bench.analysis.summary import Mean, SplitSummary
from retarget_bench.results import store

ENDS = 5
"""Seconds at the beginning and at the end whose means are printed."""
Curve = dict[int, Mean]


def curves(sections: Sequence[SplitSummary], value: str) -> dict[str, dict[str, Curve]]:
    """Split -> method -> second -> mean, those with the smallest error at the end first."""
    found: dict[str, dict[str, Curve]] = {}
    for section in sections:
        for score in section.scores:
            if value in score.means:
                curve = found.setdefault(section.split, {}).setdefault(score.label, {})
                curve[int(section.part)] = score.means[value]
    return {
        split: dict(sorted(methods.items(), key=lambda item: max(item[1].items())[1].value))
        for split, methods in found.items()
    }


def told(curve: Curve) -> str:
    """First and last seconds of a curve, and its slope."""
    seconds, values = np.array(list(curve)), np.array([mean.value for mean in curve.values()])
    slope = np.polyfit(seconds, values, 1)[0] if len(seconds) > 1 else 0.0
    first = next(iter(curve.values()))
    return (
        f"{values[:ENDS].mean():8.2f} {values[-ENDS:].mean():8.2f} {60 * slope:+8.2f}   "
        f"{first.n} cases of {first.clips} clips"
    )


def draw(
    found: dict[str, dict[str, Curve]], ylabel: str, title: str, up_to: float | None, file: Path
) -> None:
    """One panel per split, on one scale that ends at ``up_to``, or where the numbers do."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(
        1,
        len(found),
        figsize=(1.5 + 4.5 * len(found), 4.0),
        sharey=True,
        squeeze=False,
        layout="constrained",
    )
    colours = {
        label: f"C{n}" for n, label in enumerate(dict.fromkeys(m for each in found.values() for m in each))
    }
    for axis, (split, methods) in zip(axes[0], found.items(), strict=True):
        for label, curve in methods.items():
            seconds = np.array(list(curve)) - 0.5
            axis.plot(seconds, [mean.value for mean in curve.values()], color=colours[label], label=label)
            ends = [mean.interval for mean in curve.values()]
            if all(ends):
                low, high = [each.low for each in ends], [each.high for each in ends]
                axis.fill_between(seconds, low, high, color=colours[label], alpha=0.15, linewidth=0)
        clips = max(mean.clips for curve in methods.values() for mean in curve.values())
        few = "" if clips >= ENOUGH_CLIPS else ", too few for intervals"
        axis.set(title=f"{split}: {clips} clips{few}", xlabel="seconds", xlim=(0, None))
        axis.grid(alpha=0.3)
        axis.legend(fontsize="small")
    axes[0][0].set_ylabel(ylabel)
    axes[0][0].set_ylim(0, up_to)
    figure.suptitle(title)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("results", nargs="+", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("growth.png"))
    parser.add_argument("--at-least", type=int, default=60, metavar="SECONDS")
    parser.add_argument("--value", default="growth.world")
    parser.add_argument("--split", action="append", help="only this split (may be given again)")
    parser.add_argument("--up-to", type=float, help="where the vertical axis ends")
    options = parser.parse_args()
    places = [place for root in options.results for place in store.find_results(root)]
    sections = summary.split_summaries(places, "second", options.at_least)
    sections = [each for each in sections if not options.split or each.split in options.split]
    for dataset in dict.fromkeys(section.dataset for section in sections):
        own = [section for section in sections if section.dataset == dataset]
        found = curves(own, options.value)
        about = own[0].values[options.value]
        several = len({section.dataset for section in sections}) > 1
        name = f"{options.output.stem}-{dataset.replace(' ', '-')}" if several else options.output.stem
        file = options.output.with_name(f"{name}.png")
        print(f"{dataset}: {about['label']}, {about['unit']}; {options.at_least} s and longer -> {file}")
        for split, methods in found.items():
            print(f"  {split:44s} first {ENDS} s  last {ENDS} s per minute")
            for label, curve in methods.items():
                print(f"    {label:40s} {told(curve)}")
        draw(found, f"{about['label']} [{about['unit']}]", dataset, options.up_to, file)


if __name__ == "__main__":
    main()
