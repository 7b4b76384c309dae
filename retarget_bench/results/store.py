"""Result files: the keys of cases, and how results are written and read back.

Under a results root, one folder per data set, task and split holds for every method

    <method>.csv       rows: case, value id, index, value (nine significant digits, sorted)
    <method>.npz       values per joint or frame, too many for rows
    <method>.parquet   in place of both where there are many cases (``rows``)
    <method>.json      the header: what ran, on what, with which versions, what went wrong, and checksums
    <method>/          the predictions, one file per case; disposable
    <method>.log       what the method printed, where it printed anything
    cases.csv          what is known of every case: source, target, clip, kind, frames

and, from the beginning of a run until all cases are done, ``<method>.journal``, which a re-run continues
from, and ``<method>.begun``, a header without counts. While these are there they are the results.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

from retarget_bench.api import CaseInfo
from retarget_bench.errors import FileError
from retarget_bench.files import check_ordinary, digest, read_json, write_csv, write_text
from retarget_bench.results import rows
from retarget_bench.results.header import SCHEMA, WAITING, MetricFault, Problem, ResultHeader, parsed
from retarget_bench.results.journal import read_journal
from retarget_bench.results.paths import ARRAY_INDICES, ARRAYS, CASES, LARGE, ROWS, SETS
from retarget_bench.results.paths import CaseResult as CaseResult
from retarget_bench.results.paths import ResultPaths as ResultPaths
from retarget_bench.results.paths import Values as Values
from retarget_bench.results.paths import case_file as case_file
from retarget_bench.results.rows import Numbers, derived
from retarget_bench.results.rows import read_csv as read_csv
from retarget_bench.results.rows import read_npz as read_npz
from retarget_bench.results.rows import write_npz as write_npz

CASE_FIELDS = ("case", "source", "target", "clip", "kind", "frames")
ENDS = (ROWS, ARRAYS, LARGE, SETS, CASES)
"""Files that headers list, in this order."""
DIGITS = 32
"""Hex digits of a SHA-256 that headers hold."""


@dataclass(frozen=True)
class Results:
    """The results of one method on one split, read back.

    infos:   the case list.
    numbers: (value id, index or "") -> ``(cases,)``, nan where a case has no such number.
    """

    paths: ResultPaths
    header: ResultHeader
    infos: tuple[CaseInfo, ...]
    numbers: Numbers

    @cached_property
    def cases(self) -> dict[str, CaseInfo]:
        return {info.id: info for info in self.infos}

    @cached_property
    def entries(self) -> list[CaseResult]:
        """Every case that has a number, a problem or a fault, sorted. Raises FileError for an unlisted
        one."""
        entries = rows.entries_of(self.numbers, list(self.cases))
        for problem in self.header.problems:
            for case in problem.cases:
                entries[case] = CaseResult(case, problem.status, problem.message)
        for doubt in self.header.doubts:
            for case in doubt.cases:
                entries[case] = replace(entries[case], message=doubt.message)
        for fault in self.header.faults:
            for case in fault.cases:
                entries.setdefault(case, CaseResult(case, "ok")).faults[fault.metric] = fault.message
        if strangers := entries.keys() - self.cases.keys():
            stranger = f"names case {min(strangers)!r}, which {self.paths.cases} does not list"
            raise FileError(self.paths.any_header, stranger)
        return [entries[case] for case in sorted(entries)]


def case_seed(base: int, method: str, case_id: str) -> int:
    """A seed for one method on one case: adding a case moves no other one's randomness."""
    return int(digest(f"{base}\n{method}\n{case_id}", 15), 16)


def case_key(keys: Mapping[str, str], case_id: str) -> str:
    """The key of one case's prediction. keys: of the results."""
    return digest(f"{keys['prediction_key']}\n{case_id}", 16)


def begin(paths: ResultPaths, header: ResultHeader, infos: Sequence[CaseInfo]) -> None:
    """Write the case list and the header of results that are not complete yet, beside the journal.

    Raises BenchError where results of so many cases could not be written.
    """
    if len(infos) > rows.MANY:
        rows.parquet()
    if not lists(paths, infos):
        write_cases(paths, infos)
    _write_header(paths.begun, header)


