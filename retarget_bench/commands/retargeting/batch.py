"""Many retargetings in processes: results that are up to date are left, and a failure costs one result.

A folder of results has a line of JSON for each, appended when it is written; of two lines on one result the
later counts. A second run does only what is new or has changed.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass, fields
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Literal

from retarget_bench import __version__, defaults, files
from retarget_bench.commands import echo
from retarget_bench.commands.retargeting.job import Job, Options, retarget, stamp
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion.editing.edits import Edits
from retarget_bench.motion.files import format_of, split_take
from retarget_bench.motion.files.catalogue import facts
from retarget_bench.motion.files.formats import BVH
from retarget_bench.motion.files.reading import Reading
from retarget_bench.parallel import carried_out
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.code_hash import code_hash, package_code
from retarget_bench.python.plans import method_spec
from retarget_bench.python.progress import progress_bar
from retarget_bench.tables.model import count

Status = Literal["done", "current", "failed"]
RECORDS = "retarget.jsonl"
SHOWN = 10
"""Results that the summary names at most, those with most to look at."""
_DECIDE = ("seed", "fps", *(each.name for each in fields(Edits)))
"""Options that decide a result, beside the method."""


@dataclass(frozen=True)
class Record:
    """A result. key: of all that decides it. verdict: as JSON has it, None where there was none. content:
    a hash of its file, by which one that was changed or damaged since is known."""

    key: str
    verdict: Mapping[str, Any] | None
    content: str


@dataclass(frozen=True)
class Answer:
    """The outcome of a job, with the lines to print. record: None where it failed."""

    status: Status
    record: Record | None = None
    output: Sequence[str] = ()
    warnings: Sequence[str] = ()
    error: str = ""

    @property
    def verdict(self) -> Mapping[str, Any] | None:
        return self.record.verdict if self.record else None


def work(plugins: Sequence[tuple[str, registry.Kind]], order: tuple[Job, Record | None]) -> Answer:
    """Carry out a job whose result is not there as it was recorded, in a process of the pool.

    plugins: the files of plug-ins that the first process knows.
    """
    registry.know_files(plugins)
    job, record = order
    output: list[str] = []
    warnings: list[str] = []
    try:
        now = key(job)
        if record is not None and record.key == now and record.content == file_hash(job.out):
            return Answer("current", record)
        for path in filter(None, (job.out, job.preview)):
            files.sweep(path)
        with _captured(output, warnings):
            verdict = retarget(job, output.append, warnings.append)
        if verdict is not None:
            output += [*verdict.lines, verdict.summary]
            warnings += [f"{job.target.path.name}: {verdict.followers}"] * bool(verdict.undriven)
        new = Record(now, None if verdict is None else verdict.as_dict(), file_hash(job.out))
    except BenchError as error:
        return Answer("failed", None, output, warnings, str(error))
    return Answer("done", new, output, warnings)


@contextmanager
def _captured(output: list[str], warnings: list[str]) -> Iterator[None]:
    """Add what a plug-in or a library prints to the lines of its job."""
    with redirect_stdout(io.StringIO()) as printed, redirect_stderr(io.StringIO()) as complained:
        try:
            yield
        finally:
            output += printed.getvalue().splitlines()
            warnings += complained.getvalue().splitlines()


def retarget_all(jobs: Sequence[Job], folder: Path, options: Options) -> list[Answer]:
    """Carry out all jobs whose results are not up to date; returns an answer for each job.

    Prints lines as results are finished, and failures and a summary at the end. A run that was killed goes
    on where it was. Raises BenchError where the folder cannot be used.
    """
    busy = f"{folder}: another bench retarget is writing into this folder; wait for it"
    with files.locked(folder / files.LOCK, busy):
        records = _read(folder / RECORDS)
        answers = dict(_answers(jobs, folder, records, options))
        lines = [_line(name, record) for name, record in sorted(records.items())]
        files.write_text(folder / RECORDS, "".join(lines))
    in_order = [answers[number] for number in range(len(jobs))]
    for job, answer in zip(jobs, in_order, strict=True):
        if answer.status == "failed":
            echo(f"bench: {job.out} was not made: {answer.error}", err=True)
    if not options.quiet:
        _summarise(jobs, in_order)
    return in_order


def _answers(
    jobs: Sequence[Job], folder: Path, records: dict[str, Record], options: Options
) -> Iterator[tuple[int, Answer]]:
    """(number of a job, its answer) in the order of completion, recorded and printed.

    A warning that an earlier job gave too is not repeated.
    """
    from tqdm import tqdm

    names = [job.out.relative_to(folder).as_posix() for job in jobs]
    orders = [(job, _old(job, records.get(name))) for job, name in zip(jobs, names, strict=True)]
    warned: set[str] = set()
    with progress_bar("retarget", "files tried", not options.quiet) as progress:
        each_job = partial(work, registry.files())
        for tried, done in enumerate(carried_out(each_job, orders, options.jobs), 1):
            answer = done.result or Answer("failed", error=done.error)
            if answer.status == "done" and answer.record is not None:
                records[names[done.number]] = answer.record
                _append(folder / RECORDS, _line(names[done.number], answer.record))
            with tqdm.external_write_mode():  # above a progress bar, where there is one
                for line in () if options.quiet else dict.fromkeys(answer.warnings):
                    if line not in warned:
                        echo(line, err=True)
                for line in () if options.quiet else answer.output:
                    echo(line)
            warned.update(answer.warnings)
            progress(tried, len(jobs))
            yield done.number, answer


def _old(job: Job, record: Record | None) -> Record | None:
    """The record of a result that is there with all that belongs to it, unless it is to be made anew."""
    there = all(each is None or each.is_file() for each in (job.out, job.preview))
    return record if there and not job.options.overwrite else None


def _summarise(jobs: Sequence[Job], answers: Sequence[Answer]) -> None:
    """The results with most to look at, and how many of which kind there are."""
    counts = Counter(each.status for each in answers)
    places = [
        (len(answer.verdict["places"]), job.out)
        for job, answer in zip(jobs, answers, strict=True)
        if answer.verdict and answer.verdict["places"]
    ]
    places.sort(key=lambda each: -each[0])
    for number, out in places[:SHOWN]:
        echo(f"look at {out}: {count(number, 'place')}")
    if len(places) > SHOWN:
        echo(f"look at {len(places) - SHOWN} more, none of them with more places")
    doubtful = sum(bool(each.verdict and each.verdict.get("doubts")) for each in answers)
    where = [
        f"{count(sum(number for number, _ in places), 'place')} to look at in {len(places)}"
        if places
        else "",
        f"all to look at in {doubtful}" if doubtful else "",
    ]
    found = f"{', '.join(filter(None, where))} of {len(answers)} results"
    echo(
        f"{counts['done']} retargeted, {counts['current']} up to date, {counts['failed']} failed; "
        f"{found if any(where) else 'nothing to look at'}"
    )


# -------------------------------------------------------------------------------------------- records
def _line(name: str, record: Record) -> str:
    """A record as a line of the file. name: the result's path in the folder."""
    return json.dumps({"result": name, **asdict(record)}) + "\n"


