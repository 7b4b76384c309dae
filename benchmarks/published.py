"""Papers' methods trained as published on the same few clips, and what becomes of their papers' orders.

    python benchmarks/published.py --root PATH/TO/mixamo [--methods PAN SAN] [--hours 2]

On the training part of fold 0 of the Mixamo clips, from random weights, one seed: R2ET and PMnet for as
many windows as in their papers, the others for ``WINDOWS`` windows of their own length, 16 a batch
(their papers' batches are up to 512). --hours: these then go on up to so many hours, in further rows.
Trains what is missing below --out (runs/published), a run after the other; what was begun goes on. Then
all answer the fold's test clips. Writes ``results/published.md``, and of errors on validation
``results/published.png``.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
from matplotlib.ticker import ScalarFormatter

import retarget_bench as rb
from retarget_bench.figures import palette
from retarget_bench.files import atomic, write_text
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import run_folder, weights

PROJECT = Path(__file__).parents[1]
WHOLE = {
    "R2ET": "r2et[dropout=0.2,size=published]",
    "PMnet": "pmnet[variant=released,lengths=world,path=integrated]",
}
"""Name in papers -> the method as published, trained as long as there."""
PART = {
    "NKN": "nkn[variant=released,drift=0,lengths=world,path=integrated]",
    "SAN": "san[variant=released]",
    "PAN": "pan[variant=released]",
    "HuMoT": "humot[variant=paper_count,facing=false,sized=false,varied=false,mirrored=false,"
    "root_rule=leg_length]",
    "SMRM": "smrm[variant=paper,path=integrated]",
}
"""Name in papers -> the method as published, of whose training a part is made up."""
WINDOWS, ROWS = 50_000, 16
UNTRAINED = ("copy_rotations[root_rule=mixamo]", "ik[root_rule=mixamo]")
"""Their path follows the rule that describes these references best (results/mixamo.md)."""
SPLITS = ("self", "intra", "cross")
MPJPE, ALIGNED = "mpjpe_h.world", "mpjpe_h.root"
CLAIMS = (
    *(
        ("PAN, Table 1", split, *pair)
        for split in ("intra", "cross")
        for pair in (("PAN", "SAN"), ("SAN", "PMnet"), ("PMnet", "NKN"))
    ),
    ("HuMoT, Table 3", "self", "HuMoT", "SAN"),
    ("HuMoT, Table 4", "intra", "SAN", "HuMoT"),
    ("HuMoT, Table 5", "cross", "HuMoT", "SAN"),
)
"""Paper, split, and of two methods first the one that has the smaller error there."""
ABOUT = (
    "Trained on the training part of fold 0, tested on its test clips; from random weights, one seed. "
    "*windows*: drawn in training, and in brackets their share of the paper's, by their frames. R2ET "
    "and PMnet: the whole training of their papers. The others: 16 windows a batch at the papers' "
    "rates. Of each run the weights that validate best are kept. Copying and `ik` follow the path by "
    "`root_rule=mixamo`, which describes these references best; papers compare with copying under "
    "another rule. MPJPE and root-aligned MPJPE in % of height, 95 % intervals over clips in "
    "brackets. Errors on validation: `published.png`."
)
ORDERS = (
    "Below zero the first has the smaller error, as in the paper. *reproduced* and *refuted*: the 95 % "
    "interval over clips does not hold zero. PMnet has had the whole of its paper's training."
)


class Row(NamedTuple):
    """A trained method. folder: of its weights."""

    name: str
    method: str
    folder: Path

    @property
    def spec(self) -> str:
        """The method with these weights."""
        return str(Spec.parse(self.method).with_parameters(weights=str(self.folder)))


def trained(options: argparse.Namespace) -> list[Row]:
    """All rows, trained where they were not. Raises SystemExit where a training ends with an error."""
    rows = []
    for name, method in only(WHOLE, options.methods):
        rows.append(Row(name, method, run(options.out / name, method, options.root)))
    for name, method in only(PART, options.methods):
        folder = run(options.out / name, method, options.root, budget=f"{WINDOWS // ROWS}it")
        rows.append(Row(name, method, kept(folder, options.out / f"{name}-{WINDOWS}")))
        if options.hours:
            folder = run(options.out / name, method, options.root, budget=f"{options.hours:g}h")
            rows.append(Row(f"{name}, {options.hours:g} h", method, folder))
    return rows


def only(methods: dict[str, str], names: list[str]) -> list[tuple[str, str]]:
    """The methods of these names, with them."""
    return [(name, method) for name, method in methods.items() if name in names]


def run(folder: Path, method: str, root: str, budget: str = "") -> Path:
    """The folder of a run that has used up its budget; "": that of the paper."""
    begun = run_folder.read(folder)
    steps = int(budget.removesuffix("it")) if budget.endswith("it") else 0
    if begun and (begun.ended if begun.budget == budget or not budget else begun.steps >= steps > 0):
        return folder
    data = f"mixamo[protocol=folds,root={root}]"
    arguments = ["--resume"] if begun else [method, "-d", data, "--preset", "paper", "--jobs", "1"]
    arguments += ["--batch", str(ROWS)] if budget and not begun else []
    arguments += ["--budget", budget] if budget else []
    command = [sys.executable, "-m", "retarget_bench", "train", *arguments, "--out", str(folder)]
    if subprocess.run(command, check=False).returncode:
        raise SystemExit(f"{method}: training ended with an error, see above")
    return folder


def kept(run_: Path, folder: Path) -> Path:
    """The weights of a run as they are now, in a folder of their own, where they stay."""
    if not folder.exists():
        folder.mkdir(parents=True)
        for name in (f"{weights.BEST}.safetensors", f"{weights.BEST}.json"):
            shutil.copy(run_ / name, folder / name)
    return folder


# ------------------------------------------------------------------------------------------- the page
def table(rows: list[Row], results: rb.Results) -> Iterator[str]:
    """Lines of Markdown. Raises SystemExit where columns are over different cases."""
    frame = results.table([MPJPE, ALIGNED]).frame
    for (split, value), group in frame.groupby(["split", "value_id"]):
        if group.cases.nunique() > 1:
            raise SystemExit(f"{split}, {value}: over different cases")
    cells = {(row.method, row.split, row.value_id): row for row in frame.itertuples()}
    sizes = {row.split: f"{row.split} {row.cases:g} cases of {row.clips:g} clips" for row in cells.values()}
    heads = " | ".join(f"{split}, {label}" for split in SPLITS for label in ("MPJPE", "root-aligned"))
    yield from (f"{'; '.join(sizes[split] for split in SPLITS)}.", "")
    yield f"| method | windows | minutes | {heads} |"
    yield "|---|---:|---:|" + "---:|" * (2 * len(SPLITS))
    about = [(row.name + post, *amount(row)) for row in rows for post in ("", "+residual")]
    about += [(each.replace("_", "\\_"), "", "") for each in UNTRAINED]
    for facts, label in zip(about, results.methods, strict=True):
        shown = (cell(cells[label, split, value]) for split in SPLITS for value in (MPJPE, ALIGNED))
        yield f"| {' | '.join((*facts, *shown))} |"


def by_bodies(rows: list[Row], results: rb.Results) -> Iterator[str]:
    """Lines of Markdown: bodies that training knows and others apart."""
    frame = results.table(ALIGNED, by="seen").frame
    cells = {(row.method, row.split, row.part): row for row in frame.itertuples()}
    columns = list(dict.fromkeys((split, part) for _, split, part in cells))
    sizes = {key[1:]: f"{row.cases:g} cases" for key, row in cells.items()}
    heads = " | ".join(f"{split}, {part} ({sizes[split, part]})" for split, part in columns)
    yield f"| method | {heads} |"
    yield "|---|" + "---:|" * len(columns)
    names = [row.name + post for row in rows for post in ("", "+residual")]
    names += [each.replace("_", "\\_") for each in UNTRAINED]
    for name, label in zip(names, results.methods, strict=True):
        yield f"| {name} | {' | '.join(cell(cells[label, *column]) for column in columns)} |"


def amount(row: Row) -> tuple[str, str]:
    """Windows with their share of the paper's, and minutes."""
    card = weights.read_card(row.folder)
    assert card.recipe is not None
    share = registry.create("methods", row.spec).training_share
    return f"{card.steps * card.recipe.batch:,} ({share})", f"{card.seconds / 60:.0f}"


