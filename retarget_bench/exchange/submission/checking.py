"""Checks of a submission: complete, consistent, of the right data, and possible."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, Literal

from retarget_bench.api import TASKS, Dataset, optional
from retarget_bench.errors import BenchError, FileError, printable
from retarget_bench.evaluation.plan import Plan
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.shard_work import elsewhere
from retarget_bench.evaluation.timing import spread
from retarget_bench.exchange.submission import numbers, together
from retarget_bench.exchange.submission.folder import faults
from retarget_bench.exchange.submission.making import FILL_IN
from retarget_bench.exchange.submission.manifest import (
    CARD,
    CARD_SECTIONS,
    MANIFEST,
    PREDICTIONS,
    ROWS,
    Manifest,
    read,
)
from retarget_bench.files import slug
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.results.header import STATUSES, parsed
from retarget_bench.results.store import ResultPaths, Results
from retarget_bench.tables.model import count

LONGEST = 1000
"""Characters of a finding that are shown."""


@dataclass(frozen=True)
class Finding:
    """error: the submission cannot be taken. warning: it can, with this said of it."""

    level: Literal["error", "warning"]
    text: str

    def __str__(self) -> str:
        """One line for a terminal, whatever names the submission has."""
        return f"{self.level}: {printable(self.text)[:LONGEST]}"


def _error(text: str) -> Finding:
    return Finding("error", text)


def check(folder: Path) -> list[Finding]:
    """Everything that is wrong with a submission; empty where nothing is.

    A folder with predictions and no rows is scored first, which writes its rows. Nothing is opened where a
    file is none to open: a link, a device, or too large. Raises FileError where there is no folder.
    """
    if not folder.is_dir():
        raise FileError(folder, "is no folder; a submission is one (bench submit --make writes it)")
    if wrong := faults(folder):
        return [_error(text) for text in wrong]
    found = list(_card(folder))
    try:
        manifest = read(folder)
    except FileError as error:
        return [_error(str(error)), *found]
    for line, text in enumerate((folder / MANIFEST).read_text(encoding="utf-8").splitlines(), 1):
        if FILL_IN in text:
            found.append(_error(f"{folder / MANIFEST}, line {line}: is still to be filled in"))
    try:
        spec = registry.canonical("datasets", Spec.parse(manifest.data.dataset))
        data = bound.dataset(spec).built
    except BenchError as error:
        return [*found, _error(f"data.dataset: {error}")]
    if not store.find_results(folder / ROWS) and (folder / PREDICTIONS).is_dir():
        try:
            _score(folder, manifest.method.label, spec)
        except BenchError as error:
            return [*found, _error(f"the predictions cannot be scored: {error}")]
    places = store.find_results(folder / ROWS)
    if not places:
        return [*found, _error(f"{folder} holds neither {ROWS}/ nor {PREDICTIONS}/")]
    for split in dict.fromkeys(place.split for place in places):
        listed = sorted((place for place in places if place.split == split), key=_seed)
        for one, other in pairwise(listed):
            if _seed(one) == _seed(other):
                both = f"{one.method} and {other.method} are both of seed {_seed(one)}"
                found.append(_error(f"{one.task} {split}: {both}; hand in one result per seed"))
        for place in listed:
            try:
                found += _rows(place, manifest, data, first=place == listed[0])
            except BenchError as error:
                found.append(_error(f"{place.task} {split}: {error}"))
    if missing := [split for split in data.card.splits if split not in {place.split for place in places}]:
        found.append(Finding("warning", f"no rows of {', '.join(missing)}: the data set has such cases"))
    return found


def _card(folder: Path) -> Iterator[Finding]:
    try:
        text = (folder / CARD).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        yield _error(f"{folder / CARD} cannot be read ({error}); it says what the method is")
        return
    sections: dict[str, str] = {}
    name = ""
    for line in text.splitlines():
        if line.startswith("## "):
            name = line[3:].strip()
        else:
            sections[name] = sections.get(name, "") + line.strip()
    for name in CARD_SECTIONS:
        body = sections.get(name, "")
        if not body or FILL_IN in body:
            yield _error(f"{folder / CARD}: the section '## {name}' is missing or not filled in")


def _score(folder: Path, label: str, data: Spec) -> None:
    """Rows of the predictions in a folder."""
    from retarget_bench.evaluation.runner import run

    working, _ = registry.working("metrics")
    plan = Plan(
        methods=(Spec(label),),
        datasets=(data,),
        metrics=tuple(name for name, each in working.items() if TASKS[0] in optional.metric_tasks(each)),
        root=folder / ROWS,
        stage="score",
        external=folder / PREDICTIONS,
    )
    run(plan, lambda *_: None)


def _seed(place: ResultPaths) -> int:
    """The seed that results were made with; 0 where they do not say."""
    try:
        seeds = store.read_header_facts(place.header).get("seeds")
    except FileError:
        return 0
    return seeds[0] if isinstance(seeds, list) and seeds and isinstance(seeds[0], int) else 0


def _rows(place: ResultPaths, manifest: Manifest, data: Dataset, *, first: bool) -> Iterator[Finding]:
    """first: these are the rows of the first seed, which predictions belong to."""
    where = f"{place.task} {place.split}" + ("" if first else f", seed {_seed(place)}")
    if not place.complete:
        yield _error(f"{where}: the results are not complete: {place.begun.name} is what a run began with")
        return
    try:
        if wrong := mistakes(store.read_header_facts(place.header)):
            yield _error(f"{where}: the header is not one: {'; '.join(wrong[:3])}")
            return
        results = store.read_results(place)
    except FileError as error:
        yield _error(str(error))
        return
    found = {value for entry in results.entries for value in entry.values}
    if strange := sorted(found - results.header.values.keys()):
        yield _error(f"{where}: the header does not say what {', '.join(strange[:3])} is")
        return
    checks = [
        *(_header(results, manifest), _cases(results, data), _versions(results)),
        map(_error, chain(numbers.checks(results, data), together.impossible(results))),
    ]
    if first:
        checks.append(_again(results, data, place.root.parent / PREDICTIONS))
    for finding in chain(*checks):
        yield Finding(finding.level, f"{where}: {finding.text}")


def mistakes(facts: dict[str, Any]) -> list[str]:
    """Faults of a header, as ``own: no field of a header``."""
    try:
        header = parsed(facts)
    except ValueError as error:
        return [str(error)]
    unknown = sorted({name for part in header.parts() for name in part.extra})
    return [f"{name}: no field of a header" for name in unknown] + [
        f"problems.{number}.status: Input should be one of {', '.join(STATUSES[1:])}"
        for number, each in enumerate(header.problems)
        if each.status not in STATUSES[1:]
    ]


def _header(results: Results, manifest: Manifest) -> Iterator[Finding]:
    method, theirs = results.header.method, results.header.dataset.name
    place, said = results.paths, (results.header.task, results.header.split)
    if any(one not in ("", other) for one, other in zip(said, (place.task, place.split), strict=True)):
        yield _error(f"the rows are of {' '.join(said)}")
    if place.method.partition(".seed-")[0] not in _file_names(method.label):
        yield _error(f"{place.rows.name} is no file of {method.label}, which its header names")
    if method.label != manifest.method.label:
        yield _error(f"the rows are of {method.label}, the manifest of {manifest.method.label}")
    if unlisted := store.unlisted(place, results.header):
        yield _error(f"its header has no checksum of {', '.join(unlisted)}")
    if unsaid := sorted(set(method.privileged) - set(manifest.method.sees)):
        yield _error(f"the method is given {', '.join(unsaid)}, which method.sees does not say")
    if method.control:
        yield _error("a control is no submission")
    if theirs != Spec.parse(manifest.data.dataset).name:
        yield _error(f"the rows are on {theirs}, not {Spec.parse(manifest.data.dataset).name}")


def _file_names(label: str) -> set[str]:
    """The names of a method's files: of one that runs here, and of predictions made elsewhere."""
    with suppress(BenchError):
        return {slug(label), Spec.parse(label).slug}
    return {slug(label)}


