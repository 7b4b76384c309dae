"""Learned methods on generated people and on real rigs, beside untrained ones, and what was aimed at.

    python benchmarks/learned_methods.py --root PATH/TO/mixamo

Computes what is missing or outdated in --out (runs/learned). Writes ``results/learned.md``,
``results/learned_curves.png`` from the cards of the weights, and ``methods/known.csv`` and
``methods/known_bodies.csv``, by which ``bench retarget`` and ``bench info`` warn. Methods without shipped
weights are left out.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import own_body

import retarget_bench as rb
from retarget_bench import defaults
from retarget_bench.analysis import statistics
from retarget_bench.figures import palette
from retarget_bench.files import atomic, write_csv, write_text
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python import known

PROJECT = Path(__file__).parents[1]
RIGS = "humot[slanted=true,weights=rigs]"
METHODS = (
    *("ik", "copy_rotations", "bone_directions", "paired", "paired[root_rule=learned]"),
    *("pan", "pan+residual", "pan+residual+footlock"),
    *("humot", "humot+residual", "humot+residual+fit+footlock"),
    *(RIGS, f"{RIGS}+residual", f"{RIGS}+residual+fit+footlock"),
    *("smrm", "smrm+residual", "smrm+residual+footlock"),
    *("nkn", "nkn+residual", "nkn+residual+footlock"),
    *("pmnet", "pmnet+residual", "pmnet+residual+footlock"),
    *("r2et", "r2et+residual", "same", "same+residual"),
    STILL := "rest_pose",
)
FEWEST = "san"
OF_KNOWN_STRUCTURES = (
    *(FEWEST, "san+residual", "san+residual+footlock"),
    *("nkn_cross", "nkn_cross+residual", "nkn_cross+residual+footlock"),
    *("pmnet_cross", "pmnet_cross+residual", "pmnet_cross+residual+footlock"),
)
"""Methods that answer on the structures of their training alone, and are compared on fewer cases."""
BESIDE = ("ik", "copy_rotations", "nkn", "pmnet", STILL)
LABELS = {
    "mpjpe_h.world": "MPJPE, % of height",
    "contact_recall": "contact recall",
    "jerk_ratio": "jerk ratio",
}
SPLITS = {"puppets": ("self", "intra", "cross"), "mixamo": ("intra", "cross")}
BODIES = {"puppets": known.GENERATED, "mixamo": known.REAL}

METRICS = ("position", "contact", "smoothness")
MPJPE, ALIGNED, RECALL, JERK = "mpjpe_h.world", "mpjpe_h.root", "contact_recall", "jerk_ratio"
Column = tuple[str, str, str]
"""Data set, split, value."""
INTRA, CROSS = ("puppets", "intra", MPJPE), ("puppets", "cross", MPJPE)
KEPT = ("puppets", "cross", RECALL)
REAL, REAL_ALIGNED = ("mixamo", "cross", MPJPE), ("mixamo", "cross", ALIGNED)
OWN = ("own", "self", ALIGNED)
TABLES = {
    "What was to be reached": {
        "own body, Mixamo's motion, root-aligned": OWN,
        "Mixamo, cross, root-aligned": REAL_ALIGNED,
        "Mixamo, cross": REAL,
        "puppets, intra": INTRA,
        "puppets, cross": CROSS,
        "contact recall, puppets, cross": KEPT,
    },
    "Contact recall and jerk ratio": {
        "recall, puppets, intra": ("puppets", "intra", RECALL),
        "recall, Mixamo, cross": ("mixamo", "cross", RECALL),
        "jerk, puppets, intra": ("puppets", "intra", JERK),
        "jerk, puppets, cross": ("puppets", "cross", JERK),
        "jerk, Mixamo, cross": ("mixamo", "cross", JERK),
    },
}

Limit = float | str
"""A number, or the method whose number in the same column it is."""


def aims(own: float, aligned: float, intra: float, cross: float, kept: float) -> dict[Column, Limit]:
    return {OWN: own, REAL_ALIGNED: aligned, INTRA: intra, CROSS: cross, KEPT: kept}


LIKE_IK: dict[Column, Limit] = {REAL: "ik", CROSS: "ik", INTRA: "ik"}
AIMS: dict[str, dict[Column, Limit]] = {
    "paired": aims(0.1, 0.97, 1.5, 1.9, 0.95) | {REAL: "ik"},
    "paired[root_rule=learned]": {OWN: 0.1, INTRA: 0.8, CROSS: 1.5, KEPT: 0.85},
    "pan": aims(1.2, 1.8, 1.7, 2.2, 0.40),
    "humot": aims(1.8, 2.5, 1.9, 2.2, 0.40),
    "smrm": aims(1.8, 2.5, 2.0, 2.4, 0.35),
    "pmnet": aims(2.5, 3.0, 2.2, 2.6, 0.30),
    "nkn": aims(3.0, 4.0, 2.8, 3.2, 0.25),
    **{f"{name}+residual+footlock": LIKE_IK for name in ("pan", "smrm", "pmnet", "nkn")},
    "humot+residual+fit+footlock": LIKE_IK,
}


def comparisons(results: rb.Results, bodies: str) -> Iterator[known.Comparison]:
    """Every method that is no control against the default one."""
    default, version, _ = known.identity(defaults.METHOD)
    for method in results.methods:
        if method in (default, STILL):
            continue
        for comparison in results.compare(method, default, MPJPE).splits:
            (one,) = comparison.differences
            ends = (one.interval.low, one.interval.high) if one.interval else ()
            numbers = [f"{number:.4g}" for number in (one.first, one.second, *ends, one.p)]
            # not by its verdict, which is withheld where some clips are left out, as here on purpose
            ahead = known.identity(method)[0] if one.first < one.second else default
            yield known.Comparison(
                *known.identity(method),
                *(default, version, bodies, comparison.split, comparison.dataset.removesuffix(": people")),
                *(str(one.cases), str(one.clips), *numbers[:2], *(numbers[2:-1] or ("", "")), numbers[-1]),
                better=ahead if one.p < statistics.ALPHA else "",
            )


Cells = dict[tuple[str, Column], Any]


def own_bodies(found: own_body.Found) -> Cells:
    """The errors of Mixamo's motion on its own bodies."""
    cells: Cells = {}
    for name, losses in found.items():
        (interval,) = statistics.mean_intervals(losses["Mixamo", "Mixamo"][None])
        assert interval is not None  # of two dozen motions
        mean = losses["Mixamo", "Mixamo"].mean()
        cells[name, OWN] = SimpleNamespace(value=mean, low=interval.low, high=interval.high)
    return cells


