"""Checks of a submission: safe to open, complete, of the data set here, and of numbers that are possible.

A submission is a results folder with a card. What is damaged or does not fit together is found by whatever
reads results; here is what only a folder from elsewhere can have.
"""

import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.api import Dataset, SetMetric, Value
from retarget_bench.errors import BenchError, FileError, printable
from retarget_bench.evaluation import pairs, set_metrics
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.shard_work import elsewhere
from retarget_bench.evaluation.timing import spread
from retarget_bench.exchange import card
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.bound import BoundDataset, BoundMetrics
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, store
from retarget_bench.results.compatibility import metric_versions
from retarget_bench.results.header import DeclaredValue, ResultHeader
from retarget_bench.results.store import ResultPaths, Results
from retarget_bench.tables import builder

LONGEST = 1000
"""Characters of a sentence that are shown."""
LARGEST = 1_000_000_000
"""Bytes that a file may have."""
MOST, DEEPEST = 200_000, 6
"""Files and folders of a submission, and how deep folders may lie in one another."""
NONE_GIVES = 1e12
"""Size from which a number is none that any motion gives."""
CLOSE = 1e-6
"""Relative difference up to which numbers of nine digits agree."""
READ_BY = ("unit", "better", "goal", "index", "with_self")
"""Of a value's declaration, what decides how its numbers are read."""


def check(folder: Path, root: str | None = None) -> tuple[list[str], list[str]]:
    """(Errors, which keep a submission out, warnings), each in a line; both empty where nothing is wrong.

    root: where the files of the data set lie here, if it has any.
    Nothing is opened where a file is none to open: a link, a device, or too large. Raises FileError where
    there is no folder.
    """
    if not folder.is_dir() or folder.is_symlink():
        raise FileError(folder, "is not a folder; a submission is one (bench submit --make writes it)")
    warnings: list[str] = []
    errors = sorted(unsafe(folder)) or list(_wrong(folder, root, warnings))
    if not errors:
        try:
            builder.tables(split_summaries(store.find_results(folder)))
        except Exception as error:  # a submission may hold anything
            errors.append(f"no table can be made of it: {type(error).__name__} {error}")
    return [printable(each)[:LONGEST] for each in errors], [printable(each)[:LONGEST] for each in warnings]


def unsafe(folder: Path) -> Iterator[str]:
    """Contents that a submission must not have, listed before any file is opened. No link is followed."""
    for number, path in enumerate(folder.rglob("*")):
        if number == MOST or len(path.relative_to(folder).parts) > DEEPEST:
            yield f"{folder} holds more than {MOST:,} files, or some more than {DEEPEST} folders deep"
            return
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            yield f"{path} is a link; a submission holds its files itself"
        elif not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)):
            yield f"{path} is not an ordinary file"
        elif status.st_size > LARGEST:
            yield f"{path} is of {status.st_size:,} bytes, more than the {LARGEST:,} that it may have"


def _wrong(folder: Path, root: str | None, warnings: list[str]) -> Iterator[str]:
    try:
        card.read(folder)
        headers = {place: store.read_header(place.any_header) for place in store.find_results(folder)}
        data = _data(folder, list(headers.values()), root)
    except BenchError as error:
        yield str(error)
        return
    seeds: set[tuple[str, int]] = set()
    for place, header in headers.items():
        seed = header.seeds[0] if header.seeds else 0
        where = f"{place.task} {place.split}" + (f", seed {seed}" if seed else "")
        if (place.split, seed) in seeds:
            yield f"{where}: two results are of this seed; hand in one per seed"
        seeds.add((place.split, seed))
        try:
            yield from (f"{where}: {each}" for each in _wrong_in(place, header, data))
        except BenchError as error:
            yield f"{where}: {error}"
        if header.unanswered:
            warnings.append(f"{where}: answers {header.counts.ok} of {header.counts.asked} cases")
        if moved := sorted(_other_versions(header)):
            warning = f"scored by other versions of {', '.join(moved)} than are installed here"
            warnings.append(f"{where}: {warning}; tables show such numbers apart")
    there = {place.split for place in headers}
    if missing := [split for split in data.built.card.splits if split not in there]:
        warnings.append(f"no rows of {', '.join(missing)}: the data set has such cases")