def cell(row: Any) -> str:
    return f"{row.value:.2f} [{row.low:.2f}, {row.high:.2f}]"


def orders(rows: list[Row], results: rb.Results) -> Iterator[str]:
    """What became of the papers' orders: lines of Markdown."""
    labels = {row.name: results.methods[2 * number] for number, row in enumerate(rows)}
    later = [name.partition(",")[2] for name in labels if "," in name]
    claimed = [claim for claim in CLAIMS if {*claim[2:]} <= labels.keys()]
    if claimed:
        yield "| claim | split | difference of MPJPE | after | |"
        yield "|---|---|---:|---|---|"
    for suffix in ("", *dict.fromkeys(f",{each}" for each in later)):
        for paper, split, better, worse in claimed:
            first, second = (labels.get(name + suffix, labels[name]) for name in (better, worse))
            compared = results.compare(first, second, MPJPE)
            (one,) = next(each for each in compared.splits if each.split == split).differences
            assert one.interval is not None  # over ten clips
            low, high = one.interval.low, one.interval.high
            verdict = "reproduced" if high < 0 else "refuted" if low > 0 else "open"
            after = suffix.removeprefix(", ") or f"{WINDOWS:,} windows"
            yield (
                f"| {paper}: {better} before {worse} | {split} | {one.first - one.second:+.2f} "
                f"[{low:+.2f}, {high:+.2f}] | {after} | {verdict} |"
            )


