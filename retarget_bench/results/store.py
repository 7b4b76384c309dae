"""Result files: what a run is known by, how its rows are written, read back and migrated.

Under a results root, one folder per data set, task and split holds for every method

    <method>.csv       rows: case, value id, index, value (nine significant digits, sorted)
    <method>.npz       values per joint or frame, too many for rows
    <method>.parquet   in place of both where there are many cases (``large_rows``)
    <method>.json      the header: what ran, on what, with which versions, what went wrong, and checksums
    <method>/          the predictions, one file per case; disposable
    <method>.log       what the method printed, where it printed anything
    cases.csv          what is known of every case: source, target, clip, kind, frames

and, from the beginning of a run until all cases are done, ``<method>.journal``, which a re-run continues
from, and ``<method>.begun``, a header without counts. While these are there they are the results.
"""

import csv
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import CaseInfo
from retarget_bench.errors import FileError
from retarget_bench.files import (
    LARGEST,
    atomic,
    check_ordinary,
    digest,
    read_json,
    write_csv,
    write_text,
)
from retarget_bench.results import checksums, large_rows
from retarget_bench.results.header import (
    SCHEMA,
    WAITING,
    DeclaredValue,
    MetricFault,
    Problem,
    ResultHeader,
    parsed,
)
from retarget_bench.results.journal import read_journal
from retarget_bench.results.large_rows import Batch, LargeRows
from retarget_bench.results.paths import ARRAY_INDICES, ARRAYS, CASES, LARGE, ROWS, SETS
from retarget_bench.results.paths import CaseResult as CaseResult
from retarget_bench.results.paths import ResultPaths as ResultPaths
from retarget_bench.results.paths import Values as Values
from retarget_bench.results.paths import case_file as case_file

ROW_FIELDS = ("case", "value_id", "index", "value")
CASE_FIELDS = ("case", "source", "target", "clip", "kind", "frames")


@dataclass
class Results:
    """The results of one method on one split, read back."""

    paths: ResultPaths
    header: ResultHeader
    entries: list[CaseResult]
    cases: dict[str, CaseInfo]


def case_seed(base: int, method: str, case_id: str) -> int:
    """A seed for one method on one case: adding a case moves no other one's randomness."""
    return int(digest(f"{base}\n{method}\n{case_id}", 15), 16)


def case_key(keys: Mapping[str, str], case_id: str) -> str:
    """The key of one case's prediction. keys: of the results."""
    return digest(f"{keys['prediction_key']}\n{case_id}", 16)


def begin(paths: ResultPaths, header: ResultHeader, infos: Sequence[CaseInfo]) -> None:
    """Write what results are read by, beside the journal, until they are complete.

    Raises BenchError where results of so many cases could not be written.
    """
    if len(infos) > large_rows.MANY:
        large_rows.parquet()
    if not lists(paths, infos):
        write_cases(paths, infos)
    _write_header(paths.begun, header)


def settle(paths: ResultPaths) -> None:
    """Let complete results count, whatever a run has begun."""
    paths.begun.unlink(missing_ok=True)
    paths.journal.unlink(missing_ok=True)


# --------------------------------------------------------------------------------------------- writing
def write_results(
    paths: ResultPaths, header: ResultHeader, entries: Sequence[CaseResult], infos: Sequence[CaseInfo]
) -> None:
    """Rows, arrays and case list, then the header, which says that all is there and what it holds.

    Values of sets, if there are any, have to be there already.
    """
    if len(infos) > large_rows.MANY:
        found = {entry.case: entry for entry in entries}
        ids = sorted(info.id for info in infos)
        ordered = (found.get(case, CaseResult(case, "missing")) for case in ids)
        write_large(paths, header, large_rows.batches(ordered, header.values), infos)
        return
    write_cases(paths, infos)
    rows, arrays = _flatten(entries, header.values)
    texts = ((case, value, index, f"{number:.9g}") for case, value, index, number in rows)
    write_csv(paths.rows, ROW_FIELDS, texts)
    write_npz(paths.arrays, arrays, compressed=True)
    _write_last(paths, header, (ROWS, ARRAYS, SETS, CASES))


