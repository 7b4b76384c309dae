"""What the error on Mixamo measures: level path, height and pose of every method, and the rules of copying.

    python benchmarks/mixamo.py --mixamo PATH/TO/mixamo

Computes what is missing or outdated in --out (runs/peers, which ``peers.py`` fills, too) and writes
``results/mixamo.md`` and ``results/mixamo.png``. --same, --r2et: weights of papers' authors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from peers import ALIGNED, FITTED, METRICS, MPJPE, RECALL, authors, cell, methods_of, named, same_cases

import retarget_bench as rb
from retarget_bench import defaults
from retarget_bench.figures import palette
from retarget_bench.files import atomic, write_text
from retarget_bench.results.header import MethodInfo

PROJECT = Path(__file__).parents[1]
RULES = ("mixamo", "root_offset", "hip_height", "leg_length", "hip_height_width", "height")
"""Of copied rotations; ``hip_height`` is the default."""
METHODS = (
    *("ik", "ik[root_rule=mixamo]", "bone_directions", "paired", "r2et", "same", "pan", "pan+root_path"),
    *("humot", "humot[root_rule=mixamo]", "smrm", "pmnet", "nkn"),
)
LEVEL, LIFT = "path_fit.level", "path_fit.lift"
ALONG, HEIGHT = "root_path.horizontal", "root_path.vertical"
VALUES = (MPJPE, FITTED, ALIGNED, RECALL, ALONG, HEIGHT, LEVEL, LIFT)
PARTS = {ALONG: "level path", HEIGHT: "height of the hips", ALIGNED: "pose (root-aligned)"}
HEADS = {
    MPJPE: "MPJPE",
    FITTED: "path fitted",
    **PARTS,
    RECALL: "contact recall",
    LEVEL: "level factor",
    LIFT: "lift",
}
ABOUT = """\
# What the error on Mixamo measures

    python benchmarks/mixamo.py --mixamo DIR --same DIR --r2et FILE

{cases} cases of {clips} clips across structures, of the papers' test clips as far as they are at hand;
every row is over the same cases. MPJPE is the mean distance of the joints from the reference's. Numbers
are in % of the target's height, but for contact recall and the level factor; 95 % intervals over clips
stand in brackets and take fits as fixed.

MPJPE counts three things at once: where the hips are over the ground (*level path*), how high they are
(*height of the hips*), and the pose around them (*root-aligned*). They are lengths in different
directions and do not add up to MPJPE. On these clips the references are nearly copied rotations: of the
{copied} of copied rotations about 1 is the pose, and the rest comes from the path of the hips. Some of it
is the rule by which the path was scaled, a convention of whoever made the references, which no method can
read off the source: by rule alone, with the same pose, copying goes from {best} to {worst}. So MPJPE does
not say which of two methods poses better. *Root-aligned* does.

*Path fitted* is MPJPE once the answer's level path is scaled by one factor (*level factor*) and its
height shifted by one constant (*lift*), those that suit each pair of bodies best over all its clips. It
takes a rule's scale away, and hardly differs between the rules that come near. What it leaves beside the
pose is path, too: here the height of the hips follows the source's with a slope that is 5 to 25 % off the
ratio of hip heights, which no lift mends. The two fitted numbers are shown as means over pairs, between
which they differ: 1.01 may be 0.9 for one and 1.1 for another. Visual odometry prints such an error after
alignment beside the raw one (Zhang and Scaramuzza, *A Tutorial on Quantitative Trajectory Evaluation*,
IROS 2018).

Root rules scale the path by a ratio of the target to the source: of the height of the hips (`hip_height`,
the default), of the bones of the leg (`leg_length`), of the root's offset in the file, of the body's
height, of hip height and width. `mixamo` scales level by hip height plus 0.6 hip width and height by hip
height. It describes these references and was fitted on these characters, so that its rows show what a
rule can do and no more; on SAME's pairs it is no better than `hip_height`, and it is no default. Methods
without the parameter follow it by the post-processor `root_path`.