def picture(rows: list[Row], path: Path) -> None:
    """Validation over windows, a curve for each run."""
    figure, panel = plt.subplots(figsize=(7, 4), layout="tight")
    runs = {row.name.partition(",")[0]: row for row in rows}
    for number, (name, row) in enumerate(runs.items()):
        card = weights.read_card(row.folder)
        assert card.recipe is not None
        panel.plot(
            [each.step * card.recipe.batch for each in card.validation],
            [each.scores["cross"][MPJPE] for each in card.validation],
            marker=".",
            label=name,
            color=palette.COLOURS[number % len(palette.COLOURS)],
        )
    panel.set(xlabel="windows of training", ylabel="MPJPE, % of height (validation, cross)", yscale="log")
    for axis in (panel.yaxis.set_major_formatter, panel.yaxis.set_minor_formatter):
        axis(ScalarFormatter())
    panel.legend(frameon=False)
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--root", metavar="DIR", required=True, help="folder of the Mixamo clips")
    parser.add_argument(
        "--methods", nargs="+", choices=[*WHOLE, *PART], default=[*WHOLE, *PART], help="rows (all)"
    )
    parser.add_argument("--hours", type=float, metavar="N", help="of training in further rows")
    parser.add_argument("--out", type=Path, default=Path("runs/published"), metavar="DIR", help="of runs")
    options = parser.parse_args()
    rows = trained(options)
    methods = [f"{row.spec}{post}" for row in rows for post in ("", "+residual")]
    results = rb.run(
        [*methods, *UNTRAINED],
        dataset=f"mixamo[protocol=folds,root={options.root}]",
        splits=SPLITS,
        metrics=("position",),
        out=str(options.out / "results"),
        timed=False,
    )
    asked = "" if set(options.methods) == {*WHOLE, *PART} else f" --methods {' '.join(options.methods)}"
    asked += f" --hours {options.hours:g}" if options.hours else ""
    cases, _, *cells = table(rows, results)
    claims = [*orders(rows, results)]
    text = [
        "# Methods as published, on a little data",
        "",
        f"    python benchmarks/published.py --root DIR{asked}",
        "",
        f"{ABOUT} Cases: {cases}",
        "",
        *cells,
        "",
        "## Bodies that training knows, and others",
        "",
        "Root-aligned MPJPE in % of height; *known*: both bodies are among the four of training.",
        "",
        *by_bodies(rows, results),
    ]
    if claims:
        text += ["", "## What became of the papers' orders", "", ORDERS, "", *claims]
    picture(rows, PROJECT / "results" / "published.png")
    write_text(PROJECT / "results" / "published.md", "\n".join(text) + "\n")
    print("\n".join(text))


if __name__ == "__main__":
    main()
