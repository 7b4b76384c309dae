"""``bench render``: a case or motion files as a clip, a still or a sheet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.python.plans import dataset_spec

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


SOURCE_OPTIONS = options.together(
    options.results_option,
    options.methods_option,
    click.option(
        "-d",
        "--dataset",
        metavar="DATASET",
        help="Only results of this data set (a folder name under RESULTS); with --ask, the data set.",
    ),
    click.option("--root", metavar="DIR", type=click.Path(), help="Where the data lie, if not as usual."),
    click.option(
        "--ask", is_flag=True, help="Ask the methods now, for a case of DATASET, and store nothing."
    ),
    options.task_option,
    click.option(
        "--hide",
        "hidden",
        multiple=True,
        type=click.Choice(["source", "reference"]),
        help="Leave the source or the reference out.",
    ),
)
"""Options that choose results and methods: the arguments of ``scene_of``."""


@click.command("render")
@click.argument("names", nargs=-1, required=True, metavar="CASE|FILE...")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="FILE",
    type=options.FILE,
    help=".mp4, .gif or .webp for a clip, .png for a still or a sheet.",
)
@SOURCE_OPTIONS
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
    FILE: motion files (walk.bvh, Fox.glb#Walk), or predictions with a motion file of their body.

    \b
    bench render 'rex>fox/dog_sit' -m ik -m copy_rotations -o sit.mp4
    bench render walk.bvh retargeted.bvh --overlay -o walk.gif
    bench render 'rex>fox/dog_sit' --sheet -o sit.png
    """
    from retarget_bench.viewer import clips, scene_builder
    from retarget_bench.viewer.renderer import DrawingStyle

    kind = clips.ending(output)
    if sheet and kind != clips.STILL:
        raise BenchError(f"{output}: a sheet is a still; end the name in {clips.STILL}")
    if fps is not None and every is not None:
        raise BenchError("--fps and --every both say which frames are shown; give one of them")
    scene = scene_of(names, **source)
    if skin:
        scene = scene_builder.dressed(scene)
    frames = chosen(scene, start, end, fps, every)
    look = DrawingStyle(size or (1280, 720), view, overlay, skin, camera)
    if sheet:
        written = write_sheet(output, scene, look, frames, columns, size)
    elif kind == clips.STILL:
        written = _still(output, scene, look, frames, frame)
    else:
        rate = fps or (scene.fps / every if every else min(scene.fps, FASTEST))
        written = write_clip(output, scene, look, frames, rate)
    for figure in scene.figures:
        if figure.message:
            said = figure.message if figure.status == "ok" else f"{figure.status}: {figure.message}"
            echo(f"{figure.label}: {said}", err=True)
    echo(f"wrote {output}: {written}")


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


def _still(
    output: Path, scene: Scene, look: DrawingStyle, frames: Sequence[int], number: int | None
) -> str:
    """number: of the frame, from 1; the middle one where it is not given. Raises BenchError for none."""
    from retarget_bench.viewer import clips
    from retarget_bench.viewer.drawing import Drawing

    frame = frames[len(frames) // 2] if number is None else number - 1
    if frame >= scene.frames:
        raise BenchError(f"{scene.title} has no frame {number}; its last is {scene.frames}")
    clips.write_still(output, Drawing(scene, look, [frame]).at(frame))
    return f"frame {frame + 1}, {look.size[0]} x {look.size[1]} pixels"


def write_sheet(
    output: Path,
    scene: Scene,
    look: DrawingStyle,
    frames: Sequence[int],
    columns: int,
    size: tuple[int, int] | None,
) -> str:
    from retarget_bench.viewer import clips, drawing

    shown = drawing.moments(frames, columns)
    if size is None:
        look = replace(look, size=drawing.usual_size(scene, len(shown), look.overlay))
    clips.write_still(output, drawing.sheet(scene, look, shown))
    return f"{len(shown)} moments, {look.size[0]} x {look.size[1]} pixels"


def write_clip(output: Path, scene: Scene, look: DrawingStyle, frames: Sequence[int], rate: float) -> str:
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


# what is shown
def scene_of(
    names: Sequence[str],
    *,
    results: Sequence[Path] = (),
    methods: Sequence[str] = (),
    dataset: str | None = None,
    root: str | None = None,
    task: str = "retarget",
    ask: bool = False,
    hidden: Sequence[str] = (),
) -> Scene:
    """The scene of a case, or of files, that a command's words describe. Raises BenchError."""
    from retarget_bench.viewer import results_library, scene_builder

    if results_library.are_files(names):
        found = _of_files(names, root)
    elif len(names) != 1:
        raise BenchError("one case is shown at a time; give one, or motion files")
    elif ask:
        found = _asked(names[0], methods, dataset, root, task)
    else:
        roots = results or (Path("runs"),)
        places = results_library.results(roots, task, dataset, methods)
        having, case_id = results_library.case(places, names[0])
        found = scene_builder.of_case(having, case_id, dataset=_moved(having, root))
        found = replace(found, colours=results_library.colours(roots))
    shown = [figure for figure in found.figures if figure.part not in hidden]
    return replace(found, figures=tuple(shown))


def _of_files(names: Sequence[str], root: str | None) -> Scene:
    """A stored prediction is shown with its case; other files as they are."""
    from retarget_bench.viewer import results_library, scene_builder

    paths = [Path(name) for name in names]
    stored = [each for path in paths if (each := results_library.place_of(path)) is not None]
    places = [place for place, _ in stored]
    if len(places) == len(paths) and len({case for _, case in stored}) == 1:
        found = scene_builder.of_case(places, stored[0][1], dataset=_moved(places, root))
        return replace(found, colours=results_library.colours({place.root for place in places}))
    return scene_builder.of_files(paths)


def _asked(
    name: str, methods: Sequence[str], dataset: str | None, root: str | None, task: str = "retarget"
) -> Scene:
    """A case of a data set with what methods answer now."""
    from retarget_bench.evaluation import plan
    from retarget_bench.plugins import bound
    from retarget_bench.viewer import results_library, scene_builder

    if not methods:
        raise BenchError("say which methods to ask: --ask -m METHOD")
    spec = dataset_spec(dataset or defaults.DATASET, root)
    asked = named.parse(task)
    data = plan.data_of(bound.dataset(spec), str(asked))
    ids = [info.id for split in data.card.splits for info in data.cases(asked.name, split)]
    return scene_builder.of_case_asked(
        spec, None, results_library.matching(ids, name), [named.parse(m) for m in methods], task=task
    )


def _moved(places: Sequence[Any], root: str | None) -> Any:
    """The data set of results, at the place where its data lie now; None where that was not said."""
    from retarget_bench.viewer import results_library

    if root is None:
        return None
    return results_library.read_stored(places[0]).dataset.with_parameters(root=root)
