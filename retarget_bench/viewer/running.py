"""Results of a run that is still going on: what its journals and predictions say so far."""

from __future__ import annotations

import json
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation import plan
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import CaseResult, ResultPaths
from retarget_bench.viewer.stored import Told, told


def going_on(root: Path, task: str = "retarget") -> list[ResultPaths]:
    """Every result under a root that is being made and was never finished before, sorted."""
    found = []
    for journal in sorted(root.glob(f"*/{task}/*/*.journal")):
        dataset, folder, split = journal.relative_to(root).parts[:3]
        place = ResultPaths(root, dataset, folder, split, journal.stem)
        if not place.header.exists():
            found.append(place)
    return found


def told_so_far(place: ResultPaths, dataset: Spec | None = None, root: str | None = None) -> Told:
    """What is known of results that are being made; their values are those of finished cases.

    dataset: None: the one that finished results beside them name, or the usual one. root: where its files
    lie, if not as usual.
    Raises BenchError where nobody can tell which data set it is, FileError for a journal that is none.
    """
    keys, entries = _journal(place.journal)
    spec = dataset or _neighbours(place) or _usual(place)
    if spec is None:
        raise BenchError(
            f"{place.journal}: nothing of this run is finished yet, so nobody can tell its data set; say "
            "it by --data"
        )
    here = spec if root is None else spec.with_parameters(root=root)
    data = plan.dataset(registry.canonical("datasets", here), place.task)
    infos = data.cases(Spec.parse(place.task).name, place.split)
    return Told(
        place=place,
        label=place.method,
        dataset=spec,
        task=place.task,
        content=data.content,
        key=keys.get("prediction_key", ""),
        entries=entries,
        cases={info.id: info for info in infos if info.id in entries},
    )


def _journal(path: Path) -> tuple[dict[str, str], dict[str, CaseResult]]:
    """What a journal says; a last line that is being written is left out."""
    try:
        head, *lines = path.read_bytes().split(b"\n")[:-1]
        keys = json.loads(head)
        entries = [CaseResult(**json.loads(line)) for line in lines]
        return {name: str(value) for name, value in keys.items()}, {each.case: each for each in entries}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        raise FileError(path, f"is no journal of a run ({error})") from error


def _neighbours(place: ResultPaths) -> Spec | None:
    """The data set that finished results in the same folder name."""
    for header in sorted((place.root / place.dataset).glob("*/*/*.json")):
        task, split = header.parts[-3:-1]
        try:
            return told(ResultPaths(place.root, place.dataset, task, split, header.stem)).dataset
        except FileError:
            continue
    return None


def _usual(place: ResultPaths) -> Spec | None:
    """The usual data set, or one without parameters, where results of it go by this folder's name."""
    known = {entry.name for entry in registry.names("datasets")}
    for spec in (Spec.parse(defaults.DATASET), Spec(place.dataset)):
        if spec.name in known:
            spec = registry.canonical("datasets", spec)
            if plan.dataset_slug(spec) == place.dataset:
                return spec
    return None