def _data(folder: Path, headers: list[ResultHeader], root: str | None) -> BoundDataset:
    """The data set, as it is here, that all results are on. Raises BenchError where there is none."""
    if not headers:
        raise BenchError(f"{folder} holds no results beside its {card.CARD}")
    specs = {str(Spec(header.dataset.name, header.dataset.parameters)) for header in headers}
    labels = {header.method.label for header in headers}
    if len(specs) > 1 or len(labels) > 1:
        several = f"{', '.join(sorted(labels))} on {', '.join(sorted(specs))}"
        raise BenchError(f"the rows are of {several}; a submission is of one method on one data set")
    installed = bound.dataset(specs.pop())
    spec = Spec(installed.spec.name, installed.parameters)  # no submission says where files lie
    return bound.dataset(spec if root is None else spec.with_parameters(root=root))


def _wrong_in(place: ResultPaths, header: ResultHeader, dataset: BoundDataset) -> Iterator[str]:
    """Faults of the results on one split. Raises BenchError where the rest cannot be checked."""
    data = dataset.built
    if not place.complete:
        raise BenchError(f"the results are not complete: {place.begun.name} is what a run began with")
    if header.task not in ("", place.task) or header.split not in ("", place.split):
        yield f"the rows are of {header.task} {header.split}"
    if (place.dataset, header.dataset.label) != (dataset.slug, data.label):
        called = f"{header.dataset.label} in {place.dataset}/"
        yield f"the data set is called {called}; it is {data.label} in {dataset.slug}/"
    if header.method.control:
        yield "a control cannot be submitted"
    there = [place.file(end) for end in store.ENDS if end not in header.files and place.file(end).exists()]
    if there:
        yield f"its header has no checksum of {', '.join(path.name for path in there)}"
    if header.dataset.content != data.content:
        other = f"made on other data ({header.dataset.content})"
        raise BenchError(f"{other} than {data.label} has here ({data.content})")
    store.verify(place, header)
    _check_cases(place, data)
    results = store.read_results(place, header)
    if header.counted(set(results.cases)).counts != header.counts:
        yield "the counts of its header are not those of its cases"
    yield from _wrong_metrics(header, place.task)
    yield from _wrong_numbers(results)
    if (predictions := place.folder / place.method).is_dir():
        yield from _scored_again(results, data, predictions)
        yield from _pair_scored_again(results, data, predictions)


def _check_cases(place: ResultPaths, data: Dataset) -> None:
    """Raises BenchError where the cases or their metadata are not the data set's."""
    infos = list(data.cases(place.task, place.split))
    with TemporaryDirectory() as temporary:
        own = replace(place, root=Path(temporary))
        store.write_cases(own, infos)
        case_metadata.write(own, data, infos)
        for path in place.folder.glob("cases*.csv"):
            expected = own.folder / path.name
            if not expected.exists() or store.checksum(expected) != store.checksum(path):
                raise BenchError(f"{path.name} is not what the data set says here")


# -------------------------------------------------------------------------------------------- metrics
def _installed(header: ResultHeader) -> BoundMetrics:
    """The metrics of a result that are installed here."""
    working = registry.working("metrics")[0]
    return bound.metrics(tuple(name for name in header.metrics if name in working))


def _other_versions(header: ResultHeader) -> set[str]:
    """The metrics of a result that are installed here in another version."""
    return {
        name for name, version in _installed(header).versions.items() if header.metrics[name] != version
    }


def _wrong_metrics(header: ResultHeader, task: str) -> Iterator[str]:
    """Metrics of every run that a header lacks or has newer, values that it lacks or declares otherwise."""
    others, versions = _other_versions(header), metric_versions(header)
    for name, metric in registry.working("metrics")[0].items():
        if name not in header.metrics:
            usual = registry.find("metrics", name).origin == registry.BUILT_IN
            if usual and task in metric.card.tasks:
                yield f"there are no values of {name}; score all metrics"
            continue
        there, here = versions[name], str(metric.card.version)
        if (len(there), there) > (len(here), here):
            yield f"scored by a newer version of {name} than is installed; upgrade retarget-bench"
        for value in metric.card.computed:
            declared, installed = header.declared.get(value.id), DeclaredValue.of(value, name)
            if declared is None and name not in others:
                yield f"the header lacks {value.id} of {name}"
            elif declared and (
                other := [f for f in READ_BY if getattr(declared, f) != getattr(installed, f)]
            ):
                yield f"the header declares another {other[0]} of {value.id} than its metric"


