"""The methods that papers compare with each other, under one protocol, with shipped weights.

    python tests/benchmarks/peers.py --mixamo PATH/TO/mixamo --pairs PATH/TO/same_pairs

Computes what is missing or outdated in --out (runs/peers) and writes ``results/peers.md``. --pairs: a
folder with ``pair.txt``, whose lines name a source and the file of its answer by an animator's tool.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import retarget_bench as rb
from retarget_bench import defaults
from retarget_bench.files import write_text
from retarget_bench.plugins import registry

PROJECT = Path(__file__).parents[2]
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
    "copy_rotations": "copy",
    "ik": "ik",
}
"""Our plug-in -> what papers call it; a star: with networks for each structure, as in PAN's tables."""
FEW_STRUCTURES = ("nkn_cross", "pmnet_cross", "san")
"""They know the structures of their training alone: others are shown beside them on the same cases."""
MPJPE, ALIGNED, RECALL = "mpjpe_h.world", "mpjpe_h.root", "plant_recall"
METRICS = ("position", "plant")
SPLITS = {"puppets": ("self", "intra", "cross"), "mixamo": ("intra", "cross"), "pairs": ("cross",)}


def training(method: str) -> str:
    """What the shipped weights cost: minutes of the last run, and hours of motion."""
    path = PROJECT / "methods" / method / "weights" / "puppets.json"
    if not path.exists():
        return "none"
    card = json.loads(path.read_text(encoding="utf-8"))
    begun = " + earlier" if card.get("init") else ""
    return f"{card['seconds'] / 60:.0f} min{begun}, {card['data']['hours']:.3g} h"


def table(title: str, about: str, results: rb.Results, methods: Iterable[str]) -> Iterator[str]:
    """Lines of Markdown: MPJPE, root-aligned and contact recall by split, with intervals."""
    frame = results.table([MPJPE, ALIGNED, RECALL]).frame
    rows = {(row.method, row.split, row.value_id): row for row in frame.itertuples()}
    splits = list(dict.fromkeys(row.split for row in frame.itertuples()))
    sizes = {
        row.split: f"{row.split} {row.cases:g} cases of {row.clips:g} clips" for row in frame.itertuples()
    }
    columns = [
        (split, value)
        for split in splits
        for value in (MPJPE, ALIGNED, RECALL)
        if any((method, split, value) in rows for method in methods)
    ]
    names = {MPJPE: "MPJPE", ALIGNED: "root-aligned", RECALL: "contact recall"}
    yield from ("", f"## {title}", "", f"{about} {'; '.join(sizes.values())}.", "")
    yield f"| method | trained | {' | '.join(f'{split}, {names[value]}' for split, value in columns)} |"
    yield "|---|---|" + "---:|" * len(columns)
    for method in methods:
        if any((method, split, MPJPE) in rows for split in splits):
            cells = " | ".join(_cell(rows.get((method, *column))) for column in columns)
            yield f"| {PEERS.get(method, method)} | {training(method)} | {cells} |"


def _cell(row: Any) -> str:
    if row is None or row.value != row.value:
        return "n/a"
    return f"{row.value:.2f}" + (f" [{row.low:.2f}, {row.high:.2f}]" if row.low == row.low else "")


def paired_folder(pairs: Path, folder: Path) -> Path:
    """The pairs as ``source-k/k.bvh`` and ``answer-k/k.bvh``."""
    for number, line in enumerate((pairs / "pair.txt").read_text().splitlines()):
        *_, source, answer = (part.strip() for part in line.split(","))
        for name, file in (("source", source), ("answer", answer)):
            there = pairs / file.removeprefix("sample/motion/bvh/")
            place = folder / f"{name}-{number}" / f"{number}.bvh"
            place.parent.mkdir(parents=True)
            shutil.copyfile(there, place)
    return folder


def page(results: dict[str, rb.Results], few: rb.Results) -> str:
    every = [name for name in PEERS if name not in FEW_STRUCTURES]
    out = [
        "# Who compared with whom, under one protocol",
        "",
        "    python tests/benchmarks/peers.py --mixamo PATH/TO/mixamo --pairs PATH/TO/same_pairs",
        "",
        "The methods of the papers' tables, each rebuilt here and trained on generated motion of puppets "
        "(no Mixamo, no motion of the pairs), as shipped: `bench info METHOD` shows the cards of the "
        "weights. MPJPE and root-aligned MPJPE in % of height, contact recall as a share; 95 % intervals "
        "over clips in brackets. Each table is over the cases that all its rows answered. *Trained*: time "
        "on one core and amount of motion. NKN\\*, PMnet\\* and SAN have networks for each structure and "
        "know those of their training alone; they have a table of their own, beside others on the same "
        "cases. None of these numbers says how good a method of a paper is at its best: their authors "
        "trained for days.",
    ]
    out += table("Puppets", "Held-out bodies and clips;", results["puppets"], every)
    out += table("Puppets of known structures", "Fewer cases;", few, list(PEERS))
    out += table("Mixamo", "Characters and clips that none of them has seen;", results["mixamo"], every)
    out += table(
        "SAME's pairs",
        "References by MotionBuilder on random skeletons, which are no copied rotations; without contacts;",
        results["pairs"],
        every,
    )
    return "\n".join(out) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--mixamo", required=True, metavar="DIR", help="folder of the Mixamo clips")
    parser.add_argument("--pairs", required=True, metavar="DIR", help="folder with pair.txt")
    parser.add_argument("--out", default="runs/peers", metavar="DIR", help="folder of results")
    parser.add_argument("--jobs", type=int, metavar="N", help="number of processes")
    given = parser.parse_args()
    common = {"metrics": METRICS, "out": given.out, "workers": given.jobs, "timed": False}
    every = [name for name in PEERS if name not in FEW_STRUCTURES]
    _trained(PEERS)
    with TemporaryDirectory() as temporary:
        sets = {
            "puppets": {"dataset": defaults.DATASET},
            "mixamo": {"dataset": "mixamo", "root": given.mixamo},
            "pairs": {"dataset": "folder", "root": str(paired_folder(Path(given.pairs), Path(temporary)))},
        }
        results = {
            name: rb.run(every, splits=splits, **sets[name], **common) for name, splits in SPLITS.items()
        }
        few = rb.run(list(PEERS), splits=SPLITS["puppets"], **sets["puppets"], **common)
    write_text(PROJECT / "results" / "peers.md", text := page(results, few))
    print(text)


def _trained(methods: Iterable[str]) -> None:
    """Raises SystemExit for a method without weights: the page would lack it."""
    for name in methods:
        if reason := getattr(registry.create("methods", name), "untrained", ""):
            raise SystemExit(reason)


if __name__ == "__main__":
    main()
