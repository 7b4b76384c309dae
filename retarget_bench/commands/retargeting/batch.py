"""Many retargetings in processes: what is done is left, and what fails costs its own line."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from retarget_bench import files
from retarget_bench.commands.retargeting.job import Job, retarget
from retarget_bench.commands.retargeting.options import Options
from retarget_bench.commands.retargeting.records import Record, Records, file_hash, key
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.parallel import carried_out
from retarget_bench.plugins import registry
from retarget_bench.python.progress import progress_bar

Status = Literal["done", "current", "failed"]
_HALF_WRITTEN = re.compile(r"\.[0-9a-f]{12}\.(.+)", re.DOTALL)
"""Names of the temporary files of ``files.atomic``."""
SHOWN = 10
"""Results that the summary names at most, those with most to look at."""


@dataclass(frozen=True)
class Order:
    """A job for a process. made: the key of the result that is there, "" for none that counts."""

    job: Job
    made: str
    plugins: tuple[tuple[str, registry.Kind], ...]


@dataclass(frozen=True)
class Answer:
    """What became of a job, with what it printed. verdict: as JSON has it."""

    status: Status
    key: str = ""
    verdict: Mapping[str, Any] | None = None
    said: str = ""
    warned: str = ""
    error: str = ""


def work(order: Order) -> Answer:
    """Carry out an order, in a process of the pool."""
    registry.know_files(order.plugins)
    said, warned = io.StringIO(), io.StringIO()
    try:
        now = key(order.job)
        if now == order.made:
            return Answer("current", now)
        with redirect_stdout(said), redirect_stderr(warned):
            found = retarget(order.job)
    except BenchError as error:
        return Answer("failed", warned=warned.getvalue(), error=str(error))
    if found is None:
        return Answer("done", now, None, said.getvalue(), warned.getvalue())
    lines = "".join(f"{line}\n" for line in (*found.lines, found.summary))
    followers = f"{order.job.target.path.name}: {found.followers}\n" if found.undriven else ""
    verdict = found.as_dict()
    return Answer("done", now, verdict, said.getvalue() + lines, warned.getvalue() + followers)


def retarget_all(jobs: Sequence[Job], folder: Path, options: Options) -> list[Answer]:
    """Carry out all jobs that are not done yet; an answer for each, those done before with their verdict.

    Prints lines as results are finished, and failures and a summary at
    the end. A run that was killed goes on where it was. Raises BenchError where the folder cannot be used.
    """
    busy = f"{folder}: another bench retarget is writing into this folder; wait for it"
    with files.locked(folder / files.LOCK, busy):
        _clear(jobs)
        records = Records(folder)
        made = [_made(job, records, options.overwrite) for job in jobs]
        orders = [Order(job, old, registry.files()) for job, old in zip(jobs, made, strict=True)]
        answers = dict(_answers(jobs, orders, records, options))
        records.tidy()
    found = [answers[number] for number in range(len(jobs))]
    _say_failures(jobs, found)
    if not options.quiet:
        _summarise(jobs, found)
    return found


def _answers(
    jobs: Sequence[Job], orders: Sequence[Order], records: Records, options: Options
) -> Iterator[tuple[int, Answer]]:
    """Number of a job and its answer, as they come, recorded and printed."""
    warned: set[str] = set()
    quiet = options.quiet
    with progress_bar("retarget", "files tried", not quiet) as progress:
        for count, done in enumerate(carried_out(work, orders, options.jobs), 1):
            job = jobs[done.number]
            answer = done.result or Answer("failed", error=done.error)
            if answer.status == "done":
                records.add(job.out, Record(answer.key, answer.verdict, file_hash(job.out)))
            elif answer.status == "current":
                record = records.of(job.out)
                answer = Answer("current", answer.key, None if record is None else record.verdict)
            with _beside_bar():
                _print(answer, warned, quiet)
            progress(count, len(jobs))
            yield done.number, answer


def _clear(jobs: Sequence[Job]) -> None:
    """Remove what a killed run left half-written beside results and previews."""
    names = {path.name[-40:] for job in jobs for path in (job.out, job.preview) if path is not None}
    for folder in {job.out.parent for job in jobs}:
        for path in folder.glob(".*"):
            left = _HALF_WRITTEN.fullmatch(path.name)
            if left and left[1] in names:
                path.unlink(missing_ok=True)


def _made(job: Job, records: Records, overwrite: bool) -> str:
    """The key of a result that is there with all that belongs to it, else ""."""
    record = records.of(job.out)
    there = all(each is None or each.is_file() for each in (job.out, job.preview))
    if not record or not there or overwrite:
        return ""
    return record.key if file_hash(job.out) == record.content else ""


def _print(answer: Answer, warned: set[str], quiet: bool) -> None:
    """What a job printed; a warning that an earlier one gave too is not repeated."""
    if quiet:
        return
    for line in answer.warned.splitlines():
        if line not in warned:
            warned.add(line)
            echo(line, err=True)
    echo(answer.said, nl=False)


@contextmanager
def _beside_bar() -> Iterator[None]:
    """Lines printed in here stand above a progress bar, where there is one."""
    from tqdm import tqdm

    with tqdm.external_write_mode():
        yield


def _say_failures(jobs: Sequence[Job], answers: Sequence[Answer]) -> None:
    for job, answer in zip(jobs, answers, strict=True):
        if answer.status == "failed":
            echo(f"bench: {job.out} was not made: {answer.error}", err=True)


def _summarise(jobs: Sequence[Job], answers: Sequence[Answer]) -> None:
    """The results with most to look at, and how many of which kind there are."""
    counts = Counter(each.status for each in answers)
    found = [
        (len(each.verdict["places"]), job.out)
        for job, each in zip(jobs, answers, strict=True)
        if each.verdict and each.verdict["places"]
    ]
    found.sort(key=lambda each: -each[0])
    for count, out in found[:SHOWN]:
        echo(f"look at {out}: {_places(count)}")
    if len(found) > SHOWN:
        echo(f"look at {len(found) - SHOWN} more, none of them with more places")
    total = sum(count for count, _ in found)
    where = f" in {len(found)} of {len(answers)} results" if found else ""
    echo(
        f"{counts['done']} retargeted, {counts['current']} up to date, {counts['failed']} failed; "
        f"{_places(total) if found else 'nothing'} to look at{where}"
    )


def _places(count: int) -> str:
    return f"{count} place{'s' * (count > 1)}"