# -------------------------------------------------------------------------------------------- numbers
def _wrong_numbers(results: Results) -> Iterator[str]:
    """The first impossible number of every value; answered cases, and sets, without any number."""
    header, broken = results.header, dict[str, str]()
    metrics = registry.working("metrics")[0].values()
    declared = {value.id: value for metric in metrics for value in metric.card.computed}
    per_joint = store.read_results(results.paths, arrays=True).numbers
    rated = np.zeros(len(results.infos), dtype=bool)
    for column in results.numbers.values():
        rated |= ~np.isnan(column)
    for (name, point), column in {**results.numbers, **per_joint}.items():
        if name not in header.values:
            broken[name] = f"the header does not say what {name} is"
        elif bool(point) != bool(header.values[name].index):
            broken[name] = f"{name} is {'a' if point else 'no'} curve"
        elif name in declared:
            for at in np.flatnonzero(~np.isnan(column)):
                if not _possible(declared[name], column[at]):
                    problem = f"{name} of {results.infos[at].id} is {column[at]:g}, which is not possible"
                    broken.setdefault(name, problem)
    yield from broken.values()
    for info, has in zip(results.infos, rated, strict=True):
        if not has and info.id not in header.unanswered:
            yield f"{info.id} has no numbers, though the header says that it was answered"
    sets = set_metrics.read(results.paths) if header.set_values else []
    for name in sorted(header.set_values.keys() - {each.value_id for each in sets}):
        metric = registry.working("metrics")[0].get(header.set_values[name].metric)
        own_sets = isinstance(metric, SetMetric) and type(metric).set_of is not SetMetric.set_of
        if rated.any() and metric is not None and not own_sets:
            yield f"values of {name} are left out"
    for each in sets:
        shown = [number for number in (each.value, each.floor) if number is not None]
        if each.value_id in declared and not all(_possible(declared[each.value_id], n) for n in shown):
            yield f"{each.value_id} of {each.structure} is {each.value}, floor {each.floor}: not possible"


def _possible(value: Value, number: float) -> bool:
    return abs(number) < NONE_GIVES and value.allows(number)


def _scored_again(results: Results, data: Dataset, predictions: Path) -> Iterator[str]:
    """Disagreements of the rows with a few predictions that are scored again."""
    values_of = {entry.case: entry.values for entry in results.entries}
    metrics = _installed(results.header).of_cases
    for info in spread([info for info in results.infos if info.id not in results.header.unanswered]):
        case = data.load(info)
        outcome = elsewhere(predictions, case)
        if outcome.prediction is None:
            yield f"{info.id} has rows, but its prediction: {outcome.message}"
            continue
        for name, number in score(metrics, case, as_scored(outcome.prediction)).values.items():
            stored = values_of.get(info.id, {}).get(name)
            if isinstance(number, float) and (not isinstance(stored, float) or not _same(number, stored)):
                there = f"{stored:.6g}" if isinstance(stored, float) else "nothing"
                yield f"{info.id} scored again gives {number:.6g} as {name}, and the rows say {there}"
                break


def _pair_scored_again(results: Results, data: Dataset, predictions: Path) -> Iterator[str]:
    """The first disagreement of the rows with one pair of bodies whose clips are scored again."""
    values_of = {entry.case: entry.values for entry in results.entries}
    answered = [info for info in results.infos if info.id not in results.header.unanswered]
    clips_of = pairs.by_pair(answered).values()
    for metric in _installed(results.header).of_pairs:
        fewest = min((clips for clips in clips_of if len(clips) >= metric.least), key=len, default=[])
        extracts: dict[str, np.ndarray] = {}
        for info in fewest:
            case = data.load(info)
            if (prediction := elsewhere(predictions, case).prediction) is not None:
                for each in pairs.collect([metric], case, as_scored(prediction))[0].values():
                    extracts[info.id] = each.arrays[0]
        if not extracts or len(extracts) < len(fewest):
            continue  # a missing prediction is told where cases are scored again
        for case_id, values in zip(extracts, pairs.values_of(metric, list(extracts.values())), strict=True):
            for name, number in values.items():
                stored = values_of.get(case_id, {}).get(name)
                if isinstance(number, float) and not (isinstance(stored, float) and _same(number, stored)):
                    yield f"{case_id} scored again gives other numbers than the rows as {name}"
                    return


def _same(one: float, other: float) -> bool:
    """Whether numbers are equal to nine digits."""
    return abs(one - other) <= CLOSE * max(abs(one), abs(other), CLOSE)
