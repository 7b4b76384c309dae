"""A submission folder from the results of runs, with the memory and speed of the method measured."""

import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from retarget_bench.analysis.selection import label_of, of_dataset
from retarget_bench.api import MethodCard, optional
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import timing
from retarget_bench.evaluation.predict import context_for, predict
from retarget_bench.evaluation.timing import spread
from retarget_bench.exchange.submission.manifest import CARD, CARD_SECTIONS, ROWS, write
from retarget_bench.files import write_text
from retarget_bench.parallel import carried_out
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import dataset_names, store
from retarget_bench.results.store import ResultPaths, case_seed

FILL_IN = "TO BE FILLED IN"
"""What stands where only the author knows; the check finds it."""


def make(folder: Path, runs: Path, name: str, data_set: str = "") -> list[str]:
    """Write a submission of one method into a new folder; gives what is left to fill in.

    name: the method, however it is written. data_set: only its results on this data set.
    Raises BenchError where there are no such results, they are of several data sets, or the folder is not
    empty.
    """
    places = _places(runs, name, data_set)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchError(f"{folder} is not an empty folder; name a new one")
    header = store.read_header(places[0].header)
    data = Spec(header.dataset.name, header.dataset.parameters)
    about, label = header.method, header.method.label
    known = timing.rate(timing.read(places[-1]))
    memory, rate = _measured(Spec.parse(about.label), data, known) if about.version else (0.0, 1.0)
    for place in places:
        there = replace(place, root=folder / ROWS)
        there.folder.mkdir(parents=True, exist_ok=True)
        for ours, theirs in (
            (place.rows, there.rows),
            (place.arrays, there.arrays),
            (place.large, there.large),
            (place.timing, there.timing),
            (place.sets, there.sets),
            *((path, there.folder / path.name) for path in place.folder.glob("cases*.csv")),
            (place.header, there.header),
        ):
            if ours.exists():
                shutil.copyfile(ours, theirs)
    here = not about.external
    said = (
        optional.method_card(bound.method(Spec.parse(label).here).built) if here else MethodCard("", "", "")
    )
    card = {
        "label": label,
        "version": about.version or FILL_IN,
        "authors": [FILL_IN],
        "licence": said.licence or FILL_IN,
        "summary": about.summary or FILL_IN,
        "contact": "",
        "paper": said.paper,
        "code": "",
        "sees": list(about.privileged),
    }
    costs = {
        "parameters": 0,
        "training_hours": 0.0,
        "hardware": "",
        "peak_memory_mb": memory,
        "lookahead_frames": "clip",
        "frames_per_second": rate,
    }
    write(folder, {"method": card, "data": {"dataset": str(data), "trained_on": []}, "cost": costs})
    sections = "\n".join(f"## {name}\n\n{FILL_IN}\n" for name in CARD_SECTIONS)
    write_text(folder / CARD, f"# {label}\n\n{sections}")
    return [
        "method.authors" if said.licence else "method.authors, method.licence",
        f"{CARD}: {', '.join(CARD_SECTIONS)}",
        "cost.parameters, cost.training_hours, cost.lookahead_frames, data.trained_on",
    ]


def _places(runs: Path, name: str, data_set: str) -> list[ResultPaths]:
    """The results of a method on one data set. Raises BenchError that says which option names others."""
    headers = dataset_names.headers(store.find_results(runs))
    labels = {place: header.method.label for place, header in headers.items()}
    if (label := label_of(name, set(labels.values()))) is None:
        known = ", ".join(sorted(set(labels.values()))) or "none"
        raise BenchError(
            f"{runs} has no results of {name!r}; there are {known}. --results names another folder"
        )
    mine = [place for place in labels if labels[place] == label]
    mine = of_dataset(mine, data_set) if data_set else mine
    if len(names := dataset_names.listed({place: headers[place] for place in mine})) > 1:
        raise BenchError(
            f"{runs} has results of {label} on several data sets: {', '.join(names)}. A submission is of "
            "one; name it: -d"
        )
    if begun := [place.split for place in mine if not place.complete]:
        raise BenchError(
            f"the results of {label} on {', '.join(begun)} in {runs} are not complete; bench run without "
            "--clips and --limit does the rest, and then they can be submitted"
        )
    return mine


# -------------------------------------------------------------------------------------------- cost
def _measured(asked: Spec, data: Spec, known: float | None) -> tuple[float, float]:
    """(megabytes by which a process grows, frames per second) of a method on a few cases.

    known: its frames per second where its results have them, which are then taken.
    Raises BenchError where the method answers none of them.
    """
    (done,) = carried_out(of_process, [(registry.files(), asked, data, known)], 1)
    if done.error or done.result is None:
        raise BenchError(f"the cost of {asked} cannot be measured: {done.error or 'it answers no case'}")
    megabytes, rate = done.result
    return round(megabytes, 1), float(f"{rate:.3g}")


def of_process(job: tuple[Any, Spec, Spec, float | None]) -> tuple[float, float] | None:
    """(megabytes, frames per second), or None where no case is answered."""
    plugins, asked, spec, known = job
    registry.know_files(plugins)
    data = bound.dataset(spec).built
    infos = [info for split in data.card.splits for info in data.cases("retarget", split)]
    cases = [(info, data.load(info)) for info in spread(infos)]
    before = _peak_mb()
    built = bound.method(asked).built
    frames, begun = 0, time.perf_counter()
    for info, case in cases:
        outcome = predict(built, case, context_for(built, data, case, case_seed(0, str(asked), info.id)))
        frames += case.source.frames if outcome.prediction is not None else 0
    rate = frames / (time.perf_counter() - begun) if known is None else known
    return (_peak_mb() - before, rate) if rate else None


def _peak_mb() -> float:
    """The most memory that this process ever held, in megabytes; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)
