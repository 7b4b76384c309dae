"""A submission folder from results that lie in a folder of runs."""

from __future__ import annotations

import shutil
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.evaluation.set_metrics.files import values_path
from retarget_bench.exchange.submission import cost
from retarget_bench.exchange.submission.manifest import CARD, CARD_SECTIONS, ROWS, write
from retarget_bench.files import write_text
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.store import ResultPaths

FILL_IN = "TO BE FILLED IN"
"""What stands where only the author knows; the check finds it."""


def make(folder: Path, runs: Path, label: str) -> list[str]:
    """Write a submission of one method into a new folder; gives what is left to fill in.

    Raises BenchError where there are no such results, they are of several data sets, or the folder is not
    empty.
    """
    places = _places(runs, label)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchError(f"{folder} is not an empty folder; name a new one")
    header = store.read_header(places[0].header)
    data = Spec(header.dataset.name, header.dataset.parameters)
    about = header.method
    measured = cost.measure(Spec.parse(about.label), data) if about.version else None
    for place in places:
        _copy(place, folder / ROWS)
    card = {
        "label": label,
        "version": about.version or FILL_IN,
        "authors": [FILL_IN],
        "licence": FILL_IN,
        "summary": about.summary or FILL_IN,
        "contact": "",
        "paper": "",
        "code": "",
        "sees": list(about.privileged),
    }
    costs = {
        "parameters": 0,
        "training_hours": 0.0,
        "hardware": "",
        "peak_memory_mb": round(measured.peak_memory_mb, 1) if measured else 0.0,
        "lookahead_frames": "clip",
        "frames_per_second": float(f"{measured.frames_per_second:.3g}") if measured else 1.0,
    }
    write(folder, {"method": card, "data": {"dataset": str(data), "trained_on": []}, "cost": costs})
    sections = "\n".join(f"## {name}\n\n{FILL_IN}\n" for name in CARD_SECTIONS)
    write_text(folder / CARD, f"# {label}\n\n{sections}")
    left = ["method.authors, method.licence", f"{CARD}: {', '.join(CARD_SECTIONS)}"]
    left.append("cost.parameters, cost.training_hours, cost.lookahead_frames, data.trained_on")
    return left


def _places(runs: Path, label: str) -> list[ResultPaths]:
    found = store.find_results(runs)
    labels = {place: store.read_header(place.header).method.label for place in found}
    mine = [place for place in found if labels[place] == label]
    if not mine:
        known = ", ".join(sorted(set(labels.values()))) or "none"
        raise BenchError(f"{runs} has no results of {label!r}; there are {known}")
    datasets = {place.dataset for place in mine}
    if len(datasets) > 1:
        raise BenchError(
            f"{runs} has results of {label} on several data sets: {', '.join(sorted(datasets))}. A "
            "submission is of one; give a folder with one of them"
        )
    return mine


def _copy(place: ResultPaths, root: Path) -> None:
    there = ResultPaths(root, place.dataset, place.task, place.split, place.method)
    there.folder.mkdir(parents=True, exist_ok=True)
    for ours, theirs in (
        (place.rows, there.rows),
        (place.arrays, there.arrays),
        (place.timing, there.timing),
        (values_path(place), values_path(there)),
        *((path, there.folder / path.name) for path in place.folder.glob("cases*.csv")),
        (place.header, there.header),
    ):
        if ours.exists():
            shutil.copyfile(ours, theirs)
