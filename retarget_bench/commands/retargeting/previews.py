"""Pictures and clips of a source and its result, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from retarget_bench.commands import render
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Motion
from retarget_bench.verification.verdict import Verdict
from retarget_bench.viewer import clips, drawing, scene_builder
from retarget_bench.viewer.renderer import DrawingStyle

OF_VERDICT = 4
"""Moments of a picture, at most, that are those of the verdict."""
SIZE = (1280, 720)


def path_of(asked: Path | None, out: Path, *, several: bool) -> Path | None:
    """The file of a result's preview. asked: a file, or an ending alone (``mp4``), for one beside the
    result. Raises BenchError for another ending, and for a file where there are several results."""
    if asked is None:
        return None
    text = str(asked)
    if text.lstrip(".").lower() in {each.lstrip(".") for each in clips.ENDINGS}:
        found = out.with_name(f"{out.stem}.preview.{text.lstrip('.').lower()}")
    elif several:
        known = ", ".join(each.lstrip(".") for each in clips.ENDINGS)
        raise BenchError(
            f"--preview {asked}: several results have a preview each, beside them; say what it is: {known}"
        )
    else:
        found = asked
    clips.ending(found)
    return found


def write(path: Path, source: Motion, result: Motion, verdict: Verdict | None) -> None:
    """A clip of both motions, or a sheet of moments where the name ends in .png, the worst of the verdict
    among them; with skins where there are meshes. Raises BenchError."""
    scene = scene_builder.of_motions([source, result], ["source", "result"])
    title = f"{source.character.name} to {result.character.name}"
    scene = replace(scene, title=title)
    style = DrawingStyle(SIZE, skin=True)
    frames = render.chosen(scene, 0.0, None, None)
    if clips.ending(path) == clips.STILL:
        render.write_sheet(path, scene, style, _moments(frames, verdict), None)
    else:
        render.write_clip(path, scene, style, frames, min(scene.fps, render.FASTEST))


def _moments(frames: Sequence[int], verdict: Verdict | None) -> list[int]:
    """The worst frames of the verdict, and others evenly spread."""
    worst = dict.fromkeys(each.worst for each in (verdict.defects if verdict else ()))
    chosen = list(worst)[:OF_VERDICT]
    return sorted({*chosen, *drawing.moments(frames, render.MOMENTS - len(chosen))})
