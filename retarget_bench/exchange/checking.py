"""Checks of a submission: safe to open, complete, of the data set here, and of numbers that are possible.

A submission is a results folder with a card. What is damaged or does not fit together is found by whatever
reads results; here is what only somebody who wants to look better would change.
"""

import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from retarget_bench.analysis.summary import split_summaries
from retarget_bench.errors import BenchError, FileError, printable
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.shard_work import elsewhere
from retarget_bench.evaluation.timing import spread
from retarget_bench.exchange import card, numbers
from retarget_bench.exchange.numbers import Rows
from retarget_bench.plugins import bound
from retarget_bench.plugins.bound import BoundDataset
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import case_metadata, store
from retarget_bench.results.header import ResultHeader
from retarget_bench.results.store import ResultPaths
from retarget_bench.tables import builder

LONGEST = 1000
"""Characters of a sentence that are shown."""
LARGEST = 1_000_000_000
"""Bytes that a file may have."""
MOST, DEEPEST = 200_000, 6


def check(folder: Path, root: str | None = None) -> tuple[list[str], list[str]]:
    """(Errors, which keep a submission out, warnings), each in a line; both empty where nothing is wrong.

    root: where the files of the data set lie here, if it has any.
    Nothing is opened where a file is none to open: a link, a device, or too large. Raises FileError where
    there is no folder.
    """
    if not folder.is_dir() or folder.is_symlink():
        raise FileError(folder, "is no folder; a submission is one (bench submit --make writes it)")
    warnings: list[str] = []
    errors = sorted(unsafe(folder)) or list(_wrong(folder, root, warnings))
    if not errors:
        try:
            builder.tables(split_summaries(store.find_results(folder)))
        except Exception as error:  # whatever somebody sent
            errors.append(f"no table can be made of it: {type(error).__name__} {error}")
    return [printable(each)[:LONGEST] for each in errors], [printable(each)[:LONGEST] for each in warnings]


def unsafe(folder: Path) -> Iterator[str]:
    """What must not be in a submission, told before any file is opened. No link is followed."""
    for number, path in enumerate(folder.rglob("*")):
        if number == MOST or len(path.relative_to(folder).parts) > DEEPEST:
            yield f"{folder} holds more than {MOST:,} files, or some more than {DEEPEST} folders deep"
            return
        found = path.lstat()
        if stat.S_ISLNK(found.st_mode):
            yield f"{path} is a link; a submission holds its files itself"
        elif not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
            yield f"{path} is no ordinary file"
        elif found.st_size > LARGEST:
            yield f"{path} is of {found.st_size:,} bytes, more than the {LARGEST:,} that it may have"


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
        if moved := sorted(numbers.other_versions(header)):
            told = f"scored by other versions of {', '.join(moved)} than are installed here"
            warnings.append(f"{where}: {told}; tables show such numbers apart")
    if missing := [
        split for split in data.built.card.splits if split not in {place.split for place in headers}
    ]:
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
    named = bound.dataset(specs.pop())
    spec = Spec(named.spec.name, named.parameters)  # no submission says where files lie
    return bound.dataset(spec if root is None else spec.with_parameters(root=root))


def _wrong_in(place: ResultPaths, header: ResultHeader, dataset: BoundDataset) -> Iterator[str]:
    """What is wrong with the results on one split. Raises BenchError where the rest cannot be checked."""
    data = dataset.built
    if not place.complete:
        raise BenchError(f"the results are not complete: {place.begun.name} is what a run began with")
    if header.task not in ("", place.task) or header.split not in ("", place.split):
        yield f"the rows are of {header.task} {header.split}"
    if (place.dataset, header.dataset.label) != (dataset.slug, data.label):
        called = f"{header.dataset.label} in {place.dataset}/"
        yield f"the data set is called {called}; it is {data.label} in {dataset.slug}/"
    if newer := sorted(numbers.newer_versions(header)):
        yield f"scored by newer versions of {', '.join(newer)} than are installed; upgrade retarget-bench"
    if header.method.control:
        yield "a control is no submission"
    if unlisted := store.unlisted(place, header):
        yield f"its header has no checksum of {', '.join(unlisted)}"
    if header.dataset.content != data.content:
        other = f"made on other data ({header.dataset.content})"
        raise BenchError(f"{other} than {data.label} has here ({data.content})")
    store.verify(place, header)
    infos = list(data.cases(place.task, place.split))
    with TemporaryDirectory() as temporary:
        own = replace(place, root=Path(temporary))
        store.write_cases(own, infos)
        case_metadata.write(own, data, infos)
        for path in place.folder.glob("cases*.csv"):
            ours = own.folder / path.name
            if not ours.exists() or ours.read_bytes() != path.read_bytes().replace(b"\r\n", b"\n"):
                raise BenchError(f"{path.name} is not what the data set says here")
    if header.counted({info.id for info in infos}).counts != header.counts:
        yield "the counts of its header are not those of its cases"
    rows = numbers.read(place, header, data)
    yield from numbers.wrong(rows)
    if (predictions := place.folder / place.method).is_dir():
        yield from _scored_again(rows, predictions)


def _scored_again(rows: Rows, predictions: Path) -> Iterator[str]:
    """A few cases of which the predictions give other numbers than the rows say."""
    for info in spread(rows.answered):
        case = rows.data.load(info)
        outcome = elsewhere(predictions, case)
        if outcome.prediction is None:
            yield f"{info.id} has rows, but its prediction: {outcome.message}"
            continue
        again = score(rows.metrics, case, as_scored(outcome.prediction)).values
        for name, known in rows.table.loc[info.id].dropna().items():
            if isinstance(number := again.get(str(name)), float) and not numbers.same(number, known):
                yield f"{info.id} scored again gives {number:.6g} as {name}, and the rows say {known:.6g}"
                break
