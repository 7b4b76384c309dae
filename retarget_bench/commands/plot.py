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
from retarget_bench.options import Names, OfBodies, OfMethods, OfSplits, listed, option
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.figures.data.model import Figure
    from retarget_bench.motion.motion import Motion
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.results.store import ResultPaths

KINDS = {
    "methods": "mpjpe_h.world",
    "pairs": "mpjpe_h.world",
    "growth": "growth.world",
    "recall": "pan_recall",
    "levels": "",
    "attention": "",
}
"""Kind of chart -> the value that it shows unless another is named."""
IN_HEIGHTS = "pan_recall_h"
"""The recall whose thresholds are in heights, which mean the same on every body."""
LEVELS = ("denoise", "joint-completion")
"""Tasks whose errors are drawn over their levels."""


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
@click.argument("kind", type=click.Choice(list(KINDS)))
@takes(Options)
def command(kind: str, options: Options) -> None:
    """Draw a chart of results, as .png, .pdf or .svg.

    \b
    methods    means with intervals; joined are those that the data cannot tell from the best
    pairs      errors by source and target, a heat map per method
    growth     how the error grows over the seconds of a clip
    recall     how many foot contacts are kept, over how slow a foot counts as planted (PAN's Figure 7);
               --columns pan_recall_h: thresholds in heights
    levels     the error over the levels of --task (HuMoT's Figures 8 and 9)
    attention  what one learned method attends to in --source, on its body and over time (PAN's Figure 8);
               -o FILE.csv has the numbers

    Learned methods have two lines of one colour over levels: full for structures that training had, dashed
    for others.
    """
    if kind == "attention":
        _attention(options)
        return
    from retarget_bench.figures import method_order
    from retarget_bench.figures.plotting import canvas
    from retarget_bench.figures.plotting.drawing import draw

    canvas.ending(options.out)
    places = _places(options, options.task if kind == "levels" else defaults.TASK)
    if methods := listed(options.methods):
        places = method_order.of_methods(places, methods)
    # colours are by rank among all results, so that they are the same in every picture
    ranked = method_order.ranked(method_order.everything(options.roots))
    page = canvas.Page(canvas.WIDTHS[options.width], not options.no_title, ranked)
    figure = (
        _levels(places, options.task, list(ranked))
        if kind == "levels"
        else _chart(kind, places, options, list(ranked))
    )
    draw(options.out, figure, page)
    echo(f"wrote {options.out}")


def _places(asked: Options, task: str) -> list[ResultPaths]:
    """The results asked for, of one data set and, of a task, with the same levels. Raises BenchError where
    there are none, or of several."""
    from retarget_bench.analysis.selection import of_splits
    from retarget_bench.results import dataset_names

    found = asked.places(task)
    if len(sets := dataset_names.listed(dataset_names.headers(found))) > 1:
        raise BenchError(
            f"these are results of several data sets: choose one by -d out of {', '.join(sets)}"
        )
    if len(folders := sorted({place.task for place in found})) > 1:
        found = [place for place in found if place.task == task]
        if not found:
            raise BenchError(
                f"these are results of {task} with several sets of levels or motions "
                f"({', '.join(folders)}): run the one to draw with an --out of its own, and give that"
            )
    return of_splits(found, listed(asked.splits))


def _chart(kind: str, places: Sequence[ResultPaths], asked: Options, order: Sequence[str]) -> Figure:
    """A chart of one value, all splits in one figure."""
    from retarget_bench.figures.data import bodies, lines, rows

    matrices = _matrices(places, asked)
    if kind == "recall":
        return lines.recall(matrices, by_height=listed(asked.columns) == (IN_HEIGHTS,), order=order)
    make = {"methods": rows.ties, "pairs": bodies.pairs, "growth": lines.growth}[kind]
    names = listed(asked.columns) or (KINDS[kind],)
    if len(names) > 1:
        raise BenchError(f"a chart shows one value; --columns names {len(names)}")
    return make(matrices, _value_id(matrices, names[0]), order=order)


