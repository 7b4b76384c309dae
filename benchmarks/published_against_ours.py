"""Learned methods as published beside our variants: the same motion, the same hours, the same cores.

    python benchmarks/published_against_ours.py --minutes 60 -d 'puppets[size=large,bodies=200]'

Trains what is missing below --out (runs/published), a run after the other, each from random weights; what
was begun goes on, and more minutes go on from the runs that are there. Then every method answers the test
cases. Writes the end of ``results/learned.md`` and, of errors on validation over the time of training,
``results/published.png``. --root adds a table of the Mixamo clips of a folder.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

import retarget_bench as rb
from retarget_bench import defaults
from retarget_bench.figures import palette
from retarget_bench.files import atomic, write_text
from retarget_bench.training import run_folder, weights

PROJECT = Path(__file__).parents[1]
PAIRS = {
    "PAN": ("pan[variant=paper]", "pan[variant=released]", "pan"),
    "NKN": ("nkn[variant=released,drift=0,lengths=world,path=integrated]", "nkn"),
    "SMRM": ("smrm[variant=paper,path=integrated]", "smrm"),
    "HuMoT": (
        "humot[variant=paper_count,facing=false,sized=false,varied=false,mirrored=false,root_rule=leg_length]",
        "humot",
    ),
}
"""Method -> as published, and last as we train it."""
VALUES = {"mpjpe_h.world": "MPJPE", "mpjpe_h.root": "root-aligned", "contact_recall": "contact recall"}
METRICS = ("position", "contact")
SPLITS = ("self", "intra", "cross")
UNTRAINED = ("copy_rotations", "rest_pose")


def run_of(method: str, out: Path) -> Path:
    """The folder of a method's run."""
    return out / "".join(each if each.isalnum() else "-" for each in method).strip("-")


def train(method: str, data: list[str], minutes: float, out: Path) -> None:
    """Train a method up to so many minutes. Raises SystemExit where training ends with an error."""
    folder = run_of(method, out)
    begun = run_folder.read(folder)
    if begun and begun.seconds / 60 >= minutes * 0.99:
        return
    arguments = ["--resume"] if begun else [method, *(f"-d{each}" for each in data), "--jobs", "1"]
    command = [sys.executable, "-m", "retarget_bench", "train", *arguments]
    budget = ["--budget", f"{minutes:g}m", "--out", str(folder)]
    if subprocess.run([*command, *budget], check=False).returncode:
        raise SystemExit(f"{method}: training ended with an error, see above")


def with_weights(method: str, out: Path) -> str:
    """The method with what its run has learned."""
    name, _, rest = method.partition("[")
    return f"{name}[{','.join(filter(None, (rest.rstrip(']'), f'weights={run_of(method, out)}')))}]"


def curve(method: str, out: Path) -> tuple[list[float], list[float]]:
    """(minutes of training, MPJPE across structures on validation in % of height)"""
    validation = weights.read_card(run_of(method, out)).validation
    return (
        [each.seconds / 60 for each in validation],
        [each.scores["cross"]["mpjpe_h.world"] for each in validation],
    )


def picture(out: Path, path: Path) -> None:
    """A panel for each method: validation over minutes of training, as published and ours."""
    figure, panels = plt.subplots(
        1, len(PAIRS), figsize=(3.2 * len(PAIRS), 3.2), sharey=True, layout="tight"
    )
    for panel, (title, methods) in zip(panels, PAIRS.items(), strict=True):
        for number, method in enumerate(methods):
            is_own = method == methods[-1]
            label = "ours" if is_own else method.partition("variant=")[2].partition(",")[0].rstrip("]")
            minutes, errors = curve(method, out)
            colour = palette.COLOURS[0 if is_own else number + 1]
            panel.plot(minutes, errors, marker=".", label=label, color=colour, lw=2 if is_own else 1)
        panel.set(title=title, xlabel="minutes of training", yscale="log", xlim=(0, None))
        panel.legend(frameon=False)
    panels[0].set_ylabel("MPJPE, % of height (validation, cross)")
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=130)


