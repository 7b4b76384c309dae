"""A call of ``bench retarget``, of one result or of many, with what is written beside results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from retarget_bench import defaults
from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.commands.retargeting import batch, plan, previews
from retarget_bench.commands.retargeting.job import Job, retarget
from retarget_bench.commands.retargeting.options import Options
from retarget_bench.commands.retargeting.records import NAME
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable, write_text
from retarget_bench.motion.files import split_take
from retarget_bench.plugins import registry
from retarget_bench.python import motions
from retarget_bench.python.plans import method_spec

FAILED = 2
"""Exit code where any result could not be made."""
_REPORT = b'{\n "version": 1'
"""How the file of a report begins."""


def one(job: Job) -> int:
    """One source onto one target, into a file. Raises BenchError."""
    options = job.options
    if options.format is not None:
        raise BenchError(
            f"--format {options.format} is for results in a folder; the ending of {job.out} says it"
        )
    motions.check_output(job.out, job.source.path, job.target.path)
    job = replace(job, preview=previews.path_of(options.preview, job.out, several=False))
    _check_beside([job], options)
    judged = not options.quiet or options.report is not None or job.preview is not None
    verdict = retarget(job, judged)
    if verdict is not None and not options.quiet:
        echo(verdict.text())
    _report(options, [_entry(job, "done", None if verdict is None else verdict.as_dict())])
    return 0


def many(sources: Sequence[MotionFile], targets: Sequence[MotionFile], options: Options) -> int:
    """Every source onto every target, into a folder. Raises BenchError where nothing can be done."""
    method = method_spec(options.method or defaults.METHOD)
    registry.canonical("methods", method)  # one error, not one a job
    jobs = plan.jobs(sources, targets, options)
    _check_beside(jobs, options)
    answers = batch.retarget_all(jobs, Path(options.out), options)
    entries = (
        _entry(job, each.status, each.verdict, each.error) for job, each in zip(jobs, answers, strict=True)
    )
    _report(options, list(entries))
    return FAILED if any(each.status == "failed" for each in answers) else 0


def _check_beside(jobs: Sequence[Job], options: Options) -> None:
    """Raises BenchError where a result, report or preview cannot be written, or one that is written beside
    results would take the place of another file of the call."""
    taken = {path.resolve(): what for job in jobs for path, what in _files(job)}
    taken |= {(job.out.parent / NAME).resolve(): "the record of results" for job in jobs}
    beside: list[tuple[str, Path | None]] = [("--report", options.report)]
    beside += [("--preview", path) for path in dict.fromkeys(job.preview for job in jobs)]
    for option, path in beside:
        if path is None:
            continue
        if what := taken.get(path.resolve()):
            raise BenchError(f"{option} would overwrite {path}, {what}; choose another name")
        taken[path.resolve()] = f"which {option} writes"
    if options.report is not None and not (options.overwrite or _may_hold_report(options.report)):
        raise BenchError(
            f"--report would overwrite {options.report}, which is no report; choose another name, or say "
            "--overwrite"
        )
    results = {job.out.parent: job.out for job in jobs}.values()  # of a folder one is enough
    for path in (*results, *(each for _, each in beside if each is not None)):
        check_writable(path)


def _may_hold_report(path: Path) -> bool:
    """Whether there is nothing at a path that is not an earlier report."""
    try:
        with path.open("rb") as file:
            start = file.read(len(_REPORT))
    except OSError:  # not there, or said when it is written
        return True
    return start in (b"", _REPORT)


def _files(job: Job) -> Iterator[tuple[Path, str]]:
    """What a job reads and writes, in words."""
    yield job.out, "a result"
    for file, what in ((job.source, "a source"), (job.target, "a target")):
        yield split_take(file.path)[0], what
        for name, path in file.reading.files.items():
            yield path, f"the {name} of {what}"


def _entry(job: Job, status: str, verdict: Mapping[str, Any] | None, error: str = "") -> Mapping[str, Any]:
    """A result in a report."""
    files = {"result": job.out, "source": job.source.path, "target": job.target.path}
    named = {name: str(path) for name, path in files.items()}
    return {**named, "status": status, "error": error, **(verdict or {})}


def _report(options: Options, entries: Sequence[Mapping[str, Any]]) -> None:
    if options.report is None:
        return
    text = json.dumps({"version": 1, "results": entries}, indent=1, ensure_ascii=False)
    write_text(options.report, text + "\n")
    if not options.quiet:
        echo(f"wrote {options.report}")
