"""The methods that papers compare with each other, under one protocol, with shipped weights.

    python benchmarks/peers.py --mixamo PATH/TO/mixamo --pairs PATH/TO/same_pairs

Computes what is missing or outdated in --out (runs/peers) and writes ``results/peers.md``. --pairs: see
``same_pairs.py``. --same, --r2et: weights of the papers' authors.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import retarget_bench as rb
from retarget_bench import defaults
from retarget_bench.files import write_text
from retarget_bench.plugins import registry
from retarget_bench.results import store
from retarget_bench.results.header import MethodInfo
from retarget_bench.tables.published.ours import whose

PROJECT = Path(__file__).parents[1]
PAGE = PROJECT / "results" / "peers.md"
PAIRS = PROJECT / "benchmarks" / "same_pairs.py"
PEERS = {
    "nkn": "NKN",
    "nkn_cross": "NKN\\*",
    "pmnet": "PMnet",
    "pmnet_cross": "PMnet\\*",
    "san": "SAN",
    "r2et": "R2ET",
    "smrm": "SMRM",
    "pan": "PAN",
    "humot": "HuMoT",
    "same": "SAME",
    "copy_rotations": "copied rotations",
    "ik": "ik",
}
"""Our plug-in -> what papers call it; a star: with networks for each structure, as in PAN's tables."""
FEW_STRUCTURES = ("nkn_cross", "pmnet_cross", "san")
"""Methods that answer on the structures of their training alone: others are shown beside them on the
same cases."""
MPJPE, FITTED, ALIGNED, RECALL = "mpjpe_h.world", "mpjpe_h.path_fitted", "mpjpe_h.root", "contact_recall"
NAMES = {MPJPE: "MPJPE", FITTED: "path fitted", ALIGNED: "root-aligned", RECALL: "contact recall"}
METRICS = ("position", "contact", "path_fitted")
SPLITS = {
    "puppets": ("self", "intra", "cross"),
    "mixamo": ("intra", "cross"),
    "pairs": ("cross",),
}


def training(method: str) -> str:
    """The cost of shipped weights: minutes of the last run, hours of motion."""
    shipped = PROJECT / "methods" / method / "weights" / "puppets.json"
    if not shipped.exists():
        return "none"
    card = json.loads(shipped.read_text(encoding="utf-8"))
    begun = " + earlier" if card.get("init") else ""
    return f"{card['seconds'] / 60:.0f} min{begun}, {card['data']['hours']:.3g} h"


def same_cases(frame: Any, title: str) -> Any:
    """The rows of a table. Raises SystemExit where they are not over the same cases in each column."""
    for (split, value), rows in frame.groupby(["split", "value_id"]):
        if rows.cases.nunique() > 1:
            counts = ", ".join(f"{row.method} {row.cases:g}" for row in rows.itertuples())
            raise SystemExit(f"{title}, {split}, {value}: over different cases ({counts})")
    return frame


def authors(same: str | None, r2et: str | None) -> list[str]:
    """Methods with the weights of their papers' authors: with our path, and as published."""
    return [
        *([f"same[weights={same}]", f"same[weights={same},path=integrated]"] if same else []),
        *([f"r2et[weights={r2et}]", f"r2et[weights={r2et},size=published]"] if r2et else []),
    ]


def methods_of(results: rb.Results) -> dict[str, MethodInfo]:
    """Label -> what results say of a method."""
    headers = [store.read_header(place.header) for place in results.places]
    return {header.method.label: header.method for header in headers}


def named(method: MethodInfo) -> str:
    """A method as papers call it, and in brackets whose weights it has and how it is changed."""
    settings = [f"{name}={value}" for name, value in method.parameters.items() if name != "weights"]
    posts = "".join(f"+{post['name']}" for post in method.posts)
    note = ", ".join(filter(None, [whose(method), *settings])).replace("_", "\\_")
    return PEERS.get(method.name, method.name.replace("_", "\\_")) + posts + (f" ({note})" if note else "")


def table(title: str, about: str, results: rb.Results) -> Iterator[str]:
    """Lines of Markdown: MPJPE, the same with fitted paths where pairs have enough clips, root-aligned and
    contact recall by split, with intervals."""
    frame = same_cases(results.table(list(NAMES)).frame, title)
    rows = {(row.method, row.split, row.value_id): row for row in frame.itertuples()}
    order, infos = list(PEERS), methods_of(results)
    methods = sorted(infos, key=lambda label: (order.index(infos[label].name), label))
    splits = list(dict.fromkeys(row.split for row in frame.itertuples()))
    sizes = {
        row.split: f"{row.split} {row.cases:g} cases of {row.clips:g} clips" for row in frame.itertuples()
    }
    columns = [
        (split, value)
        for split in splits
        for value in NAMES
        if any((method, split, value) in rows for method in methods)
    ]
    yield from ("", f"## {title}", "", f"{about} {'; '.join(sizes.values())}.", "")
    yield f"| method | trained | {' | '.join(f'{split}, {NAMES[value]}' for split, value in columns)} |"
    yield "|---|---|" + "---:|" * len(columns)
    for method in methods:
        if any((method, split, MPJPE) in rows for split in splits):
            cells = " | ".join(cell(rows.get((method, *column))) for column in columns)
            info = infos[method]
            trained = "by its authors" if "authors" in whose(info) else training(info.name)
            yield f"| {named(info)} | {trained} | {cells} |"


