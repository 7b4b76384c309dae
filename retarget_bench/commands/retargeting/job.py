"""One retargeting of a motion file to the character of another, from reading to writing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from retarget_bench import defaults
from retarget_bench.commands import editing_options, motion_files
from retarget_bench.commands.retargeting import previews
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.motion import files as formats
from retarget_bench.motion.character import Motion
from retarget_bench.motion.editing.edits import compared
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

    source, target: files; a take may stand behind a ``#``.
    method:  None: the usual one.
    fps:     of the source; None: its own rate.
    options: all others that decide the result, by the names that the command has for them: those of
             reading (``motion_files.reading_options``, both sides) and of editing
             (``editing_options``).
    preview: a picture or clip of source and result.
    """

    source: Path
    target: Path
    out: Path
    method: str | None = None
    seed: int = 0
    fps: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    preview: Path | None = None


def retarget(job: Job, quiet: bool = False, judged: bool = True) -> Verdict | None:
    """Carry out a job, print warnings, notes and a summary, and return the verdict; None where there can be
    none, or it is not to be ``judged``. quiet: print nothing. Raises BenchError."""
    method = job.method or defaults.METHOD
    motions.check_output(job.out, job.source, job.target)
    source = motions.imported(motion_files.imported(job.source, job.options, quiet=quiet))
    source = source if job.fps is None else source.resample(job.fps)
    body, target = _target(job, quiet)
    edits = editing_options.asked_edits(job.options)
    answer = motions.answer(source, target, method, job.seed, edits)
    lost = motions.write(job.out, answer)
    if not quiet:
        for caution in (
            *motions.cautions(method, source.character, target),
            *motions.doubts(source, edits),
        ):
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
    seen = compared(source, edits)
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


def _target(job: Job, quiet: bool) -> tuple[Imported, motions.Character]:
    """The target's file, and its character; kept for the next job."""
    asked = tuple(sorted((name, each) for name, each in job.options.items() if name.startswith("target_")))
    roles = job.options.get("target_roles")
    stamps = tuple(_stamp(each) for each in (formats.split_take(job.target)[0], roles and Path(roles)))
    return _read_target(job.target, asked, stamps, quiet)


@lru_cache(maxsize=BODIES)
def _read_target(
    path: Path, asked: tuple[tuple[str, Any], ...], stamps: object, quiet: bool
) -> tuple[Imported, motions.Character]:
    del stamps
    found = motion_files.imported(path, dict(asked), "target", quiet=quiet)
    character = motions.imported(found).character
    assert isinstance(character, motions.Character)
    return found, character


def _stamp(path: Path | None) -> tuple[int, int] | None:
    """Time and size of a file, by which a changed one is noticed; None for one that is not there."""
    try:
        return path and ((facts := path.stat()).st_mtime_ns, facts.st_size)  # type: ignore[return-value]
    except OSError:
        return None


def _units(job: Job, body: Imported) -> str:
    """Unit and up axis of the file that was written."""
    kept = formats.format_of(job.target) is formats.format_of(job.out)
    new = ("m", "z" if job.out.suffix.lower() == ".npz" else "y")
    unit, up = (body.findings.unit[0], body.findings.up) if kept else new
    return f"unit {unit}, {up} up"
