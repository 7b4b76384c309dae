"""The charts of a chapter, with headings and reading help."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from markupsafe import Markup

from retarget_bench.analysis import seen_unseen
from retarget_bench.errors import BenchError
from retarget_bench.figures.data import joints, lines, rows
from retarget_bench.figures.data.model import Chart, Figure, Mark, NothingToDraw
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.plotting import canvas, page_svg
from retarget_bench.report.chapters import Chapter
from retarget_bench.tables.model import Column, count
from retarget_bench.viewer.scene_builder import Over

JOINTS = "mpjpe_h.joint"
Styles = Mapping[str, MethodStyle]


@dataclass(frozen=True)
class Picture:
    """Charts with a heading.

    name:   part of the anchor. reading: how to read it, in a sentence or two.
    panels: a heading ("" for none) and its charts, small multiples of each other.
    scale:  what the scale of errors goes up to, in words, where colours mean errors; "" otherwise.
    """

    name: str
    title: str
    reading: str
    panels: tuple[tuple[str, tuple[Markup, ...]], ...]
    scale: str = ""


def figures(chapter: Chapter, styles: Styles) -> dict[str, list[Figure]]:
    """Kind -> its charts, of the kinds that say something of these results, in reading order.

    styles: of all methods, by rank.
    """
    figures_of: dict[str, list[Figure]] = {}

    def add(make: Callable[..., Figure], *arguments: Any) -> None:
        with suppress(NothingToDraw):
            figure = make(*arguments, styles)
            if _informative(figure):
                figures_of.setdefault(figure.kind, []).append(figure)

    matrices = [split.matrix for split in chapter.splits]
    if chapter.kind in ("denoise", "joint-completion"):
        make = lines.denoise if chapter.kind == "denoise" else lines.joint_completion
        for matrix in matrices:
            add(partial(make, halves=_halves(chapter)), matrix)
    for compared in (rows.clips, rows.kinds):
        for split in chapter.splits:
            add(compared, [split.matrix], split.main.id)
    if isinstance(chapter.bodies, Mapping):
        for matrix in matrices[::-1]:  # of the hardest split that has them
            if "joints" not in figures_of:
                add(joints.skeletons, matrix, JOINTS, chapter.bodies)
    add(lines.recall, matrices)
    add(lines.growth, matrices, "growth.world")
    for split in chapter.splits:
        add(rows.speed, [split.matrix], split.main.id)
    return figures_of


def _halves(chapter: Chapter) -> list[seen_unseen.SeenPart]:
    """Results of trained methods on structures seen and unseen; none where results do not say which."""
    try:
        return seen_unseen.seen_and_unseen(chapter.places, "level")
    except BenchError:
        return []


def _informative(figure: Figure) -> bool:
    """True where charts say more than the table: of kinds of several clips, of seconds or methods."""
    match figure.kind:
        case "kinds":
            marks = [mark for chart in figure.charts for each in chart.series for mark in each.marks]
            several = sum(mark.mean.clips > 1 for mark in marks)
            return 2 * several > len(marks) and any(len(chart.at.ticks) > 1 for chart in figure.charts)
        case "growth":
            return any(len(each.marks) > 1 for chart in figure.charts for each in chart.series)
        case "speed":
            return any(len(chart.series) > 1 for chart in figure.charts)
    return bool(figure.charts or figure.skeletons)


# ---------------------------------------------------------------------------------------------- pictures
def pictures(chapter: Chapter, styles: Styles, name: str, over: Over = iter) -> list[Picture]:
    """All pictures of a chapter; styles: of all methods, by rank; name: of the chapter, for ids."""
    columns = {column.id: column for split in chapter.splits for column in split.values}
    say = partial(_words, columns=columns, decimals=chapter.splits[0].decimals)
    kinds = figures(chapter, styles)
    return [_picture(kind, kinds[kind], styles, f"{name}-{kind}", say) for kind in over(kinds)]


def _words(mark: Mark, columns: Mapping[str, Column], decimals: Mapping[str, int]) -> str:
    """The number of a mark with its interval, and of how many cases it is."""
    mean, value = mark.mean, mark.cases.value
    digits, unit = decimals.get(value, 3), columns[value].unit if value in columns else ""
    text = f"{mean.value:.{digits}f}" + (f" {unit}" if unit not in ("", "1") else "")
    if mean.interval is not None:
        text += f", interval {mean.interval.low:.{digits}f} to {mean.interval.high:.{digits}f}"
    return text if mean.n == 1 else f"{text}, {count(mean.n, 'case')} of {count(mean.clips, 'clip')}"


def _picture(
    kind: str, figures: list[Figure], styles: Styles, name: str, say: Callable[[Mark], str]
) -> Picture:
    panels: dict[str, list[Markup]] = {}
    charts: list[Chart] = [chart for figure in figures for chart in figure.charts]
    panels[""] = [
        page_svg.chart(chart, styles, f"{name}-{number}", say) for number, chart in enumerate(charts)
    ]
    scale = ""
    for number, each in enumerate(each for figure in figures for each in figure.skeletons):
        heading = f"{each.split}, structure {each.structure}, drawn as {each.body}"
        panels.setdefault(heading, []).append(page_svg.skeleton(each, styles, f"{name}-{number}", say))
        scale = f"{each.errors.high:.3g} and more, {each.errors.label}"
    own = dict.fromkeys(note for figure in figures for note in figure.notes)
    notes = "; ".join([*own, *canvas.notes(charts)])
    reading = READINGS[kind][1] + (f" {notes[0].upper()}{notes[1:]}." if notes else "")
    kept = tuple((heading, tuple(each)) for heading, each in panels.items() if each)
    return Picture(kind, READINGS[kind][0], reading, kept, scale)


READINGS = {
    "denoise": (
        "Error after denoising, over the error before",
        "The dotted diagonal is giving the noisy motion back. Flatter is better. Dashed lines in a "
        "method's colour are of structures that its training did not have.",
    ),
    "joint-completion": (
        "Error over the share of joints that was given",
        "Lower is better. Dashed lines in a method's colour are of structures that its training did not "
        "have.",
    ),
    "clips": (
        "Distribution over clips",
        "Every dot is a source clip, its cases averaged. Boxes hold the middle half of the clips, the line "
        "in them is the median, thin lines reach from 5 to 95 %; of more than "
        f"{rows.DOTS} clips only those beyond have dots.",
    ),
    "kinds": (
        "By kind of performance",
        "Means over clips, the hardest kind first. A method has no mark where it lacks too many of the "
        "cases of a kind.",
    ),
    "joints": (
        "By joint",
        "Errors of joints on a body of the target's structure in the common reference pose: two-legged "
        "bodies from the front, so that their left is at the right, four-legged ones from their left. The "
        "larger and darker a joint, the farther off.",
    ),
    "recall": (
        "Foot contacts kept, over how slow counts as planted",
        "Recall is the share of the reference's foot contacts that an answer keeps, precision the share of "
        "an answer's contacts that the reference has. A foot that never moves has all the recall there is, "
        "so read both.",
    ),
    "growth": (
        "Error over time",
        "Whether a method loses its way the longer a clip lasts. Fewer clips reach the later seconds, so "
        "lines may step where short clips end; they end where too few clips are left for an interval.",
    ),
    "speed": (
        "Quality against speed",
        "Frames per second of one process and one thread, with handing over. The dotted line joins the "
        "ranked methods that no other beats in both.",
    ),
}
"""Kind -> its title, and how to read it."""