def numbers(results: dict[str, rb.Results]) -> tuple[Cells, str]:
    """(the row of every method and column, over how many cases they are)"""
    cells: Cells = {}
    sizes = {}
    for name, each in results.items():
        for row in each.table([MPJPE, ALIGNED, RECALL, JERK]).frame.itertuples():
            cells[row.method, (name, row.split, row.value_id)] = row
            if row.method == defaults.METHOD and row.value_id == MPJPE:
                sizes[f"{row.dataset}, {row.split}"] = f"{row.cases:g} cases of {row.clips:g} clips"
    return cells, "; ".join(f"{name}: {size}" for name, size in sizes.items())


def page(results: dict[str, rb.Results], found: own_body.Found, known_structures: rb.Results) -> str:
    """The tables as Markdown, every number with its interval and what it was to be."""
    cells, sizes = numbers(results)
    cells |= own_bodies(found)
    out = [
        "# Learned methods and what they were to reach",
        "",
        "    python benchmarks/learned_methods.py --root PATH/TO/mixamo",
        "",
        "Shipped weights. After a plus stand post-processors "
        "([docs/methods.md](../docs/methods.md#post-processors)). "
        "MPJPE in % of height. Means over clips on the cases that all methods answered, 95 % intervals "
        "over clips in brackets; below them the aim, and whether the mean reaches it. Mixamo: the clips "
        "that are not in fold 0, by which choices were made. *own body*: as in `own_body.py`. "
        + f"{sizes}. Errors on validation over the last training of each, from random weights or from "
        "others (continued): `learned_curves.png`.",
    ]
    for title, columns in TABLES.items():
        out += table(title, columns, METHODS, cells)
    out += lacking(found)
    out += beside(known_structures)
    return "\n".join(out) + "\n"


