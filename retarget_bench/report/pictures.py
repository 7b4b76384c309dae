"""The charts of a chapter, with headings and reading help."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from retarget_bench.analysis import seen_unseen
from retarget_bench.errors import BenchError
from retarget_bench.figures.data import bodies, lines, rows
from retarget_bench.figures.data.model import (
    Figure,
    HeatMap,
    LineChart,
    NothingToDraw,
    RowChart,
    SkeletonChart,
)  # fmt: skip
from retarget_bench.figures.palette import MethodStyle
from retarget_bench.figures.svg.charts import Drawing
from retarget_bench.report.chapters import Chapter

JOINTS = "mpjpe_h.joint"
STRUCTURES = 3
"""Skeletons of so many structures are drawn of each split, those of most cases."""
OUTSIDE = "What stands at the edge is farther off."


@dataclass(frozen=True)
class Picture:
    """Charts with a heading.

    name:   part of the anchor. reading: how to read it, in a sentence or two.
    panels: a heading ("" for none) and its charts, small multiples of each other.
    size:   how wide charts are: ``wide``, ``middle`` or ``small``, of which many stand in a line.
    scale:  what the scale of errors goes up to, in words, where colours mean errors; "" otherwise.
    """

    name: str
    title: str
    reading: str
    panels: tuple[tuple[str, tuple[Markup, ...]], ...]
    size: str = "wide"
    scale: str = ""


def figures(chapter: Chapter, order: Sequence[str]) -> dict[str, list[Figure]]:
    """Kind -> its charts, of the kinds that say something of these results, in reading order.

    order: all methods, by rank.
    """
    figures_of: dict[str, list[Figure]] = {}

    def add(make: Callable[..., Figure], *arguments: Any, **options: Any) -> None:
        with suppress(NothingToDraw):
            figure = make(*arguments, order=order, **options)
            if _informative(figure):
                figures_of.setdefault(figure.kind, []).append(figure)

    matrices = [split.matrix for split in chapter.splits]
    main = chapter.splits[0].main.id
    alike = [split.matrix for split in chapter.splits if split.main.id == main]
    if chapter.kind in ("denoise", "joint-completion"):
        for matrix in matrices:
            add(
                lines.denoise if chapter.kind == "denoise" else lines.joint_completion,
                matrix,
                _halves(chapter),
            )
    for make in (rows.clips, rows.kinds):
        for split in chapter.splits:
            add(make, [split.matrix], split.main.id)
    add(bodies.pairs, alike, main)
    if isinstance(chapter.bodies, Mapping):
        add(bodies.skeletons, matrices[::-1], JOINTS, chapter.bodies, most=STRUCTURES)
    add(lines.recall, matrices)
    add(lines.growth, matrices)
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
    """True where charts say more than the table: of several kinds, pairs, seconds or methods."""
    first = figure.charts[0] if figure.charts else None
    match figure.kind:
        case "kinds":
            return isinstance(first, RowChart) and len(first.rows) > 1
        case "pairs":
            maps = [chart for chart in figure.charts if isinstance(chart, HeatMap)]
            return any(source != target for each in maps for source, target in each.squares)
        case "growth":
            curves = [chart for chart in figure.charts if isinstance(chart, LineChart)]
            return any(len(line.marks) > 1 for chart in curves for line in chart.lines)
        case "speed":
            return first is not None and len(figure.methods) > 1
    return first is not None


# ---------------------------------------------------------------------------------------------- pictures
def pictures(chapter: Chapter, styles: Mapping[str, MethodStyle]) -> list[Picture]:
    """All pictures of a chapter; styles: of all methods, by rank."""
    values = {key: each for split in chapter.splits for key, each in split.matrix.values.items()}
    units = {key: "" if each.unit == "1" else each.unit for key, each in values.items()}
    drawing = Drawing(styles, chapter.splits[0].decimals, units)
    return [_picture(kind, drawn, drawing) for kind, drawn in figures(chapter, list(styles)).items()]


def _picture(kind: str, figures: Sequence[Figure], drawing: Drawing) -> Picture:
    panels: dict[str, list[Markup]] = {}
    scale, size, reading = "", "wide", READINGS[kind][1]
    for figure in figures:
        for chart in figure.charts:
            heading = ""
            if isinstance(chart, SkeletonChart):
                heading = f"{chart.split}, structure {chart.structure}, drawn as {chart.body}"
            if isinstance(chart, HeatMap | SkeletonChart):
                scale = f"{chart.scale.high:.3g} and more, {chart.scale.label}"
                size = "middle" if isinstance(chart, HeatMap) else "small"
            if isinstance(chart, HeatMap) and chart.together:
                reading = f"{READINGS[kind][1]} {TOGETHER}"
            panels.setdefault(heading, []).append(drawing.chart(chart))
    return Picture(
        kind, READINGS[kind][0], reading, tuple((h, tuple(each)) for h, each in panels.items()), size, scale
    )


TOGETHER = "Bodies are taken together by structure, of which pairs of one are of two bodies."
READINGS = {
    "denoise": (
        "Error after denoising, over the error before",
        "The dotted diagonal is giving the noisy motion back. Flatter is better; what stands at the upper "
        "edge is far worse than doing nothing. Dashed lines are of structures that a method's training did "
        "not have.",
    ),
    "joint-completion": (
        "Error over the share of joints that was given",
        "Lower is better. What stands at the upper edge is far worse than most. Dashed lines are of "
        "structures that a method's training did not have.",
    ),
    "clips": (
        "Distribution over clips",
        "Every dot is a source clip, its cases averaged. Boxes hold the middle half of the clips, the line "
        "in them is the median, whiskers reach from 5 to 95 %. Arrowheads at the edge are clips far beyond "
        "it.",
    ),
    "kinds": (
        "By kind of performance",
        f"Means over clips, with intervals where there are clips enough; the hardest kind first. {OUTSIDE}",
    ),
    "pairs": (
        "By pair of bodies",
        "Sources are rows, targets columns. Numbers say the same as the colours; what is empty was not "
        "asked, or not answered.",
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
        "lines may step where short clips end; lines that leave the chart at its top are far worse.",
    ),
    "speed": (
        "Quality against speed",
        "Frames per second of one process and one thread, with handing over; hollow marks are not ranked. "
        f"The line joins the ranked methods that no other beats in both. {OUTSIDE}",
    ),
}
"""Kind -> its title, and how to read it."""