def _append(path: Path, line: str) -> None:
    try:
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(line)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error})") from error


def _read(path: Path) -> dict[str, Record]:
    """The records that can be read; the last line of a run that was killed may be cut off."""
    records: dict[str, Record] = {}
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return records
    for line in lines:
        try:
            entry = json.loads(line)
            records[entry["result"]] = Record(entry["key"], entry["verdict"], entry["content"])
        except (ValueError, KeyError, TypeError):
            continue
    return records


def key(job: Job) -> str:
    """A hash of all that decides a result: both files and how they are read, the method with its code and
    weights, what is edited.

    Raises BenchError where a file or the method cannot be read.
    """
    method = registry.canonical("methods", method_spec(job.options.method or defaults.METHOD))
    decisive = {
        "version": __version__,
        "source": [_content(job.source.path, stamp(job.source.path)), _stated(job.source.reading)],
        "target": [_content(job.target.path, stamp(job.target.path)), _stated(job.target.reading)],
        "method": str(bound.method(method).known_as),
        "code": bound.method(method).code,
        "edits": code_hash(package_code("motion.editing")),
        "options": {name: getattr(job.options, name) for name in _DECIDE},
    }
    return files.digest(json.dumps(decisive, sort_keys=True), 16)


def _stated(reading: Reading) -> dict[str, Any]:
    """The stated entries of a reading. Files in it count by their content, folders by their name."""
    return reading.stated | {
        name: file_hash(path) if path.is_file() else str(path) for name, path in reading.files.items()
    }


@lru_cache(maxsize=64)
def _content(path: Path, changed: object) -> str:
    """A hash of a motion file and of the files that it refers to."""
    own = split_take(path)[0]
    if changed is None or format_of(path) is BVH:
        return file_hash(own)
    try:
        return facts(path)[0]
    except BenchError:  # bones of an AMC file that an option names: their content counts with the option
        return file_hash(own)


def file_hash(path: Path) -> str:
    """The SHA-256 of a file. Raises FileError where it cannot be read."""
    files.check_ordinary(path)
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
