"""One retargeting of a motion file to the character of another, from reading to writing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from retarget_bench import defaults
from retarget_bench.commands import editing_options, motion_files
from retarget_bench.motion import files as formats
from retarget_bench.motion.editing import loops
from retarget_bench.motion.importer import Imported
from retarget_bench.motion.transfer import correspondence
from retarget_bench.python import motions


@dataclass(frozen=True)
class Job:
    """A source onto a target, as plain data that can be sent to another process.

    source, target: files; a take may stand behind a ``#``.
    method:  None: the usual one.
    fps:     of the source; None: its own rate.
    options: all others that decide the result, by the names that the command has for them: those of
             reading (``motion_files.reading_options``, both sides) and of editing
             (``editing_options``).
    """

    source: Path
    target: Path
    out: Path
    method: str | None = None
    seed: int = 0
    fps: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)


def retarget(job: Job, quiet: bool) -> None:
    """Carry out a job, and print warnings, notes and the summary. Raises BenchError."""
    method = job.method or defaults.METHOD
    motions.check_output(job.out, job.source, job.target)
    performer = motion_files.imported(job.source, job.options, quiet=quiet)
    body = motion_files.imported(job.target, job.options, "target", quiet=quiet)
    source, target = performer.motion, motions.imported(body).character
    source = source if job.fps is None else loops.resampled(source, job.fps)
    edits = editing_options.asked_edits(job.options)
    answer = motions.answer(source, target, method, job.seed, edits)
    lost = motions.write(job.out, answer)
    if quiet:
        return
    for caution in (*motions.cautions(method, source.character, target), *motions.doubts(source, edits)):
        click.echo(f"bench: {caution}", err=True)
    for note in answer.notes:
        click.echo(note)
    for note in lost:
        click.echo(f"{job.out}: {note}", err=True)
    followed = int((correspondence(source.character, target) >= 0).sum())
    click.echo(
        f"{job.out}: {answer.frames} frames of {source.character.name} at {source.fps:g} per second on the "
        f"body of {target.name}, by {method}; {followed} of {len(target.skeleton)} joints follow "
        f"it; {_units(job, body)}"
    )


def _units(job: Job, body: Imported) -> str:
    """Unit and up axis of the file that was written."""
    kept = formats.format_of(job.target) is formats.format_of(job.out)
    unit, up = (body.findings.unit[0], body.findings.up) if kept else ("m", "y")
    return f"unit {unit}, {up} up"
