"""Checks of a submission: complete, consistent, and of the right data."""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from retarget_bench.api import TASKS, Dataset, optional
from retarget_bench.errors import BenchError, FileError
from retarget_bench.evaluation.plan import Plan, dataset, metric_versions, metrics
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.timing import spread
from retarget_bench.evaluation.worker import elsewhere
from retarget_bench.exchange.submission.making import FILL_IN
from retarget_bench.exchange.submission.manifest import (
    CARD,
    CARD_SECTIONS,
    PREDICTIONS,
    ROWS,
    Manifest,
    read,
)
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.header import STATUSES, ResultHeader
from retarget_bench.results.store import ResultPaths, Results
from retarget_bench.tables.model import count

CLOSE = 1e-6
"""Relative difference up to which a value that is scored again is the one in the rows."""


@dataclass(frozen=True)
class Finding:
    """error: the submission cannot be taken. warning: it can, with this said of it."""

    level: Literal["error", "warning"]
    text: str

    def __str__(self) -> str:
        return f"{self.level}: {self.text}"


def check(folder: Path) -> list[Finding]:
    """Everything that is wrong with a submission; empty where nothing is.

    A folder with predictions and no rows is scored first, which writes its rows.
    Raises FileError where there is no folder.
    """
    if not folder.is_dir():
        raise FileError(folder, "is no folder; a submission is one (bench submit --make writes it)")
    found = list(_card(folder))
    try:
        manifest = read(folder)
    except FileError as error:
        return [Finding("error", str(error)), *found]
    found += _filled_in(folder)
    try:
        data = dataset(registry.canonical("datasets", Spec.parse(manifest.data.dataset)))
    except BenchError as error:
        return [*found, Finding("error", f"data.dataset: {error}")]
    places = _places(folder, manifest)
    if isinstance(places, Finding):
        return [*found, places]
    for listed in _by_split(places):
        found += _seeds(listed)
        for place in listed:
            found += _rows(place, manifest, data, first=place == listed[0])
    if missing := [split for split in data.card.splits if split not in {place.split for place in places}]:
        found.append(Finding("warning", f"no rows of {', '.join(missing)}: the data set has such cases"))
    return found


# ------------------------------------------------------------------------------------- what is written
def _filled_in(folder: Path) -> Iterator[Finding]:
    for line, text in enumerate((folder / "submission.toml").read_text(encoding="utf-8").splitlines(), 1):
        if FILL_IN in text:
            yield Finding("error", f"{folder / 'submission.toml'}, line {line}: is still to be filled in")


def _card(folder: Path) -> Iterator[Finding]:
    try:
        text = (folder / CARD).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        yield Finding("error", f"{folder / CARD} cannot be read ({error}); it says what the method is")
        return
    parts = re.split(r"(?m)^##\s+(.+?)\s*$", text)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    for name in CARD_SECTIONS:
        body = sections.get(name, "").strip()
        if not body or FILL_IN in body:
            yield Finding("error", f"{folder / CARD}: the section '## {name}' is missing or not filled in")


# ------------------------------------------------------------------------------------- what was computed
def _places(folder: Path, manifest: Manifest) -> list[ResultPaths] | Finding:
    """The results in the folder; those of its predictions are made first where there are no rows."""
    places = store.find_results(folder / ROWS)
    if not places and (folder / PREDICTIONS).is_dir():
        try:
            _score(folder, manifest)
        except BenchError as error:
            return Finding("error", f"the predictions cannot be scored: {error}")
        places = store.find_results(folder / ROWS)
    if not places:
        return Finding("error", f"{folder} holds neither {ROWS}/ nor {PREDICTIONS}/")
    return places


def _score(folder: Path, manifest: Manifest) -> None:
    from retarget_bench.evaluation.runner import run

    spec = registry.canonical("datasets", Spec.parse(manifest.data.dataset))
    working, _ = registry.working("metrics")
    plan = Plan(
        methods=(Spec(manifest.method.label),),
        datasets=(spec,),
        metrics=tuple(name for name, each in working.items() if TASKS[0] in optional.metric_tasks(each)),
        root=folder / ROWS,
        stage="score",
        external=folder / PREDICTIONS,
    )
    run(plan, lambda *_: None)


def _by_split(places: Sequence[ResultPaths]) -> list[list[ResultPaths]]:
    """The results of each split, by seed."""
    splits: dict[str, list[ResultPaths]] = {}
    for place in sorted(places, key=_seed):
        splits.setdefault(place.split, []).append(place)
    return list(splits.values())


def _seed(place: ResultPaths) -> int:
    """The seed that results were made with; 0 where they do not say."""
    try:
        seeds = store.read_header_facts(place.header).get("seeds")
    except FileError:
        return 0
    return seeds[0] if isinstance(seeds, list) and seeds and isinstance(seeds[0], int) else 0


def _seeds(places: Sequence[ResultPaths]) -> Iterator[Finding]:
    """Results of one split under several seeds: each seed once."""
    for one, other in pairwise(places):
        if _seed(one) == _seed(other):
            yield Finding(
                "error",
                f"{one.task} {one.split}: {one.method} and {other.method} are both of seed {_seed(one)}; "
                "hand in one result per seed",
            )