def facts(method: str, out: Path) -> str:
    """Minutes and steps of a run, as cells of a table."""
    if method in UNTRAINED:
        return "| | "
    trained = weights.read_card(run_of(method, out))
    return f"| {trained.seconds / 60:.0f} | {trained.steps} "


def table(title: str, results: rb.Results, out: Path) -> Iterator[str]:
    """Lines of Markdown. Raises SystemExit where columns are over different cases."""
    frame = results.table(list(VALUES)).frame
    for (split, value), rows in frame.groupby(["split", "value_id"]):
        if rows.cases.nunique() > 1:
            raise SystemExit(f"{title}, {split}, {value}: over different cases")
    cells = {(row.method, row.split, row.value_id): row for row in frame.itertuples()}
    splits = [split for split in SPLITS if split in set(frame.split)]
    sizes = {row.split: f"{row.split} {row.cases:g} cases of {row.clips:g} clips" for row in cells.values()}
    heads = " | ".join(f"{split}, {label}" for split in splits for label in VALUES.values())
    yield from ("", f"### {title}", "", f"{'; '.join(sizes.values())}.", "")
    yield f"| method | minutes | steps | {heads} |"
    yield "|---|---:|---:|" + "---:|" * (len(splits) * len(VALUES))
    labels = dict(zip(results.methods, _methods(), strict=True))
    for label, method in labels.items():
        shown = " | ".join(_cell(cells.get((label, split, value))) for split in splits for value in VALUES)
        yield f"| {method.replace('_', chr(92) + '_')} {facts(method, out)}| {shown} |"


def _methods() -> list[str]:
    return [*(method for methods in PAIRS.values() for method in methods), *UNTRAINED]


def _cell(row: Any) -> str:
    if row is None or row.value != row.value:
        return "n/a"
    has_interval = row.low is not None and row.low == row.low
    return f"{row.value:.2f}" + (f" [{row.low:.2f}, {row.high:.2f}]" if has_interval else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60, metavar="N", help="of training, each (60)")
    parser.add_argument("-d", "--dataset", action="append", metavar="DATASET", help="to train on")
    parser.add_argument("--root", metavar="DIR", help="folder of Mixamo clips, for a table of them")
    parser.add_argument("--out", type=Path, default=Path("runs/published"), metavar="DIR", help="of runs")
    options = parser.parse_args()
    data = options.dataset or ["puppets[size=large,bodies=200]"]
    trained = _methods()[: -len(UNTRAINED)]
    for method in trained:
        train(method, data, options.minutes, options.out)
    methods = [*(with_weights(method, options.out) for method in trained), *UNTRAINED]
    sets: dict[str, dict[str, Any]] = {"Puppets": {"dataset": defaults.DATASET, "splits": SPLITS}}
    if options.root:
        sets["Mixamo"] = {"dataset": "mixamo", "root": options.root, "splits": SPLITS[1:]}
    out = [
        "## As published, against ours",
        "",
        "    python benchmarks/published_against_ours.py --minutes "
        f"{options.minutes:g} {' '.join(f'-d {each!r}' for each in data)}",
        "",
        "Every row is trained from random weights on the same motion for the same time on one core. The "
        "last row of a method is our variant; steps depend on what else the machine did. MPJPE in % of "
        "height, 95 % intervals over clips in brackets. Errors on validation over time: `published.png`.",
    ]
    for title, which in sets.items():
        results = rb.run(methods, metrics=METRICS, out=str(options.out / "results"), timed=False, **which)
        out += table(title, results, options.out)
    picture(options.out, PROJECT / "results" / "published.png")
    path = PROJECT / "results" / "learned.md"
    shipped = path.read_text(encoding="utf-8").partition(f"\n{out[0]}\n")[0]
    write_text(path, shipped + "\n" + (text := "\n".join(out) + "\n"))
    print(text)


if __name__ == "__main__":
    main()
