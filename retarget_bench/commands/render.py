"""``bench render``: a case or motion files as a clip, a still or a sheet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench.commands.scene_options import scene_of, source_options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from PIL.Image import Image

    from retarget_bench.viewer.renderer import DrawingStyle
    from retarget_bench.viewer.scene import Scene

VIEWS = ("three-quarter", "front", "side")
FASTEST = 30.0
"""Pictures per second of a clip, unless more are asked for."""


def _size(ctx: click.Context, param: click.Parameter, text: str | None) -> tuple[int, int] | None:
    """``1280x720`` as two numbers."""
    if text is None:
        return None
    width, cross, height = text.lower().partition("x")
    if not (cross and width.strip().isdecimal() and height.strip().isdecimal()):
        raise click.BadParameter(f"a size is WIDTHxHEIGHT, such as 1280x720; got {text!r}", ctx, param)
    return int(width), int(height)


@click.command("render")
@click.argument("names", nargs=-1, required=True, metavar="CASE|FILE...")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help=".mp4, .gif or .webp for a clip, .png for a still or a sheet.",
)
@source_options
@click.option("--overlay", is_flag=True, help="All figures in one picture, not side by side.")
@click.option("--sheet", is_flag=True, help="A sheet (.png): a row per figure, a column per moment.")
@click.option("--columns", type=click.IntRange(1, 24), default=8, show_default=True, help="Of a sheet.")
@click.option("--view", type=click.Choice(VIEWS), default=VIEWS[0], show_default=True, help="From where.")
@click.option(
    "--camera",
    type=click.Choice(["auto", "fit", "follow"]),
    default="auto",
    show_default=True,
    help="fit stands still and sees all; follow goes along; auto follows who goes far.",
)
@click.option("--skin", is_flag=True, help="Skinned meshes, where bodies have one.")
@click.option(
    "--size", callback=_size, metavar="WxH", help="Pixels. [default: 1280x720; sheets: as needed]"
)
@click.option("--fps", type=click.FloatRange(1, 240), help="Pictures per second. [default: at most 30]")
@click.option("--every", type=click.IntRange(1), metavar="N", help="Every N-th frame of the motion.")
@click.option("--start", type=click.FloatRange(0), default=0.0, metavar="SECONDS", help="From here.")
@click.option("--end", type=click.FloatRange(0), metavar="SECONDS", help="To here. [default: all]")
@click.option(
    "--frame",
    type=click.IntRange(1),
    metavar="N",
    help="Of a still, counted from 1 as in the player. [default: the middle]",
)
def command(
    names: tuple[str, ...],
    output: Path,
    overlay: bool,
    sheet: bool,
    columns: int,
    view: str,
    camera: Any,
    skin: bool,
    size: tuple[int, int] | None,
    fps: float | None,
    every: int | None,
    start: float,
    end: float | None,
    frame: int | None,
    **source: Any,
) -> None:
    """Write a clip, a still or a sheet of a case of stored results, or of motion files; no display needed.

    CASE is a case's id, or a part of it that no other case has (in quotes: > means something to a shell).
    FILE: BVH files, or predictions with the BVH file of their body.

    \b
    bench render 'rex>fox/dog_sit' -m ik -m copy_rotations -o sit.mp4
    bench render walk.bvh retargeted.bvh --overlay -o walk.gif
    bench render 'rex>fox/dog_sit' --sheet -o sit.png
    """
    from retarget_bench.viewer import clips
    from retarget_bench.viewer.renderer import DrawingStyle

    kind = clips.ending(output)
    if sheet and kind != clips.STILL:
        raise BenchError(f"{output}: a sheet is a still; end the name in {clips.STILL}")
    if fps is not None and every is not None:
        raise BenchError("--fps and --every both say which frames are shown; give one of them")
    scene = scene_of(names, **source)
    frames = chosen(scene, start, end, fps, every)
    look = DrawingStyle(size or (1280, 720), view, overlay, skin, camera)
    if sheet:
        written = _sheet(output, scene, look, frames, columns, size)
    elif kind == clips.STILL:
        written = _still(output, scene, look, _one(scene, frames, frame))
    else:
        rate = fps or (scene.fps / every if every else min(scene.fps, FASTEST))
        written = _clip(output, scene, look, frames, rate)
    for figure in scene.figures:
        if figure.message:
            said = figure.message if figure.status == "ok" else f"{figure.status}: {figure.message}"
            click.echo(f"{figure.label}: {said}", err=True)
    click.echo(f"wrote {output}: {written}")


def chosen(
    scene: Scene, start: float, end: float | None, fps: float | None, every: int | None
) -> list[int]:
    """The frames of a scene that are shown. Raises BenchError where there are none."""
    last = (scene.frames - 1) / scene.fps
    if start > last or (end is not None and end < start):
        to = "the end" if end is None else f"{end:g} s"
        raise BenchError(f"{scene.title} lasts {last:.2f} s; there is nothing from {start:g} s to {to}")
    first = math.ceil(start * scene.fps - 1e-6)
    final = scene.frames - 1 if end is None else min(math.floor(end * scene.fps + 1e-6), scene.frames - 1)
    step = every or scene.fps / (fps or min(scene.fps, FASTEST))
    count = math.floor((final - first) / step + 1e-6) + 1
    return [first + round(number * step) for number in range(max(count, 1))]


def _one(scene: Scene, frames: Sequence[int], frame: int | None) -> int:
    """The frame of a still. Raises BenchError for one that there is not."""
    if frame is None:
        return frames[len(frames) // 2]
    if frame > scene.frames:
        raise BenchError(f"{scene.title} has no frame {frame}; its last is {scene.frames}")
    return frame - 1


def _still(output: Path, scene: Scene, look: DrawingStyle, frame: int) -> str:
    from retarget_bench.viewer import clips
    from retarget_bench.viewer.drawing import Drawing

    clips.write_still(output, Drawing(scene, look, [frame]).at(frame))
    return f"frame {frame + 1}, {look.size[0]} x {look.size[1]} pixels"


def _sheet(
    output: Path,
    scene: Scene,
    look: DrawingStyle,
    frames: Sequence[int],
    columns: int,
    size: tuple[int, int] | None,
) -> str:
    from dataclasses import replace

    from retarget_bench.viewer import clips, drawing

    shown = drawing.moments(frames, columns)
    if size is None:
        look = replace(look, size=drawing.usual_size(scene, len(shown), look.overlay))
    clips.write_still(output, drawing.sheet(scene, look, shown))
    return f"{len(shown)} moments, {look.size[0]} x {look.size[1]} pixels"


def _clip(output: Path, scene: Scene, look: DrawingStyle, frames: Sequence[int], rate: float) -> str:
    from tqdm import tqdm

    from retarget_bench.viewer import clips
    from retarget_bench.viewer.drawing import Drawing

    clips.check_length(output, look.size, len(frames))
    picture = Drawing(scene, look, frames)

    def drawn() -> Iterator[Image]:
        for frame in tqdm(frames, desc="draw", unit="frame", leave=False, disable=None):
            yield picture.at(frame)

    clips.write_clip(output, drawn(), rate)
    return (
        f"{len(frames)} pictures of {look.size[0]} x {look.size[1]} pixels, {rate:g} per second, "
        f"{len(frames) / rate:.1f} s"
    )