def settle(paths: ResultPaths) -> None:
    """Let complete results count, whatever a run has begun."""
    paths.begun.unlink(missing_ok=True)
    paths.journal.unlink(missing_ok=True)


# --------------------------------------------------------------------------------------------- writing
def write_results(
    paths: ResultPaths, header: ResultHeader, entries: Iterable[CaseResult], infos: Sequence[CaseInfo]
) -> None:
    """Write numbers and case list, then the header, which says that all is there and what it holds.

    Values of sets, if there are any, have to be there already.
    """
    write_numbers(paths, header, rows.columns_of(entries, _sorted_ids(infos)), infos)


def write_numbers(
    paths: ResultPaths, header: ResultHeader, numbers: Numbers, infos: Sequence[CaseInfo]
) -> None:
    """The same of columns over the cases in the order of their ids."""
    write_cases(paths, infos)
    cases, ends = _sorted_ids(infos), {SETS, CASES}
    if len(cases) > rows.MANY:
        rows.write_large(paths.large, cases, numbers)
        ends |= {LARGE}
    else:
        rows.write_rows(paths.rows, cases, _part(numbers, header, arrays=False))
        ends |= {ROWS}
        if arrays := _part(numbers, header, arrays=True):
            rows.write_arrays(paths.arrays, cases, arrays)
            ends |= {ARRAYS}
    there = [end for end in ENDS if end in ends and paths.file(end).exists()]
    _write_header(paths.header, replace(header, files={end: checksum(paths.file(end)) for end in there}))
    for end in {ROWS, ARRAYS, LARGE} - ends:
        paths.file(end).unlink(missing_ok=True)
    settle(paths)


def _part(numbers: Numbers, header: ResultHeader, *, arrays: bool) -> Numbers:
    """The numbers per joint or frame, or all others."""
    apart = {value for value, declared in header.values.items() if declared.index in ARRAY_INDICES}
    return derived(numbers, numbers.__getitem__, [key for key in numbers if (key[0] in apart) == arrays])


def _sorted_ids(infos: Iterable[CaseInfo]) -> list[str]:
    return sorted(info.id for info in infos)


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
    write_text(path, json.dumps(asdict(header), indent=1, ensure_ascii=False) + "\n")


# ------------------------------------------------------------------------------------------- checksums
def checksum(path: Path) -> str:
    """The hash of a file in its header: a file that was cut, edited or mixed up gives no number."""
    stat = path.stat()
    return _checksum(path, stat.st_mtime_ns, stat.st_size)


@lru_cache(maxsize=1024)
def _checksum(path: Path, changed: int, size: int) -> str:
    """The checksum of a file in this state; methods of one split share their case list."""
    del changed, size
    if path.suffix == ".csv":  # a checkout may have changed line ends, which no number depends on
        return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()[:DIGITS]
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:DIGITS]


def verify(paths: ResultPaths, header: ResultHeader, *ends: str) -> None:
    """Check files (none: all that the header lists) against the header.

    Raises FileError for the first that is missing, or not as it was written.
    """
    for end in [each for each in header.files if each in ends or not ends]:
        path = paths.file(end)
        try:
            check_ordinary(path)
            problem = "" if checksum(path) == header.files[end] else "is not as it was written"
        except FileError as error:
            problem = error.problem
        except OSError as error:
            problem = f"cannot be read ({error.strerror})"
        if problem:
            raise FileError(
                path,
                f"{problem}; numbers made of it could be wrong. Restore it, or have bench run, with the "
                "same options, write it anew",
            )