def lacking(found: own_body.Found) -> Iterator[str]:
    """Lines of Markdown: what the methods lack, told by motions on their own bodies."""
    yield from ("", "## Motion given back on its own body", "")
    yield (
        "Root-aligned MPJPE in % of height, 95 % intervals over motions in brackets. Copying has 0, and so "
        "has `+residual`. A method whose first two columns are the larger ones lacks motion; one whose "
        "first and third are, bodies."
    )
    yield ""
    yield from own_body.table(found)


def table(title: str, columns: dict[str, Column], methods: Iterable[str], cells: Cells) -> Iterator[str]:
    """Lines of Markdown; methods that have no number across structures are left out."""
    yield from (
        "",
        f"## {title}",
        "",
        f"| method | {' | '.join(columns)} |",
        "|---|" + "---|" * len(columns),
    )
    for method in methods:
        if (method, CROSS) in cells:
            shown = " | ".join(cell(cells, method, column) for column in columns.values())
            yield f"| {method.replace('_', chr(92) + '_')} | {shown} |"


def beside(results: rb.Results) -> Iterator[str]:
    """Lines of Markdown: the methods that know structures of their training alone beside others, all on
    the cases that FEWEST answers. Raises SystemExit where they are not over the same cases."""
    splits, methods = SPLITS["puppets"], (*OF_KNOWN_STRUCTURES, *BESIDE)
    values: dict[tuple[str, str, str], Any] = {}
    sizes: dict[str, set[int]] = {split: set() for split in splits}
    for method in methods[1:]:
        for split in results.compare(method, FEWEST, list(LABELS)).splits:
            for one in split.differences:
                values[method, split.split, one.value] = one.first
                values[FEWEST, split.split, one.value] = one.second
                sizes[split.split].add(one.cases)
    if any(len(counts) != 1 for counts in sizes.values()):
        raise SystemExit(f"methods of known structures answer different cases: {sizes}")
    listed = ", ".join(f"{split} {counts.pop()}" for split, counts in sizes.items())
    yield from ("", "## On structures that all of training knows", "", f"Cases: {listed}.", "")
    yield f"| method | {' | '.join(f'{label}, {split}' for label in LABELS.values() for split in splits)} |"
    yield "|---|" + "---:|" * (len(LABELS) * len(splits))
    for method in methods:
        shown = " | ".join(f"{values[method, split, value]:.2f}" for value in LABELS for split in splits)
        yield f"| {method.replace('_', chr(92) + '_')} | {shown} |"


def cell(cells: Cells, method: str, column: Column) -> str:
    """A number, its interval and its aim."""
    row = cells.get((method, column))
    if row is None or row.value != row.value:
        return "n/a"
    text = f"{row.value:.2f}" + (f" [{row.low:.2f}, {row.high:.2f}]" if row.low == row.low else "")
    if (limit := AIMS.get(method, {}).get(column)) is None:
        return text
    aim = limit if isinstance(limit, float) else cells[limit, column].value
    more = column[2] == RECALL
    mean = round(row.value, 2)  # as it stands there
    reached = mean >= round(aim, 2) if more else mean <= round(aim, 2)
    return f"{text}<br>{'≥' if more else '≤'} {aim:.2f}: {'yes' if reached else 'no'}"