def write_large(
    paths: ResultPaths, header: ResultHeader, batches: Iterable[Batch], infos: Sequence[CaseInfo]
) -> None:
    """The same for results of many cases, of which every one is in a batch, in the order of their ids."""
    write_cases(paths, infos)
    count = large_rows.write(paths.large, batches, header.values)
    _write_last(paths, header, (LARGE, SETS, CASES), count)


def _write_last(
    paths: ResultPaths, header: ResultHeader, ends: Sequence[str], count: int | None = None
) -> None:
    """The header, with checksums of the files that it lists; then what it replaces goes."""
    files = {end: checksums.stored_file(paths.file(end)) for end in ends if paths.file(end).exists()}
    if count is not None:
        files[LARGE] = replace(files[LARGE], rows=count)
    _write_header(paths.header, replace(header, files=files))
    for end in {ROWS, ARRAYS, LARGE}.difference(ends):
        paths.file(end).unlink(missing_ok=True)
    settle(paths)


def write_cases(paths: ResultPaths, infos: Sequence[CaseInfo]) -> None:
    """The case list of a split, sorted by id."""
    write_csv(paths.cases, CASE_FIELDS, _listed(infos))


def lists(paths: ResultPaths, infos: Sequence[CaseInfo]) -> bool:
    """Whether the case list that is there, if any, is of these cases."""
    try:
        return read_csv(paths.cases, CASE_FIELDS) == [list(map(str, row)) for row in _listed(infos)]
    except FileError:
        return False


def _listed(infos: Sequence[CaseInfo]) -> list[tuple[str, str, str, str, str, int]]:
    ordered = sorted(infos, key=lambda info: info.id)
    return [(info.id, info.source, info.target, info.clip, info.kind, info.frames) for info in ordered]


def _write_header(path: Path, header: ResultHeader) -> None:
    write_text(path, json.dumps(header.plain(), indent=1, ensure_ascii=False) + "\n")


def _flatten(
    entries: Iterable[CaseResult], declared: Mapping[str, DeclaredValue]
) -> tuple[list[tuple[str, str, str, float]], dict[str, np.ndarray]]:
    """Entries as sorted rows, and as arrays ``<value id>:cases|index|values``, each one-dimensional."""
    rows: list[tuple[str, str, str, float]] = []
    arrays: dict[str, list[tuple[str, str, float]]] = {}
    for entry in entries:
        for value_id, value in entry.values.items():
            if not isinstance(value, dict):
                rows.append((entry.case, value_id, "", value))
            elif declared[value_id].index in ARRAY_INDICES:
                arrays.setdefault(value_id, []).extend((entry.case, k, v) for k, v in value.items())
            else:
                rows.extend((entry.case, value_id, k, v) for k, v in value.items())
    rows.sort(key=lambda row: row[:3])
    packed: dict[str, np.ndarray] = {}
    for value_id, triples in sorted(arrays.items()):
        cases, index, values = zip(*sorted(triples), strict=True)
        packed[f"{value_id}:cases"] = np.array(cases)
        packed[f"{value_id}:index"] = np.array(index)
        packed[f"{value_id}:values"] = np.array([float(f"{v:.9g}") for v in values])
    return rows, packed


# --------------------------------------------------------------------------------------------- reading
def verify(paths: ResultPaths, header: ResultHeader, *ends: str) -> None:
    """Check files (none: all that the header lists, as a whole) against the header.

    Raises FileError for the first that is missing, or not as it was written.
    """
    for end in [each for each in header.files if each in ends or not ends]:
        if problem := checksums.problem(paths.file(end), header.files[end], whole=not ends):
            raise FileError(
                paths.file(end),
                f"{problem}; numbers made of it could be wrong. Restore it, or have bench run, with the "
                "same options, write it anew",
            )