# --------------------------------------------------------------------------------------------- reading
def read_header(path: Path) -> ResultHeader:
    """The header at a path. Raises FileError on damage or another schema."""
    try:
        facts = read_json(path)
        schema = facts["schema"]
    except (FileError, KeyError, TypeError) as error:
        reason = error.problem if isinstance(error, FileError) else "has no schema"
        raise FileError(path, f"is not a result header: it {reason}") from error
    if schema != SCHEMA:
        newer = isinstance(schema, int) and schema > SCHEMA
        advice = "Upgrade retarget-bench" if newer else "Run the method again"
        raise FileError(path, f"has result schema {schema}; this version reads {SCHEMA}. {advice}")
    try:
        return parsed(facts)
    except ValueError as error:
        raise FileError(path, f"is not a result header ({error})") from error


def read_results(
    paths: ResultPaths, header: ResultHeader | None = None, *, arrays: bool = False
) -> Results:
    """The results of one method on one split, complete or not.

    header: where it was read already. arrays: with the values per joint and frame, in place of all others.
    Raises FileError when a file is missing, damaged or of another version.
    """
    header = read_header(paths.any_header) if header is None else header
    complete = paths.complete
    numbers: Numbers = {}
    if complete:
        verify(paths, header, LARGE, CASES, *([ARRAYS] if arrays else [ROWS, SETS]))
    infos = read_cases(paths.cases, paths.task, paths.split)
    cases = [info.id for info in infos]
    if not complete:
        header, numbers = _begun(paths, header, cases)
    elif LARGE in header.files:
        numbers = rows.read_large(paths.large, cases)
    elif not arrays:
        numbers = rows.read_rows(paths.rows, cases)
    elif paths.arrays.exists():
        numbers = rows.read_arrays(paths.arrays, cases)
    return Results(paths, header, infos, _part(numbers, header, arrays=arrays))


def _begun(paths: ResultPaths, header: ResultHeader, cases: Sequence[str]) -> tuple[ResultHeader, Numbers]:
    """The header and the numbers of results that are not complete: of the cases that are done.

    The others are problems of status ``missing``. A journal of other keys has no entries.
    """
    ids = set(cases)
    journalled = read_journal(paths.journal, header.keys)[0]
    entries = {case: each for case, each in journalled.items() if case in ids}
    problems = [
        Problem(status=each.status, message=each.message, cases=(each.case,))
        for each in entries.values()
        if each.status != "ok"
    ]
    faults = tuple(
        MetricFault(metric=metric, message=message, cases=(each.case,))
        for each in entries.values()
        for metric, message in each.faults.items()
    )
    if waiting := tuple(sorted(ids - entries.keys())):
        problems.append(Problem(status="missing", message=WAITING, cases=waiting))
    so_far = replace(header, problems=tuple(problems), faults=faults).counted(ids)
    return so_far, rows.columns_of(entries.values(), cases)


def read_cases(path: Path, task: str, split: str) -> tuple[CaseInfo, ...]:
    """The case list beside the rows, which all methods on a split share. Raises FileError."""
    return _cases(path, task, split, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=8)
def _cases(path: Path, task: str, split: str, changed: int) -> tuple[CaseInfo, ...]:
    del changed
    infos: dict[str, CaseInfo] = {}
    listed = rows.csv_rows(path, CASE_FIELDS)
    for line, (case, source, target, clip, kind, frames) in enumerate(listed, 2):
        if not frames.isdecimal() or len(frames) > 12:
            raise FileError(path, f"{frames!r} is not a number of frames", line)
        if case in infos:
            raise FileError(path, f"{case!r} is listed twice", line)
        infos[case] = CaseInfo(case, task, split, source, target, clip, kind, int(frames))
    return tuple(infos.values())


def find_results(root: Path, task: str = "retarget") -> list[ResultPaths]:
    """Every result of a task under a results root, complete or not, sorted.

    task: ``retarget``, a derived one (with any parameters), or ``probe``, of ``bench test --probes``.
    """
    changed = f"{task}-{8 * '[0-9a-f]'}"  # see Spec.slug
    folders = [f"*/{name}/*/*.{end}" for name in (task, changed) for end in ("json", "begun")]
    stems = {path.with_suffix("") for folder in folders for path in root.glob(folder)}
    return [ResultPaths(root, *path.relative_to(root).parts) for path in sorted(stems)]
