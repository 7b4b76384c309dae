"""``bench retarget``: a motion in, a motion out; one of them, or many into a folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.motion_files import MOTION_FILE, MotionFile
from retarget_bench.commands.options import takes
from retarget_bench.commands.retargeting import batch, plan, scans
from retarget_bench.commands.retargeting.job import Job, Options, Say, retarget
from retarget_bench.errors import BenchError
from retarget_bench.files import check_writable, write_text
from retarget_bench.motion.files import split_take
from retarget_bench.plugins import registry
from retarget_bench.python.plans import method_spec

FAILED = 2
"""Exit code where any result could not be made."""
_REPORT = b'{\n "version": 1'
"""How the file of a report begins."""


@click.command("retarget")
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True, type=MOTION_FILE)
@click.option(
    "--target",
    "targets",
    required=True,
    multiple=True,
    metavar="FILE|FOLDER",
    type=MOTION_FILE,
    help="File of the target character, or a folder of such files; may be repeated. For scans its mesh in "
    "T-pose.",
)
@takes(Options)
def command(sources: tuple[MotionFile, ...], targets: tuple[MotionFile, ...], options: Options) -> int:
    """Retarget the motion of SOURCE, a motion file, a folder of them or a folder of scans, to another
    character.

    A result of the target file's format keeps all of it: joints, names, channels, unit and axes, in a GLB
    also mesh, materials and other animations. A result of another format is in metres, Y up. Joint
    positions are converted to rotations by a fit, whose residual is printed. A line warns where the method
    is known to be worse than the default one on bodies like these, and where the source begins with
    something else than its motion. Loops stay loops.

    The verdict at the end lists frames to look at: knees and elbows that snap, feet in the floor or
    sliding, joints beyond the source's speed, limbs that point elsewhere, hands in the body. It says what
    is a guess, where all is to be looked at.

    How a file is read is found from it, and said in brackets where that is wrong, or in a file that bench
    doctor writes, of sources and targets alike; bench doctor --help lists what can be said.

    Several sources or targets give OUT/TARGET/SOURCE.ext, of one target OUT/SOURCE.ext, and so does one
    source where OUT is a folder or ends in a slash. The same command again does what is new or has changed,
    and goes on where it was interrupted.

    Scans are mesh or point files, one for each frame (PLY, OBJ, GLB, STL, OFF). The target is then a mesh
    file, and the result a folder of PLY files with its vertices and faces, in metres, Y up.

    \b
    bench retarget walk.bvh --target me.glb -o out.glb --preview out.mp4
    bench retarget mocap/ --target me.glb --target you.bvh -o out/ --jobs 4
    bench retarget 'walk.bvh[unit=cm,up=z]' --target 'me.glb[reading=me.toml]' -o out.glb
    """
    first = Job(sources[0], targets[0], Path(options.out), options)
    if plan.are_scans(sources, targets):
        return scans.retarget(first)
    if plan.is_many(sources, targets, options.out):
        return _many(sources, targets, options)
    return _one(first)


def _one(job: Job) -> int:
    """One source onto one target, into a file. Raises BenchError."""
    options = job.options
    if options.format is not None:
        raise BenchError(
            f"--format {options.format} is for results in a folder; the ending of {job.out} says it"
        )
    job = replace(job, preview=plan.preview_of(options.preview, job.out, several=False))
    _check_beside([job], options)
    say: Say = _ignore if options.quiet else echo
    warn: Say = _ignore if options.quiet else partial(echo, err=True)
    verdict = retarget(job, say, warn, judged=not options.quiet or options.report is not None)
    if verdict is not None and not options.quiet:
        echo(verdict.text())
    _report(options, [_entry(job, "done", None if verdict is None else verdict.as_dict())])
    return 0


def _ignore(line: str) -> None:
    """Take a line that ``--quiet`` keeps from being printed."""


def _many(sources: Sequence[MotionFile], targets: Sequence[MotionFile], options: Options) -> int:
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
    """Raises BenchError where a result, report or preview cannot be written, or a report or preview would
    replace another file of the call."""
    owners = {path.resolve(): what for job in jobs for path, what in _files(job)}
    owners |= {(job.out.parent / batch.RECORDS).resolve(): "the record of results" for job in jobs}
    beside: list[tuple[str, Path | None]] = [("--report", options.report)]
    beside += [("--preview", path) for path in dict.fromkeys(job.preview for job in jobs)]
    for option, path in beside:
        if path is None:
            continue
        if what := owners.get(path.resolve()):
            raise BenchError(f"{option} would overwrite {path}, {what}; choose another name")
        owners[path.resolve()] = f"which {option} writes"
    if options.report is not None and not (options.overwrite or _may_hold_report(options.report)):
        raise BenchError(
            f"--report would overwrite {options.report}, which is no report; choose another name, or say "
            "--overwrite"
        )
    results = {job.out.parent: job.out for job in jobs}.values()  # of a folder one is enough
    for path in (*results, *(each for _, each in beside if each is not None)):
        check_writable(path)


def _may_hold_report(path: Path) -> bool:
    """True for a path that is free or holds an earlier report."""
    try:
        with path.open("rb") as file:
            start = file.read(len(_REPORT))
    except OSError:  # not there, or said when it is written
        return True
    return start in (b"", _REPORT)


def _files(job: Job) -> Iterator[tuple[Path, str]]:
    """The files that a job reads and writes, each with a description."""
    yield job.out, "a result"
    for file, what in ((job.source, "a source"), (job.target, "a target")):
        yield split_take(file.path)[0], what
        for name, path in file.reading.files.items():
            yield path, f"the {name} of {what}"


def _entry(job: Job, status: str, verdict: Mapping[str, Any] | None, error: str = "") -> Mapping[str, Any]:
    """A result in a report."""
    files = {"result": job.out, "source": job.source.path, "target": job.target.path}
    paths = {name: str(path) for name, path in files.items()}
    return {**paths, "status": status, "error": error, **(verdict or {})}


def _report(options: Options, entries: Sequence[Mapping[str, Any]]) -> None:
    if options.report is None:
        return
    text = json.dumps({"version": 1, "results": entries}, indent=1, ensure_ascii=False)
    write_text(options.report, text + "\n")
    if not options.quiet:
        echo(f"wrote {options.report}")