def _cases(results: Results, data: Dataset) -> Iterator[Finding]:
    counts, content = results.header.counts, results.header.dataset.content
    try:
        infos = {info.id: info for info in data.cases(results.paths.task, results.paths.split)}
    except BenchError as error:
        yield Finding("warning", f"the case list cannot be compared with the data set's ({error})")
        return
    if content != data.content:
        yield _error(f"made on other data ({content}) than {data.label} has here ({data.content})")
    listed, wanted = set(results.cases), set(infos)
    for cases, what in ((wanted - listed, "missing"), (listed - wanted, "unknown to the data set")):
        if cases:
            yield _error(f"{count(len(cases), 'case')} {what}, first {min(cases)}")
    if other := [case for case in sorted(listed & wanted) if results.cases[case] != infos[case]]:
        yield _error(f"{count(len(other), 'case')} told otherwise than by the data set, first {other[0]}")
    status = {entry.case: entry.status for entry in results.entries}
    if silent := sorted(listed - status.keys()):
        yield _error(f"{len(silent)} cases have neither rows nor a reason, first {silent[0]}")
    answered = sum(each == "ok" for each in status.values())
    if (counts.asked, counts.ok) != (len(listed), answered):
        said = f"{counts.ok} of {counts.asked} cases are answered"
        yield _error(f"the header says {said}, the rows {answered} of {len(listed)}")
    if answered < len(listed):
        yield Finding("warning", f"answers {answered} of {len(listed)} cases")


def _versions(results: Results) -> Iterator[Finding]:
    theirs, working = results.header.metrics, registry.working("metrics")[0]
    ours = bound.metrics(tuple(name for name in theirs if name in working)).versions
    if moved := sorted(name for name, version in theirs.items() if ours.get(name, version) != version):
        yield Finding(
            "warning",
            f"scored by other versions of {', '.join(moved)} than are installed here; tables show such "
            "numbers apart",
        )


def _again(results: Results, data: Dataset, predictions: Path) -> Iterator[Finding]:
    """A few cases scored again, where predictions lie beside the rows."""
    if not predictions.is_dir():
        return
    working = registry.working("metrics")[0]
    ours = bound.metrics(tuple(name for name in results.header.metrics if name in working)).of_cases
    entries = {entry.case: entry for entry in results.entries if entry.status == "ok"}
    infos = {info.id: info for info in data.cases(results.paths.task, results.paths.split)}
    for info in spread([infos[case] for case in entries if case in infos]):
        case = data.load(info)
        outcome = elsewhere(predictions, case)
        if outcome.prediction is None:
            yield _error(f"{info.id} has rows, but its prediction: {outcome.message}")
            continue
        moved, stored = [], entries[info.id].values
        for value_id, number in score(ours, case, as_scored(outcome.prediction)).values.items():
            known = stored.get(value_id)
            if isinstance(number, dict) or not isinstance(known, float):
                continue
            if abs(number - known) > together.near(number, known):
                moved.append(value_id)
        if moved:
            values = ", ".join(sorted(moved)[:3])
            yield _error(f"{info.id} scored again gives another {values} than the rows say")