def unlisted(paths: ResultPaths, header: ResultHeader) -> list[str]:
    """The files of complete results that are there and that the header has no checksum of."""
    ends = (ROWS, ARRAYS, LARGE, SETS, CASES)
    return [paths.file(end).name for end in ends if end not in header.files and paths.file(end).exists()]


def read_header(path: Path) -> ResultHeader:
    """The header at a path. Raises FileError on damage or a newer schema."""
    facts = read_header_facts(path)
    try:
        return parsed(facts)
    except ValueError as error:
        raise FileError(path, f"is not a result header ({error})") from error


def read_header_facts(path: Path) -> dict[str, Any]:
    """A header as JSON, of a schema that this version knows, but otherwise unchecked. Raises FileError."""
    try:
        facts = read_json(path)
        schema = facts["schema"]
    except (FileError, KeyError, TypeError) as error:
        reason = error.problem if isinstance(error, FileError) else "has no schema"
        raise FileError(path, f"is not a result header: it {reason}") from error
    if not isinstance(schema, int) or schema > SCHEMA:
        raise FileError(
            path, f"has result schema {schema}; this version reads up to {SCHEMA}. Upgrade retarget-bench"
        )
    return dict(facts)


def read_results(paths: ResultPaths) -> Results:
    """Everything that is known of one method on one split, complete or not.

    Raises FileError when a file is missing, damaged or from a newer version.
    """
    header = read_header(paths.any_header)
    complete = paths.complete
    if complete:
        verify(paths, header, ROWS, LARGE, CASES)
    cases = {info.id: info for info in read_cases(paths.cases, paths.task, paths.split)}
    if not complete:
        header, entries = read_begun(paths, header, list(cases.values()))
    elif LARGE in header.files:
        entries = LargeRows(paths.large).entries()
    else:
        entries = read_rows(paths.rows)
    for problem in header.problems:
        for case in problem.cases:
            entries[case] = CaseResult(case, problem.status, problem.message)
    for fault in header.faults:
        for case in fault.cases:
            entries.setdefault(case, CaseResult(case, "ok")).faults[fault.metric] = fault.message
    if strangers := entries.keys() - cases.keys():
        raise FileError(paths.rows, f"names case {min(strangers)!r}, which {paths.cases} does not list")
    return Results(paths, header, [entries[case] for case in sorted(entries)], cases)


def read_begun(
    paths: ResultPaths, header: ResultHeader, cases: Sequence[CaseInfo]
) -> tuple[ResultHeader, dict[str, CaseResult]]:
    """The header and the entries of results that are not complete: of the cases that are done.

    The others are problems of status ``missing``. A journal of other keys has no entries. Values per joint
    and frame are left to ``read_arrays``.
    """
    ids = {info.id for info in cases}
    arrays = {key for key, value in header.values.items() if value.index in ARRAY_INDICES}
    done = {
        case: replace(each, values={key: each.values[key] for key in each.values.keys() - arrays})
        for case, each in read_journal(paths.journal, header.keys)[0].items()
        if case in ids
    }
    problems = [Problem(status=e.status, message=e.message, cases=(e.case,)) for e in done.values()]
    kept = [problem for problem in problems if problem.status != "ok"]
    faults = tuple(
        MetricFault(metric=metric, message=message, cases=(each.case,))
        for each in done.values()
        for metric, message in each.faults.items()
    )
    if waiting := tuple(sorted(ids - done.keys())):
        kept.append(Problem(status="missing", message=WAITING, cases=waiting))
    return replace(header, problems=tuple(kept), faults=faults).counted(ids), done


def read_rows(path: Path) -> dict[str, CaseResult]:
    entries: dict[str, CaseResult] = {}
    for line, (case, value_id, index, text) in enumerate(read_csv(path, ROW_FIELDS), 2):
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise FileError(path, f"{text!r} is not a number", line)
        values = entries.setdefault(case, CaseResult(case, "ok")).values
        curve = values.setdefault(value_id, {}) if index else values
        if not isinstance(curve, dict):
            raise FileError(path, f"{value_id!r} of {case!r} is both a number and a curve", line)
        if (index or value_id) in curve:
            raise FileError(path, f"{value_id!r} of {case!r} stands twice", line)
        curve[index or value_id] = number
    return entries