def curves(cards: dict[str, Any], path: Path) -> None:
    """A panel for each method: errors on validation over the minutes of its last training, by its card."""
    columns = 4
    rows = -(-len(cards) // columns)
    figure, panels = plt.subplots(rows, columns, figsize=(12, 2.6 * rows), layout="tight", squeeze=False)
    for panel, (name, card) in zip(panels.flat, cards.items(), strict=False):
        validation = card.validation
        for split, colour in zip(("self", "intra", "cross"), palette.COLOURS, strict=False):
            errors = [each.scores[split][ALIGNED] for each in validation]
            minutes = [each.seconds / 60 for each in validation]
            panel.plot(minutes, errors, marker=".", label=split, color=colour)
        begun = " (continued)" if card.init else ""  # from other weights
        panel.set_title(name.replace("[", "\n[") + begun, fontsize=9)
        panel.set(xlim=(0, None), ylim=(0, 1.05 * panel.get_ylim()[1]))
    for panel in panels.flat[len(cards) :]:
        panel.axis("off")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="lower right", ncols=3, frameon=False)
    figure.supxlabel("minutes of training on one core")
    figure.supylabel("MPJPE, root-aligned, % of height (validation)")
    with atomic(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--root", required=True, metavar="DIR", help="folder of the Mixamo clips")
    parser.add_argument("--out", default="runs/learned", metavar="DIR", help="folder of results")
    parser.add_argument("--jobs", type=int, default=defaults.jobs(), metavar="N", help="processes")
    options = parser.parse_args()
    common = {"metrics": METRICS, "out": options.out, "jobs": options.jobs, "timed": False}
    sets = {
        "puppets": {"dataset": defaults.DATASET},
        "mixamo": {"dataset": "mixamo", "root": options.root, "clips": unseen(options.root)},
    }
    results = {
        name: rb.run(_trained(METHODS), splits=splits, **sets[name], **common)
        for name, splits in SPLITS.items()
    }
    few = rb.run(
        _trained((*OF_KNOWN_STRUCTURES, *BESIDE)), splits=SPLITS["puppets"], **sets["puppets"], **common
    )
    alone = [name for name in METHODS if "+" not in name and name != STILL]
    write(results, own_body.measured(_trained(alone), options.root), few)
    curves(cards(), PROJECT / "results" / "learned_curves.png")


def unseen(root: str) -> list[str]:
    """The Mixamo clips by which nothing was chosen."""
    infos = registry.create("datasets", Spec("mixamo", {"root": root})).cases("retarget", "cross")
    return sorted({info.clip for info in infos if own_body.is_unseen(info.clip)})


def cards() -> dict[str, Any]:
    """Method -> the card of its weights."""
    alone = (name for name in (*METHODS, *OF_KNOWN_STRUCTURES) if "+" not in name)
    cards = {name: getattr(registry.create("methods", name), "weights_card", None) for name in alone}
    return {name: card for name, card in cards.items() if card}


def _trained(methods: Iterable[str]) -> list[str]:
    built = {name: registry.create("methods", name) for name in methods}
    return [name for name, each in built.items() if not getattr(each, "untrained", "")]


def built(body: rb.Character) -> tuple[str, str]:
    """A body's row of ``methods/known_bodies.csv``."""
    build = known.Build.of(body)
    return build.topology, " ".join(f"{share:.6g}" for share in build.shares)


def write(results: dict[str, rb.Results], found: own_body.Found, known_structures: rb.Results) -> None:
    """The files, from results by the names of ``SPLITS``."""
    rows = [each for name, bodies in BODIES.items() for each in comparisons(results[name], bodies)]
    write_csv(known.shipped(), known.FIELDS, [dataclasses.astuple(row) for row in rows])
    bodies = registry.create("datasets", defaults.DATASET).characters().values()
    write_csv(known.shipped("known_bodies.csv"), known.BUILD_FIELDS, map(built, bodies))
    text = page(results, found, known_structures)
    write_text(PROJECT / "results" / "learned.md", text)
    print(text)


if __name__ == "__main__":
    main()
