"""A call of ``bench retarget``, of one result or of many, with what is written beside results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from retarget_bench import defaults
from retarget_bench.commands import motion_files
from retarget_bench.commands.retargeting import batch, plan, previews, role_maps
from retarget_bench.commands.retargeting.job import Job, retarget
from retarget_bench.commands.retargeting.records import FILES, NAME
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable, write_text
from retarget_bench.motion.files import split_take
from retarget_bench.motion.findings import Findings
from retarget_bench.plugins import registry
from retarget_bench.python import motions
from retarget_bench.python.plans import method_spec

FAILED = 2
"""Exit code where any result could not be made."""
_REPORT = b'{\n "version": 1'
"""How the file of a report begins."""


@dataclass(frozen=True)
class Wanted:
    """Options that do not change the motion of a result.

    ending:   of results in a folder, without a dot; None: the target's own. jobs: processes.
    overwrite: redo what is up to date, and replace role maps and what --report names.
    preview, report, save_map: files, None for none.
    """

    ending: str | None
    jobs: int
    overwrite: bool
    preview: Path | None
    report: Path | None
    save_map: Path | None
    quiet: bool


def one(like: Job, wanted: Wanted) -> int:
    """One source onto one target, into a file. Raises BenchError."""
    if wanted.ending is not None:
        raise BenchError(
            f"--format {wanted.ending} is for results in a folder; the ending of {like.out} says it"
        )
    motions.check_output(like.out, like.source, like.target)
    shown = previews.path_of(wanted.preview, like.out, several=False)
    job = replace(like, preview=shown)
    _check_beside([job], wanted)
    _save_maps([job], wanted)
    judged = not wanted.quiet or wanted.report is not None or shown is not None
    verdict = retarget(job, wanted.quiet, judged)
    if verdict is not None and not wanted.quiet:
        echo(verdict.text())
    _report(wanted, [_entry(job, "done", None if verdict is None else verdict.as_dict())])
    return 0


def many(sources: Sequence[Path], targets: Sequence[Path], like: Job, wanted: Wanted) -> int:
    """Every source onto every target, into a folder. Raises BenchError where nothing can be done."""
    registry.canonical("methods", method_spec(like.method or defaults.METHOD))  # one error, not one a job
    jobs = plan.jobs(sources, targets, like, wanted.ending, wanted.preview)
    _check_beside(jobs, wanted)
    _save_maps(jobs, wanted)
    answers = batch.retarget_all(
        jobs, like.out, wanted.jobs, overwrite=wanted.overwrite, quiet=wanted.quiet
    )
    entries = (
        _entry(job, each.status, each.verdict, each.error) for job, each in zip(jobs, answers, strict=True)
    )
    _report(wanted, list(entries))
    return FAILED if any(each.status == "failed" for each in answers) else 0


def scans(like: Job, wanted: Wanted) -> int:
    """One scan onto one mesh, into a new folder. Raises BenchError."""
    from retarget_bench.commands.retargeting import scans

    given = {"--format": wanted.ending, "--preview": wanted.preview, "--report": wanted.report}
    for option, value in {**given, "--save-map": wanted.save_map}.items():
        if value is not None:
            raise BenchError(f"{option} is for motion files; scans have no skeleton")
    scans.retarget(like, wanted.quiet)
    return 0


def _check_beside(jobs: Sequence[Job], wanted: Wanted) -> None:
    """Raises BenchError where a result, report, map or preview cannot be written, or one that is written
    beside results would take the place of another file of the call."""
    taken = {path.resolve(): what for job in jobs for path, what in _files(job)}
    taken |= {(job.out.parent / NAME).resolve(): "the record of results" for job in jobs}
    maps = [] if wanted.save_map is None else [wanted.save_map, role_maps.of_target(wanted.save_map)]
    beside: list[tuple[str, Path | None]] = [("--save-map", each) for each in maps]
    beside += [("--report", wanted.report)]
    beside += [("--preview", path) for path in dict.fromkeys(job.preview for job in jobs)]
    for option, path in beside:
        if path is None:
            continue
        if what := taken.get(path.resolve()):
            raise BenchError(f"{option} would overwrite {path}, {what}; choose another name")
        taken[path.resolve()] = f"which {option} writes"
    if wanted.report is not None and not (wanted.overwrite or _may_hold_report(wanted.report)):
        raise BenchError(
            f"--report would overwrite {wanted.report}, which is no report; choose another name, or say "
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
    yield split_take(job.source)[0], "a source"
    yield split_take(job.target)[0], "a target"
    yield job.out, "a result"
    for name in FILES:
        if job.options.get(name) is not None:
            yield Path(job.options[name]), f"which --{name.replace('_', '-')} names"


def _entry(job: Job, status: str, verdict: Mapping[str, Any] | None, error: str = "") -> Mapping[str, Any]:
    """A result in a report."""
    files = {"result": job.out, "source": job.source, "target": job.target}
    named = {name: str(path) for name, path in files.items()}
    return {**named, "status": status, "error": error, **(verdict or {})}


def _report(wanted: Wanted, entries: Sequence[Mapping[str, Any]]) -> None:
    if wanted.report is None:
        return
    text = json.dumps({"version": 1, "results": entries}, indent=1, ensure_ascii=False)
    write_text(wanted.report, text + "\n")
    if not wanted.quiet:
        echo(f"wrote {wanted.report}")


def _save_maps(jobs: Sequence[Job], wanted: Wanted) -> None:
    """Role maps of all files that can be read; of the others their jobs say what is wrong."""
    if wanted.save_map is None:
        return
    sources = _findings(jobs, "")
    targets = _findings(jobs, "target")
    for line in role_maps.save(wanted.save_map, list(sources), list(targets), wanted.overwrite):
        if not wanted.quiet:
            echo(line)


def _findings(jobs: Sequence[Job], side: str) -> Iterator[Findings]:
    files = dict.fromkeys(job.target if side else job.source for job in jobs)
    for path in files:
        try:
            yield motion_files.imported(path, jobs[0].options, side, quiet=True).findings
        except BenchError:
            if len(jobs) == 1:
                raise
