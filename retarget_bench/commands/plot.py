"""``bench plot``: a chart of results as a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.motion_files import MotionFile
from retarget_bench.commands.options import OfResults, takes
from retarget_bench.errors import BenchError
from retarget_bench.options import Names, OfBodies, OfMethods, OfSplits, declared, listed, option
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.figures.data.model import Figure
    from retarget_bench.figures.data.values import Styles
    from retarget_bench.motion.motion import Motion
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.results.store import ResultPaths

KINDS = ("methods", "growth", "recall", "levels", "attention")
IN_HEIGHTS = "pan_recall_h"
"""The recall whose thresholds are in heights, which mean the same on every body."""
OF_KINDS = {
    "columns": ("methods", "growth", "recall"),
    "task": ("levels",),
    "source": ("attention",),
    "at": ("attention",),
}
"""Option -> the kinds that it is for, where it is not for all."""


class Options(OfResults, OfMethods, OfSplits, OfBodies):
    """``bench plot``."""

    out: Path = option("The picture: .pdf, .png or .svg.", letter="o", metavar="FILE")
    variants: bool = option("Show variants of methods, too.", default=False)
    columns: Names = option("The value to draw.", default=(), shown="MPJPE", metavar="ID")
    task: Literal["denoise", "joint-completion"] = option(
        "The task whose levels are drawn.", default="denoise"
    )
    width: Literal["column", "page"] = option(
        "How wide, in a two-column paper: one column (3.25 inches) or the page (6.75).", default="page"
    )
    no_title: bool = option("Leave the title to the paper's caption.", default=False)
    source: str = option(
        "Of attention: the motion, a case's id of the data set or a motion file.",
        default="",
        metavar="CASE|FILE",
    )
    at: Names = option(
        "Of attention: when to show the body.", default=(), shown="five times", metavar="SECONDS,..."
    )


@click.command("plot")
@click.argument("kind", type=click.Choice(KINDS))
@takes(Options)
def command(kind: str, options: Options) -> None:
    """Draw a chart of results, as .png, .pdf or .svg.

    \b
    methods    means with intervals; joined are those that the data cannot tell from the best
    growth     how the error grows over the seconds of a clip
    recall     how many foot contacts are kept, over how slow a foot counts as planted (PAN's Figure 7);
               --columns pan_recall_h: thresholds in heights
    levels     the error over the levels of --task (HuMoT's Figures 8 and 9)
    attention  what one learned method attends to in --source, on its body and over time (PAN's Figure 8);
               -o FILE.csv has the numbers

    Controls, and variants of methods, are left out unless -m names them, or --variants asks for variants.
    Learned methods have two lines of one colour over levels: full for structures that training had, dashed
    for others.
    """
    for name, kinds in OF_KINDS.items():
        if kind not in kinds and getattr(options, name) != declared(Options)[name].default:
            raise BenchError(f"--{name} is for bench plot {', '.join(kinds)}, and not for {kind}")
    if kind == "attention":
        _attention(options)
        return
    from retarget_bench.figures import method_order
    from retarget_bench.figures.plotting import canvas, drawing

    canvas.ending(options.out)
    places = _places(options, options.task if kind == "levels" else defaults.TASK)
    if methods := listed(options.methods):
        places = method_order.of_methods(places, methods)
    # colours are by rank among all results, so that they are the same in every picture
    ranked = method_order.ranked(method_order.everything(options.roots))
    named = list(method_order.labels(places).values()) if methods else ()
    styles = method_order.styles(ranked, named, variants=options.variants)
    figure = _chart(kind, places, options, styles)
    drawing.draw(options.out, figure, styles, canvas.WIDTHS[options.width], titled=not options.no_title)
    echo(f"wrote {options.out}")


def _places(options: Options, task: str) -> list[ResultPaths]:
    """The results asked for, of one data set and, of a task, with the same levels. Raises BenchError where
    there are none, or of several."""
    from retarget_bench.analysis.selection import of_splits
    from retarget_bench.results import dataset_names

    places = options.places(task)
    if len(datasets := dataset_names.listed(dataset_names.headers(places))) > 1:
        raise BenchError(
            f"these are results of several data sets: choose one by -d out of {', '.join(datasets)}"
        )
    if len(folders := sorted({place.task for place in places})) > 1:
        places = [place for place in places if place.task == task]
        if not places:
            raise BenchError(
                f"these are results of {task} with several sets of levels or motions "
                f"({', '.join(folders)}): run the one to draw with an --out of its own, and give that"
            )
    return of_splits(places, listed(options.splits))


def _chart(kind: str, places: Sequence[ResultPaths], options: Options, styles: Styles) -> Figure:
    """A chart of one value, all splits in one figure; in levels of a task what training had and had not is
    drawn apart. As in tables, variants of methods are not shown unless asked for."""
    from retarget_bench.analysis.seen_unseen import seen_and_unseen
    from retarget_bench.analysis.selection import Selection, of_bodies
    from retarget_bench.figures.data import lines, rows
    from retarget_bench.results.result_matrix import result_matrices

    variants = options.variants or bool(options.methods) or kind == "levels"
    matrices = [
        replace(each, dataset=f"{each.dataset} ({each.so_far})") if each.so_far else each
        for each in Selection(variants=variants, apart=False).parts(result_matrices(places))
    ]
    if kind == "levels":
        (matrix,) = matrices
        draw_levels = lines.denoise if options.task == "denoise" else lines.joint_completion
        return draw_levels(matrix, styles, seen_and_unseen(places, "level"))
    matrices, columns = of_bodies(matrices, options.bodies), listed(options.columns)
    if kind == "recall":
        if columns not in ((), (IN_HEIGHTS,)):
            raise BenchError(
                f"recall is drawn over speeds, or over heights by --columns {IN_HEIGHTS}; "
                f"got {', '.join(columns)}"
            )
        return lines.recall(matrices, styles, by_height=columns == (IN_HEIGHTS,))
    if len(columns) > 1:
        raise BenchError(f"a chart shows one value; --columns names {len(columns)}")
    (name,) = columns or ("growth.world" if kind == "growth" else "mpjpe_h.world",)
    make = rows.ties if kind == "methods" else lines.growth
    return make(matrices, _value_id(matrices, name), styles)


def _value_id(matrices: Sequence[ResultMatrix], name: str) -> str:
    """The id that a value's name stands for; the chart refuses an id that no result has.

    Raises BenchError for a value of sets.
    """
    from retarget_bench.tables import names

    of_cases, of_sets = names.declared(matrices)
    values = of_cases | of_sets
    value_id = names.value_id(name, values) if names.candidates(name, values) else name
    if value_id in of_sets:
        names.check_of_cases(value_id, of_cases, of_sets)
    return value_id


# ------------------------------------------------------------------------------------------ attention
def _attention(options: Options) -> None:
    """Draw what a learned method attends to in the source of a case, or in a motion file."""
    out = options.out
    if out.suffix.lower() not in (".png", ".pdf", ".svg", ".csv"):
        raise BenchError(f"{out}: attention is written as .png, .pdf, .svg or .csv; end the name in one")
    if len(methods := listed(options.methods)) != 1 or not options.source:
        raise BenchError("name the one method by -m, and whose motion by --source CASE|FILE")
    try:
        seconds = list(map(float, listed(options.at)))
    except ValueError:
        raise BenchError(
            f"--at takes seconds with commas between them, such as 0.5,1,2; got {options.at}"
        ) from None
    from retarget_bench.evaluation import attention
    from retarget_bench.figures.plotting import attention as picture
    from retarget_bench.python.plans import method_spec

    spec = method_spec(methods[0]).alone
    method = registry.create("methods", spec)
    motion = _source(options)
    answer = attention.ask(method, motion, spec.name)
    frames = attention.frames_at(seconds, motion)
    if out.suffix.lower() == ".csv":
        attention.write(out, answer, motion, frames or range(motion.frames))
    else:
        title = f"{spec.name}: {options.source}"
        picture.draw(out, answer, motion, frames or picture.spread(motion.frames), title)
    echo(f"wrote {out}" + (f"; {answer.note}" if answer.note else ""))


def _source(options: Options) -> Motion:
    """The motion of a file, or the source of a case. Raises BenchError where there is neither, or it has no
    rotations."""
    from retarget_bench.motion import importer
    from retarget_bench.motion.motion import Motion
    from retarget_bench.plugins import bound, named
    from retarget_bench.viewer import results_library

    file = MotionFile.parse(options.source)
    if results_library.are_files([str(file.path)]):
        imported = importer.load(file.path, file.reading)
        for warning in imported.findings.warnings:
            echo(f"{file.path}: {warning}", err=True)
        return imported.motion
    data = bound.dataset(named.dataset(options.dataset or defaults.DATASET)).built
    infos = {info.id: info for split in data.card.splits for info in data.cases(defaults.TASK, split)}
    case = results_library.matching(list(infos), options.source)
    source = data.load(infos[case]).source
    if not isinstance(source, Motion):
        raise BenchError(
            f"the source of {case} is known by positions only, and has no rotations to attend to"
        )
    return source
