"""One retargeting of a motion file to the character of another, from reading to writing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

from retarget_bench import defaults
from retarget_bench.commands import render
from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Motion
from retarget_bench.motion.editing.edits import compared
from retarget_bench.motion.files import format_of, split_take
from retarget_bench.motion.findings import counted_frames
from retarget_bench.motion.importer import Imported, load
from retarget_bench.motion.transfer import correspondence
from retarget_bench.options import Parallel, option
from retarget_bench.python import motions
from retarget_bench.python.motions import RetargetOptions
from retarget_bench.verification import verdict as verdicts
from retarget_bench.verification.verdict import Verdict

Say = Callable[[str], object]
"""Prints a line."""
BODIES = 4
"""Target characters that a process keeps for further jobs."""
OF_VERDICT = 4
"""Moments of a sheet, at most, that are those of the verdict."""


class Options(RetargetOptions, Parallel):
    """``bench retarget``."""

    out: str = option(
        "Output file, whose ending is its format; the folder of several results, or FOLDER/ of one; for "
        "scans a new folder of PLY files.",
        letter="o",
        metavar="FILE|FOLDER",
    )
    fps: float | None = option(
        "Frames per second.", default=None, shown="the source's; of scans 30", at_least=1, below=1001
    )
    format: str | None = option(
        "Of results in a folder: bvh, glb, ...",
        default=None,
        shown="the target's own, where it can be written",
        metavar="FORMAT",
    )
    overwrite: bool = option(
        "Redo results that are up to date, too, and replace the file of --report.", default=False
    )
    preview: Path | None = option(
        "Also draw source and result side by side: a clip (.mp4, .gif, .webp) or a sheet (.png). An ending "
        "alone, such as mp4, is for a file beside each result.",
        default=None,
        metavar="FILE",
    )
    report: Path | None = option("Also write the verdict as JSON.", default=None, metavar="FILE")
    quiet: bool = option("Print errors only.", default=False)


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


def retarget(job: Job, say: Say, warn: Say, judged: bool = True) -> Verdict | None:
    """Carry out a job and return the verdict; None where motions cannot be compared. Raises BenchError.

    say, warn: are given notes and a summary, and warnings. judged: whether anybody reads the verdict; where
    nobody does, and there is no preview, it is None too.
    """
    options = job.options
    motions.check_output(job.out, job.source.path, job.target.path)
    performer, body = load(job.source.path, job.source.reading), _target(job.target, stamp(job.target.path))
    for path, file in ((job.source.path, performer), (job.target.path, body)):
        for warning in file.findings.warnings:
            warn(f"{path}: {warning}")
    source, target = motions.imported(performer), motions.imported(body).character
    source = source if options.fps is None else source.resample(options.fps)
    answer = motions.answer(source, target, options)
    lost = motions.write(job.out, answer)
    for caution in motions.cautions(source, target, options):
        warn(f"bench: {caution}")
    for note in lost:
        warn(f"{job.out}: {note}")
    for note in answer.notes:
        say(note)
    followed = int((correspondence(source.character, target) >= 0).sum())
    say(
        f"{job.out}: {counted_frames(answer.frames)} of {source.character.name} at {source.fps:g} per "
        f"second on the body of {target.name}, by {options.method or defaults.METHOD}; "
        f"{followed} of {len(target.skeleton)} joints follow it; {_units(job, body)}"
    )
    if not judged and job.preview is None:
        return None
    compared_source, verdict = compared(source, options), None
    try:
        verdict = verdicts.verdict(compared_source, answer)
    except BenchError as error:
        warn(f"bench: {error}")
    if job.preview is not None:
        _preview(job.preview, compared_source, answer, verdict)
        say(f"{job.preview}: source and result side by side")
    return verdict


@lru_cache(maxsize=BODIES)
def _target(file: MotionFile, changed: object) -> Imported:
    """The target's file; kept for the next job. changed: see ``stamp``.

    Motion of joints below its root is dropped without a warning, since only the body counts.
    """
    del changed
    reading = file.reading
    if reading.inner_positions == "auto":
        reading = replace(reading, inner_positions="drop")
    return load(file.path, reading)


def stamp(path: Path) -> tuple[int, int] | None:
    """Time and size of a motion file, by which a changed one is noticed; None for one that is not there."""
    try:
        facts = split_take(path)[0].stat()
    except OSError:
        return None
    return facts.st_mtime_ns, facts.st_size


def _units(job: Job, body: Imported) -> str:
    """Unit and up axis of the file that was written."""
    same_format = format_of(job.target.path) is format_of(job.out)
    new = ("m", "z" if job.out.suffix.lower() == ".npz" else "y")
    unit, up = (body.findings.unit[0], body.findings.up) if same_format else new
    return f"unit {unit}, {up} up"


def _preview(path: Path, source: Motion, result: Motion, verdict: Verdict | None) -> None:
    """A clip of both motions, or a sheet of moments where the name ends in .png, the worst of the verdict
    among them; with skins where there are meshes. Raises BenchError."""
    from tqdm import tqdm

    from retarget_bench.viewer import clips, scene_builder
    from retarget_bench.viewer.renderer import DrawingStyle

    scene = scene_builder.of_motions([source, result], ["source", "result"])
    scene = replace(scene, title=f"{source.character.name} to {result.character.name}")
    style = DrawingStyle((1280, 720), skin=True)
    frames = render.chosen(scene, 0.0, None, None)
    if clips.ending(path) == clips.STILL:
        render.write_sheet(path, scene, style, _moments(frames, verdict), None)
    else:
        bar = partial(tqdm, desc="draw", unit="frame", leave=False, disable=None)
        render.write_clip(path, scene, style, frames, min(scene.fps, render.FASTEST), bar)


def _moments(frames: Sequence[int], verdict: Verdict | None) -> list[int]:
    """The worst frames of the verdict, and others evenly spread."""
    from retarget_bench.viewer import drawing

    worst = list(dict.fromkeys(each.worst for each in (verdict.defects if verdict else ())))[:OF_VERDICT]
    return sorted({*worst, *drawing.moments(frames, render.MOMENTS - len(worst))})
