"""``bench render``: a case or motion files as a clip, a still or a sheet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.options import FILES, OfResults, takes
from retarget_bench.errors import BenchError
from retarget_bench.options import Names, OfMethods, WithData, listed, option
from retarget_bench.plugins import named

if TYPE_CHECKING:
    from PIL.Image import Image

    from retarget_bench.results.store import ResultPaths
    from retarget_bench.viewer.renderer import DrawingStyle
    from retarget_bench.viewer.scene import Scene
    from retarget_bench.viewer.scene_builder import Over

MOMENTS = 8
"""Columns of a sheet."""
FASTEST = 30.0
"""Pictures per second of a clip, unless more are asked for."""


class Options(OfResults, OfMethods, WithData):
    """``bench render``."""

    out: Path = option(
        ".mp4, .gif or .webp for a clip, .png for a still or a sheet.", letter="o", metavar="FILE"
    )
    task: str = option("Results of this task.", default=defaults.TASK)
    ask: bool = option("Ask the methods now, for a case of --dataset, and store nothing.", default=False)
    hide: Names = option("Leave these out: source, reference.", default=(), metavar="FIGURE")
    overlay: bool = option("All figures in one picture, not side by side.", default=False)
    sheet: bool = option("A sheet (.png): a row per figure, a column per moment.", default=False)
    view: Literal["three-quarter", "front", "side"] = option("From where.", default="three-quarter")
    skin: bool = option("Skinned meshes, where bodies have one.", default=False)
    size: str = option("Pixels.", default="", shown="1280x720; sheets: as needed", metavar="WxH")
    fps: float | None = option(
        "Pictures per second.", default=None, shown="at most 30", at_least=1, metavar="N"
    )
    start: float = option("From here.", default=0.0, at_least=0, metavar="SECONDS")
    end: float | None = option("To here.", default=None, shown="all", at_least=0, metavar="SECONDS")
    frame: int | None = option(
        "Of a still, counted from 1 as in the player.",
        default=None,
        shown="the middle",
        at_least=1,
        metavar="N",
    )

    @property
    def pixels(self) -> tuple[int, int] | None:
        """``1280x720`` as two numbers. Raises BenchError."""
        if not self.size:
            return None
        width, cross, height = self.size.lower().partition("x")
        if not (cross and width.strip().isdecimal() and height.strip().isdecimal()):
            raise BenchError(f"a size is WIDTHxHEIGHT, such as 1280x720; got {self.size!r}")
        return int(width), int(height)


@click.command("render")
@click.argument("names", nargs=-1, required=True, metavar="CASE|FILE...", shell_complete=FILES)
@takes(Options)
def command(names: tuple[str, ...], options: Options) -> None:
    """Write a clip, a still or a sheet of a case of stored results, or of motion files; no display needed.

    CASE is a case's id, or a part of it that no other case has (in quotes: > means something to a shell).
    FILE: motion files (walk.bvh, Fox.glb#Walk), or predictions with a motion file of their body.

    \b
    bench render 'rex>fox/dog_sit' -m ik -m copy_rotations -o sit.mp4
    bench render walk.bvh retargeted.bvh --overlay -o walk.gif
    bench render 'rex>fox/dog_sit' --sheet -o sit.png
    """
    from retarget_bench.python.progress import stepped
    from retarget_bench.viewer import clips, scene_builder
    from retarget_bench.viewer.renderer import DrawingStyle

    out, kind, size = options.out, clips.ending(options.out), options.pixels
    if options.sheet and kind != clips.STILL:
        raise BenchError(f"{out}: a sheet is a still; end the name in {clips.STILL}")
    if options.frame is not None and (options.sheet or kind != clips.STILL):
        raise BenchError(f"{out}: --frame is of a still; a clip or a sheet takes --start and --end")
    with stepped("bench render") as over:
        scene = scene_of(names, options, over)
        if options.skin:
            scene = scene_builder.dressed(scene, over)
        frames = chosen(scene, options.start, options.end, options.fps)
        style = DrawingStyle(size or (1280, 720), options.view, options.overlay, options.skin)
        if options.sheet:
            written = write_sheet(out, scene, style, frames, size)
        elif kind == clips.STILL:
            written = _still(out, scene, style, frames, options.frame)
        else:
            written = write_clip(out, scene, style, frames, options.fps or min(scene.fps, FASTEST), over)
    for figure in scene.figures:
        if figure.message:
            message = figure.message if figure.status == "ok" else f"{figure.status}: {figure.message}"
            echo(f"{figure.label}: {message}", err=True)
    echo(f"wrote {out}: {written}")


def chosen(scene: Scene, start: float, end: float | None, fps: float | None) -> list[int]:
    """The frames of a scene that are shown. Raises BenchError where there are none."""
    last = (scene.frames - 1) / scene.fps
    if start > last or (end is not None and end < start):
        to = "the end" if end is None else f"{end:g} s"
        raise BenchError(f"{scene.title} lasts {last:.2f} s; there is nothing from {start:g} s to {to}")
    first = math.ceil(start * scene.fps - 1e-6)
    final = scene.frames - 1 if end is None else min(math.floor(end * scene.fps + 1e-6), scene.frames - 1)
    step = scene.fps / (fps or min(scene.fps, FASTEST))
    count = math.floor((final - first) / step + 1e-6) + 1
    return [first + round(number * step) for number in range(max(count, 1))]


def _still(
    output: Path, scene: Scene, style: DrawingStyle, frames: Sequence[int], number: int | None
) -> str:
    """Write one frame. number: of the frame, from 1; None: the middle one. Raises BenchError where there is
    no such frame."""
    from retarget_bench.viewer import clips
    from retarget_bench.viewer.drawing import Drawing

    frame = frames[len(frames) // 2] if number is None else number - 1
    if frame >= scene.frames:
        raise BenchError(f"{scene.title} has no frame {number}; its last is {scene.frames}")
    clips.write_still(output, Drawing(scene, style, [frame]).at(frame))
    return f"frame {frame + 1}, {style.size[0]} x {style.size[1]} pixels"


def write_sheet(
    output: Path,
    scene: Scene,
    style: DrawingStyle,
    frames: Sequence[int],
    size: tuple[int, int] | None,
) -> str:
    from retarget_bench.viewer import clips, drawing

    shown = drawing.moments(frames, MOMENTS)
    if size is None:
        style = replace(style, size=drawing.usual_size(scene, len(shown), style.overlay))
    clips.write_still(output, drawing.sheet(scene, style, shown))
    return f"{len(shown)} moments, {style.size[0]} x {style.size[1]} pixels"


def write_clip(
    output: Path, scene: Scene, style: DrawingStyle, frames: Sequence[int], rate: float, over: Over
) -> str:
    from retarget_bench.viewer import clips
    from retarget_bench.viewer.drawing import Drawing

    clips.check_length(output, style.size, len(frames))
    picture = Drawing(scene, style, frames)

    def drawn() -> Iterator[Image]:
        for frame in over(frames):
            yield picture.at(frame)

    clips.write_clip(output, drawn(), rate)
    return (
        f"{len(frames)} pictures of {style.size[0]} x {style.size[1]} pixels, {rate:g} per second, "
        f"{len(frames) / rate:.1f} s"
    )


# -------------------------------------------------------------------------------------- what is shown
def scene_of(names: Sequence[str], options: Options, over: Over = iter) -> Scene:
    """The scene of a case or of files. Raises BenchError."""
    from retarget_bench.figures import method_order
    from retarget_bench.viewer import results_library

    methods, hidden = listed(options.methods), listed(options.hide)
    if unknown := [each for each in hidden if each not in ("source", "reference")]:
        raise BenchError(f"--hide leaves out source or reference; got {unknown[0]!r}")
    if results_library.are_files(names):
        scene = _of_files(names, options.root)
    elif len(names) != 1:
        raise BenchError("one case is shown at a time; give one, or motion files")
    elif options.ask:
        scene = _answered(names[0], methods, options, over)
    else:
        places = options.places(options.task)
        places = method_order.of_methods(places, methods) if methods else places
        scene = _of_results(*results_library.case(places, names[0]), options.roots, options.root)
    return replace(scene, figures=tuple(each for each in scene.figures if each.part not in hidden))


def _of_files(names: Sequence[str], root: str | None) -> Scene:
    """A stored prediction is shown with its case; other files as they are."""
    from retarget_bench.viewer import results_library, scene_builder

    paths = [Path(name) for name in names]
    stored = [each for path in paths if (each := results_library.place_of(path)) is not None]
    places = [place for place, _ in stored]
    if len(places) == len(paths) and len({case for _, case in stored}) == 1:
        return _of_results(places, stored[0][1], [place.root for place in places], root)
    return scene_builder.of_files(paths)


def _of_results(places: Sequence[ResultPaths], case: str, roots: Sequence[Path], root: str | None) -> Scene:
    """A case of stored results, in the colours of all results under ``roots``. root: where its data lie
    now, if not as usual."""
    from retarget_bench.viewer import results_library, scene_builder

    stored = results_library.read_stored(places[0]).dataset
    moved = None if root is None else stored.with_parameters(root=root)
    scene = scene_builder.of_case(places, case, dataset=moved)
    return replace(scene, colours=results_library.colours(roots))


def _answered(name: str, methods: Sequence[str], options: Options, over: Over) -> Scene:
    """A case of a data set with new answers of methods."""
    from retarget_bench.evaluation import tasks
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.python.plans import method_spec
    from retarget_bench.viewer import scene_builder

    if not methods:
        raise BenchError("say which methods to ask: --ask -m METHOD")
    data = named.dataset(options.dataset or defaults.DATASET, options.root)
    task = tasks.canonical(Spec.parse(options.task))
    return scene_builder.of_case_asked(
        data, name, list(map(method_spec, methods)), task=str(task), over=over
    )