def _levels(places: Sequence[ResultPaths], task: str, order: Sequence[str]) -> Figure:
    """The errors of a task by level; what training had and had not is drawn apart."""
    from retarget_bench.analysis import seen_unseen
    from retarget_bench.analysis.selection import Selection
    from retarget_bench.figures.data import lines
    from retarget_bench.results.result_matrix import result_matrices

    (matrix,) = map(_titled, Selection(variants=True, apart=False).parts(result_matrices(places)))
    make = lines.denoise if task == LEVELS[0] else lines.joint_completion
    return make(matrix, seen_unseen.seen_and_unseen(places, "level"), order)


def _matrices(places: Sequence[ResultPaths], asked: Options) -> list[ResultMatrix]:
    """The results between bodies of one group, without variants of methods unless asked, as in tables."""
    from retarget_bench.analysis.selection import Selection, of_bodies
    from retarget_bench.results.result_matrix import result_matrices

    variants = asked.variants or bool(asked.methods)
    chosen = Selection(variants=variants, apart=False).parts(result_matrices(places))
    return [_titled(each) for each in of_bodies(chosen, asked.bodies)]


def _titled(matrix: ResultMatrix) -> ResultMatrix:
    """The results with what they lack behind the name of their data set."""
    return replace(matrix, dataset=f"{matrix.dataset} ({matrix.so_far})") if matrix.so_far else matrix


def _value_id(matrices: Sequence[ResultMatrix], name: str) -> str:
    """The id that a value's name stands for; an id that no result has is for the chart to answer.

    Raises BenchError for a value of sets.
    """
    from retarget_bench.tables import names

    of_cases, of_sets = names.declared(matrices)
    known = of_cases | of_sets
    found = names.value_id(name, known) if names.candidates(name, known) else name
    if found in of_sets:
        names.check_of_cases(found, of_cases, of_sets)
    return found


# ------------------------------------------------------------------------------------------ attention
def _attention(asked: Options) -> None:
    """Draw what a learned method attends to in the source of a case, or in a motion file."""
    numbers = asked.out.suffix.lower() == ".csv"
    if not numbers and asked.out.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise BenchError(
            f"{asked.out}: attention is written as .png, .pdf, .svg or .csv; end the name in one"
        )
    if len(methods := listed(asked.methods)) != 1 or not asked.source:
        raise BenchError("name the one method by -m, and whose motion by --source CASE|FILE")
    times = _times(asked.at)
    from retarget_bench.evaluation import attention as asking
    from retarget_bench.figures.plotting import attention as picture
    from retarget_bench.python.plans import method_spec

    spec = method_spec(methods[0]).alone
    method = registry.create("methods", spec)
    motion = _source(asked)
    found = asking.ask(method, motion, spec.name)
    frames = asking.frames_at(times, motion)
    if numbers:
        asking.write(asked.out, found, motion, frames or range(motion.frames))
    else:
        shown = frames or picture.spread(motion.frames)
        picture.draw(asked.out, found, motion, shown, f"{spec.name}: {asked.source}")
    echo(f"wrote {asked.out}" + (f"; {found.note}" if found.note else ""))


def _times(at: Names) -> list[float]:
    """Seconds, from ``0.5,1,2``. Raises BenchError."""
    try:
        return [float(each) for each in listed(at)]
    except ValueError:
        raise BenchError(
            f"--at takes seconds with commas between them, such as 0.5,1,2; got {at}"
        ) from None


def _source(asked: Options) -> Motion:
    """The motion of a file, or the source of a case. Raises BenchError where there is neither, or it has no
    rotations."""
    from retarget_bench.motion import importer
    from retarget_bench.motion.motion import Motion
    from retarget_bench.plugins import bound, named
    from retarget_bench.viewer import results_library

    file = MotionFile.parse(asked.source)
    if results_library.are_files([str(file.path)]):
        found = importer.load(file.path, file.reading)
        for warning in found.findings.warnings:
            echo(f"{file.path}: {warning}", err=True)
        return found.motion
    data = bound.dataset(named.dataset(asked.dataset or defaults.DATASET)).built
    infos = {info.id: info for split in data.card.splits for info in data.cases(defaults.TASK, split)}
    case = results_library.matching(list(infos), asked.source)
    source = data.load(infos[case]).source
    if not isinstance(source, Motion):
        raise BenchError(
            f"the source of {case} is known by positions only, and has no rotations to attend to"
        )
    return source