def cell(row: Any, interval: bool = True) -> str:
    """A number with its interval, where there is one."""
    if row is None or row.value != row.value:
        return "n/a"
    has_interval = interval and row.low is not None and row.low == row.low
    return f"{row.value:.2f}" + (f" [{row.low:.2f}, {row.high:.2f}]" if has_interval else "")


Beside = dict[tuple[str, str], tuple[float, str, int]]
"""Method and split -> MPJPE, how far it is from SAN's, number of cases."""


def on_few(results: rb.Results, own: str = FEW_STRUCTURES[-1]) -> Beside:
    """Every method on the cases that ``own`` answered, which the others of few structures answer too."""
    cells: Beside = {}
    for method in PEERS:
        for split in results.compare(method, own, MPJPE).splits if method != own else ():
            (one,) = split.differences
            ends = f" [{one.interval.low:+.2f}, {one.interval.high:+.2f}]" if one.interval else ""
            cells[method, split.split] = one.first, f"{one.first - one.second:+.2f}{ends}", one.cases
            cells[own, split.split] = one.second, "", one.cases
    return cells


def beside_few(beside: Beside) -> Iterator[str]:
    """Lines of Markdown."""
    splits = SPLITS["puppets"]
    sizes = "; ".join(
        f"{split} {' or '.join(str(n) for n in sorted({beside[m, split][2] for m in PEERS}))} cases"
        for split in splits
    )
    yield from ("", "## Puppets of the structures that NKN\\*, PMnet\\* and SAN know", "")
    yield f"MPJPE on the cases that SAN answered ({sizes}), and below zero where it is less than SAN's."
    heads = " | ".join(f"{split} | minus SAN" for split in splits)
    yield from ("", f"| method | trained | {heads} |", "|---|---|" + "---:|" * (2 * len(splits)))
    for method, label in PEERS.items():
        cells = " | ".join(f"{beside[method, s][0]:.2f} | {beside[method, s][1]}" for s in splits)
        yield f"| {label} | {training(method)} | {cells} |"


def page(results: dict[str, rb.Results], few: rb.Results) -> str:
    """The page."""
    out = [
        "# Who compared with whom, under one protocol",
        "",
        "    python benchmarks/peers.py --mixamo DIR --pairs DIR --same DIR --r2et FILE",
        "",
        "The methods of the papers' tables, each rebuilt here and trained on motion of puppets and of CMU "
        "(none of the pairs, and none of Mixamo), as shipped, but for rows of "
        "authors' weights, which may have seen any of it: "
        "`bench info METHOD` shows the cards of the weights. MPJPE and root-aligned MPJPE in % of height, "
        "contact recall as a share; 95 % intervals over clips in brackets, where there are ten clips. Each "
        "table is over the same cases for all its rows. *Trained*: time of the last run on one core, and "
        "amount of motion. NKN\\*, PMnet\\* and SAN have networks for each structure and know those of "
        "their training alone: elsewhere they have tables of their own, or no number. None of these "
        "numbers says how good a method of a paper is at its best. *own weights*: trained here, with the "
        "part of their papers' windows that they have seen, by frames, where that is known; *authors' "
        "weights*: those "
        "that the paper's authors published, which are not shipped.",
    ]
    out += table("Puppets", "Held-out bodies and clips;", results["puppets"])
    out += beside_few(on_few(few))
    out += table("Mixamo", "Characters and clips that none of our trainings has seen;", results["mixamo"])
    out += table(
        "SAME's pairs",
        "References by MotionBuilder on random skeletons, no copied rotations; each pair both ways, "
        "without the rest pose in the first frame of each file;",
        results["pairs"],
    )
    return "\n".join(out) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mixamo", required=True, metavar="DIR", help="folder of the Mixamo clips")
    parser.add_argument("--pairs", required=True, metavar="DIR", help="folder with pair.txt")
    parser.add_argument("--same", metavar="DIR", help="folder of the weights of SAME's authors")
    parser.add_argument("--r2et", metavar="FILE", help="weights of R2ET's authors")
    parser.add_argument("--out", default="runs/peers", metavar="DIR", help="folder of results")
    parser.add_argument("--jobs", type=int, default=defaults.jobs(), metavar="N", help="processes")
    options = parser.parse_args()
    common = {"metrics": METRICS, "out": options.out, "jobs": options.jobs, "timed": False}
    every = [name for name in PEERS if name not in FEW_STRUCTURES]
    _trained(PEERS)
    sets = {
        "puppets": {"dataset": defaults.DATASET},
        "mixamo": {"dataset": "mixamo", "root": options.mixamo},
        "pairs": {"dataset": str(PAIRS), "root": options.pairs},
    }
    every += authors(options.same, options.r2et)
    results = {
        name: rb.run(every, splits=splits, **sets[name], **common) for name, splits in SPLITS.items()
    }
    few = rb.run(list(PEERS), splits=SPLITS["puppets"], **sets["puppets"], **common)
    write_text(PAGE, text := page(results, few))
    print(text)


def _trained(methods: Iterable[str]) -> None:
    """Raises SystemExit for a method without weights: the page would lack it."""
    for name in methods:
        if reason := getattr(registry.create("methods", name), "untrained", ""):
            raise SystemExit(reason)


if __name__ == "__main__":
    main()