def read_cases(path: Path, task: str, split: str) -> list[CaseInfo]:
    """The case list beside the rows."""
    found: dict[str, CaseInfo] = {}
    for line, (case, source, target, clip, kind, frames) in enumerate(read_csv(path, CASE_FIELDS), 2):
        if not frames.isdecimal() or len(frames) > 12:
            raise FileError(path, f"{frames!r} is not a number of frames", line)
        if case in found:
            raise FileError(path, f"{case!r} stands twice", line)
        found[case] = CaseInfo(case, task, split, source, target, clip, kind, int(frames))
    return list(found.values())


def read_csv(path: Path, fields: Sequence[str]) -> list[list[str]]:
    """The rows below a heading of these fields. Raises FileError with the line of the first fault."""
    check_ordinary(path)
    try:
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = list(csv.reader(file))
    except (OSError, ValueError, csv.Error) as error:
        raise FileError(path, f"cannot be read as a table ({error or 'it is empty'})") from error
    if tuple(head) != tuple(fields):
        raise FileError(path, f"has columns {', '.join(head)}; expected {', '.join(fields)}", 1)
    for line, row in enumerate(rows, 2):
        if len(row) != len(fields):
            raise FileError(path, f"has {len(row)} cells instead of {len(fields)}", line)
    return rows


def read_arrays(paths: ResultPaths) -> dict[str, np.ndarray]:
    """Values per joint or frame: ``<value id>:cases``, ``:index`` and ``:values``, one-dimensional."""
    header = read_header(paths.any_header)
    if not paths.complete:
        return _flatten(read_journal(paths.journal, header.keys)[0].values(), header.values)[1]
    verify(paths, header, ARRAYS, LARGE)
    if LARGE in header.files:
        rows = LargeRows(paths.large)
        return {
            f"{value}:{name}": array
            for value in rows.per_index()
            for name, array in zip(("cases", "index", "values"), rows.pairs(value), strict=True)
        }
    return read_npz(paths.arrays, "cannot be read; run the method again", LARGEST)


def write_npz(path: Path, arrays: Mapping[str, Any], compressed: bool = False) -> None:
    """Write arrays by name, atomically. Raises FileError."""
    with atomic(path) as temporary, temporary.open("wb") as stream:
        (np.savez_compressed if compressed else np.savez)(stream, **arrays)


def read_npz(path: Path, problem: str, most: float = math.inf) -> dict[str, np.ndarray]:
    """All arrays of a file. Raises FileError that states the problem where it is none, or where it unpacks
    to more than ``most`` bytes."""
    check_ordinary(path)
    try:
        with path.open("rb") as opened, np.load(opened) as file:
            if (size := sum(each.file_size for each in file.zip.infolist())) > most:
                raise ValueError(f"it unpacks to {size:,} bytes, more than the {most:,} that are read")
            return {name: file[name] for name in file.files}
    except Exception as error:  # an archive from elsewhere makes its readers raise all kinds
        raise FileError(path, f"{problem} ({error})") from error


def find_results(root: Path, task: str = "retarget") -> list[ResultPaths]:
    """Every result of a task under a results root, complete or not, sorted.

    task: ``retarget``, a derived one (with any parameters), or ``probe``, of ``bench test --probes``.
    """
    changed = f"{task}-{8 * '[0-9a-f]'}"  # see Spec.slug
    folders = [f"*/{name}/*/*.{end}" for name in (task, changed) for end in ("json", "begun")]
    found = {path.with_suffix("") for folder in folders for path in root.glob(folder)}
    return [ResultPaths(root, *path.relative_to(root).parts) for path in sorted(found)]