![Level path, height and pose by method, and of copying by root rule](mixamo.png)
"""


def table(frame: Any, methods: Sequence[str], infos: dict[str, MethodInfo]) -> Iterator[str]:
    """Lines of Markdown. methods: labels, in order."""
    rows = {(row.method, row.value_id): row for row in frame.itertuples()}
    yield f"| method | root rule | {' | '.join(HEADS[value] for value in VALUES)} |"
    yield "|---|---|" + "---:|" * len(VALUES)
    for label in methods:
        values = (cell(rows.get((label, value)), value in (MPJPE, FITTED, ALIGNED)) for value in VALUES)
        rule = infos[label].root_rule.replace("_", "\\_") or "its own path"
        yield f"| {named(infos[label])} | {rule} | {' | '.join(values)} |"


def picture(frame: Any, panels: dict[str, Sequence[str]], names: dict[str, str], path: Path) -> None:
    """Bars of the three parts, and marks for MPJPE and path fitted, a group for each method."""
    number = {(row.method, row.value_id): row.value for row in frame.itertuples()}
    sizes = [len(labels) for labels in panels.values()]
    figure, axes = plt.subplots(
        len(panels), 1, figsize=(8.5, 0.48 * sum(sizes) + 2.2), height_ratios=sizes, layout="constrained"
    )
    for axis, (title, labels) in zip(axes, panels.items(), strict=True):
        at = np.arange(len(labels))
        for part, (value, name) in enumerate(PARTS.items()):
            widths = [number[label, value] for label in labels]
            axis.barh(at + 0.25 * (part - 1), widths, 0.25, label=name, color=palette.COLOURS[part])
        for value, marker in ((MPJPE, "o"), (FITTED, "D")):
            numbers = [number[label, value] for label in labels]
            axis.plot(numbers, at, marker, label=HEADS[value], color="black", mfc="none", ms=6)
        axis.set(yticks=at, yticklabels=[names[label] for label in labels], title=title)
        axis.set(xlim=(0, None), ylim=(len(labels) - 0.5, -0.5))
        axis.grid(axis="x", alpha=0.3)
    axes[-1].set_xlabel("% of the target's height, mean over clips")
    axes[0].legend(frameon=False, loc="upper right")
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mixamo", required=True, metavar="DIR", help="folder of the Mixamo clips")
    parser.add_argument("--same", metavar="DIR", help="folder of the weights of SAME's authors")
    parser.add_argument("--r2et", metavar="FILE", help="weights of R2ET's authors")
    parser.add_argument("--out", default="runs/peers", metavar="DIR", help="folder of results")
    parser.add_argument("--jobs", type=int, default=defaults.jobs(), metavar="N", help="processes")
    options = parser.parse_args()
    copying = [f"copy_rotations[root_rule={rule}]" for rule in RULES if rule != "hip_height"]
    methods = ["copy_rotations", *copying, *METHODS, *authors(options.same, options.r2et)]
    results = rb.run(
        methods,
        dataset="mixamo",
        root=options.mixamo,
        splits=("cross",),
        metrics=METRICS,
        out=options.out,
        jobs=options.jobs,
        timed=False,
    )
    frame = same_cases(results.table(list(VALUES)).frame, "Mixamo")
    text = page(frame, results)
    write_text(PROJECT / "results" / "mixamo.md", text)
    print(text)


def page(frame: Any, results: rb.Results) -> str:
    """The page; the picture is written beside it."""
    errors = {row.method: row.value for row in frame[frame.value_id == MPJPE].itertuples()}
    labels = sorted(errors, key=errors.__getitem__)
    infos = methods_of(results)
    names = {label: named(infos[label]).replace("\\", "") for label in labels}
    panels = {
        "Methods": [label for label in labels if not label.startswith("copy_rotations[")],
        "Copied rotations by root rule": [label for label in labels if label.startswith("copy_rotations")],
    }
    picture(frame, panels, names, PROJECT / "results" / "mixamo.png")
    first = next(frame[frame.value_id == MPJPE].itertuples())
    copied = [errors[label] for label in panels["Copied rotations by root rule"]]
    out = [
        ABOUT.format(
            cases=f"{first.cases:g}",
            clips=f"{first.clips:g}",
            copied=f"{errors['copy_rotations']:.2f}",
            best=f"{min(copied):.2f}",
            worst=f"{max(copied):.2f}",
        )
    ]
    for title, shown in panels.items():
        out += [f"## {title}", "", *table(frame, shown, infos), ""]
    return "\n".join(out)


if __name__ == "__main__":
    main()