def _rows(place: ResultPaths, manifest: Manifest, data: Dataset, *, first: bool) -> Iterator[Finding]:
    """first: whether these are the rows of the first seed, which predictions belong to."""
    where = f"{place.task} {place.split}" + ("" if first else f", seed {_seed(place)}")
    try:
        if wrong := mistakes(store.read_header_facts(place.header)):
            yield Finding("error", f"{where}: the header is not one: {'; '.join(wrong[:3])}")
            return
        results = store.read_results(place)
    except FileError as error:
        yield Finding("error", str(error))
        return
    found = {value for entry in results.entries for value in entry.values}
    if strange := sorted(found - results.header.values.keys()):
        yield Finding("error", f"{where}: the header does not say what {', '.join(strange[:3])} is")
        return
    yield from _header(where, results, manifest)
    yield from _cases(where, results, data)
    yield from _versions(where, results)
    if first:
        yield from _again(where, results, data, place.root.parent / PREDICTIONS)


@cache
def _headers() -> TypeAdapter[ResultHeader]:
    return TypeAdapter(ResultHeader)


def mistakes(facts: dict[str, Any]) -> list[str]:
    """Where a header is not what it must be: ``method.privileged: Field required``."""
    try:
        # of JSON, since a strict check of Python's objects takes no mapping for a dataclass
        header = _headers().validate_json(json.dumps(facts), strict=True)
    except ValidationError as error:
        return [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors()]
    return [
        f"problems.{number}.status: Input should be one of {', '.join(STATUSES[1:])}"
        for number, each in enumerate(header.problems)
        if each.status not in STATUSES[1:]
    ]


def _header(where: str, results: Results, manifest: Manifest) -> Iterator[Finding]:
    method = results.header.method
    if method.label != manifest.method.label:
        yield Finding(
            "error", f"{where}: the rows are of {method.label}, the manifest of {manifest.method.label}"
        )
    if unsaid := sorted(set(method.privileged) - set(manifest.method.sees)):
        yield Finding(
            "error", f"{where}: the method is given {', '.join(unsaid)}, which method.sees does not say"
        )
    if method.control:
        yield Finding("error", f"{where}: a control is no submission")
    name = Spec.parse(manifest.data.dataset).name
    if results.header.dataset.name != name:
        yield Finding("error", f"{where}: the rows are on {results.header.dataset.name}, not {name}")


def _cases(where: str, results: Results, data: Dataset) -> Iterator[Finding]:
    counts = results.header.counts
    try:
        wanted = {info.id for info in data.cases(results.paths.task, results.paths.split)}
    except BenchError as error:
        yield Finding("warning", f"{where}: the case list cannot be compared with the data set's ({error})")
        return
    if results.header.dataset.content != data.content:
        yield Finding(
            "error",
            f"{where}: made on other data ({results.header.dataset.content}) than {data.label} has "
            f"here ({data.content})",
        )
    listed = set(results.cases)
    for cases, what in ((wanted - listed, "missing"), (listed - wanted, "unknown to the data set")):
        if cases:
            yield Finding("error", f"{where}: {count(len(cases), 'case')} {what}, first {min(cases)}")
    status = {entry.case: entry.status for entry in results.entries}
    if silent := sorted(listed - status.keys()):
        yield Finding(
            "error", f"{where}: {len(silent)} cases have neither rows nor a reason, first {silent[0]}"
        )
    answered = sum(each == "ok" for each in status.values())
    if (counts.asked, counts.ok) != (len(listed), answered):
        yield Finding(
            "error",
            f"{where}: the header says {counts.ok} of {counts.asked} cases are answered, the rows "
            f"{answered} of {len(listed)}",
        )
    if answered < len(listed):
        yield Finding("warning", f"{where}: answers {answered} of {len(listed)} cases")


def _versions(where: str, results: Results) -> Iterator[Finding]:
    theirs = results.header.metrics
    ours = metric_versions(tuple(name for name in theirs if name in registry.working("metrics")[0]))
    if moved := sorted(name for name, version in theirs.items() if ours.get(name, version) != version):
        yield Finding(
            "warning",
            f"{where}: scored by other versions of {', '.join(moved)} than are installed here; tables show "
            "such numbers apart",
        )


def _again(where: str, results: Results, data: Dataset, predictions: Path) -> Iterator[Finding]:
    """A few cases scored again, where predictions lie beside the rows."""
    if not predictions.is_dir():
        return
    names = [name for name in results.header.metrics if name in registry.working("metrics")[0]]
    answered = [entry for entry in results.entries if entry.status == "ok"]
    infos = {info.id: info for info in data.cases(results.paths.task, results.paths.split)}
    chosen = spread([infos[entry.case] for entry in answered if entry.case in infos])
    entries = {entry.case: entry for entry in answered}
    for info in chosen:
        case = data.load(info)
        outcome = elsewhere(predictions, case)
        if outcome.prediction is None:
            yield Finding("error", f"{where}: {info.id} has rows, but its prediction: {outcome.message}")
            continue
        fresh = score(metrics(tuple(names)), case, as_scored(outcome.prediction))
        if moved := sorted(_differing(fresh, entries[info.id].values)):
            yield Finding(
                "error",
                f"{where}: {info.id} scored again gives another {', '.join(moved[:3])} than the rows say",
            )


def _differing(fresh: store.Values, stored: store.Values) -> Sequence[str]:
    return [
        value_id
        for value_id, number in fresh.items()
        if not isinstance(number, dict)
        and value_id in stored
        and isinstance(known := stored[value_id], float)
        and abs(number - known) > CLOSE * max(abs(number), abs(known), CLOSE)
    ]
