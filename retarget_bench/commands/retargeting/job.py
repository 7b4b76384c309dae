"""One retargeting of a motion file to the character of another, from reading to writing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.commands.retargeting import previews
from retarget_bench.commands.retargeting.options import Options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Motion
from retarget_bench.motion.editing.edits import compared, doubts
from retarget_bench.motion.files import format_of, split_take
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.importer import Imported
from retarget_bench.motion.transfer import correspondence
from retarget_bench.python import motions
from retarget_bench.verification.verdict import Verdict, verdict

BODIES = 4
"""Target characters that a process keeps for further jobs."""


@dataclass(frozen=True)
class Job:
    """A source onto a target, as plain data that can be sent to another process.

    options: those that decide the result count: the method, its seed, the rate and what is edited.
    preview: a picture or clip of source and result.
    """

    source: MotionFile
    target: MotionFile
    out: Path
    options: Options
    preview: Path | None = None


def retarget(job: Job, judged: bool = True) -> Verdict | None:
    """Carry out a job, print warnings, notes and a summary, and return the verdict; None where there can be
    none, or it is not to be ``judged``. Raises BenchError."""
    options, quiet = job.options, job.options.quiet
    method = options.method or defaults.METHOD
    motions.check_output(job.out, job.source.path, job.target.path)
    source = motions.imported(job.source.load(quiet))
    source = source if options.fps is None else source.resample(options.fps)
    body = _target(job.target, _stamp(split_take(job.target.path)[0]), quiet)
    target = motions.imported(body).character
    answer = motions.answer(source, target, method, options.seed, options)
    lost = motions.write(job.out, answer)
    if not quiet:
        for caution in (*motions.cautions(method, source.character, target), *doubts(source, options)):
            echo(f"bench: {caution}", err=True)
        for note in answer.notes:
            echo(note)
        for note in lost:
            echo(f"{job.out}: {note}", err=True)
        followed = int((correspondence(source.character, target) >= 0).sum())
        echo(
            f"{job.out}: {counted_frames(answer.frames)} of {source.character.name} at {source.fps:g} per "
            f"second on the body of {target.name}, by {method}; "
            f"{followed} of {len(target.skeleton)} joints follow it; {_units(job, body)}"
        )
    seen = compared(source, options)
    found = _judged(seen, answer, quiet) if judged else None
    if job.preview is not None:
        previews.write(job.preview, seen, answer, found)
        if not quiet:
            echo(f"{job.preview}: source and result side by side")
    return found


def _judged(source: Motion, answer: motions.Motion, quiet: bool) -> Verdict | None:
    """The verdict; None, and a line that says why, where motions cannot be compared."""
    try:
        return verdict(source, answer)
    except BenchError as error:
        if not quiet:
            echo(f"bench: {error}", err=True)
        return None


@lru_cache(maxsize=BODIES)
def _target(file: MotionFile, stamp: object, quiet: bool) -> Imported:
    """The target's file; kept for the next job. stamp: by which a changed one is noticed.

    Of what joints below its root do nothing is said: only the body counts.
    """
    del stamp
    if file.reading.inner_positions == "auto":
        file = replace(file, reading=replace(file.reading, inner_positions="drop"))
    return file.load(quiet)


def _stamp(path: Path) -> tuple[int, int] | None:
    """Time and size of a file; None for one that is not there."""
    try:
        facts = path.stat()
    except OSError:
        return None
    return facts.st_mtime_ns, facts.st_size


def _units(job: Job, body: Imported) -> str:
    """Unit and up axis of the file that was written."""
    kept = format_of(job.target.path) is format_of(job.out)
    new = ("m", "z" if job.out.suffix.lower() == ".npz" else "y")
    unit, up = (body.findings.unit[0], body.findings.up) if kept else new
    return f"unit {unit}, {up} up"
