"""The charts of a chapter, with headings and reading help."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

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

T = TypeVar("T")
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
    """Kind -> what its charts show, of the kinds that say something of these results, as they are read.

    order: all methods, by rank.
    """
    matrices = [split.matrix for split in chapter.splits]
    main = chapter.splits[0].main.id
    alike = [split.matrix for split in chapter.splits if split.main.id == main]
    each = [(split.matrix, split.main.id) for split in chapter.splits]
    found: dict[str, list[Figure]] = {}
    if chapter.kind in ("denoise", "upsample"):
        make = lines.denoise if chapter.kind == "denoise" else lines.upsample
        halves = _halves(chapter)
        found[chapter.kind] = _drawn(lambda matrix: make(matrix, halves, order), matrices)
    found["clips"] = _drawn(lambda one: rows.clips([one[0]], one[1], order), each)
    found["kinds"] = _drawn(lambda one: rows.kinds([one[0]], one[1], order), each)
    found["pairs"] = _drawn(lambda some: bodies.pairs(some, main, order), [alike])
    found["joints"] = _drawn(
        lambda some: bodies.skeletons(some, JOINTS, chapter.bodies, order=order, most=STRUCTURES),
        [matrices[::-1]] if chapter.bodies else [],
    )
    found["recall"] = _drawn(lambda some: lines.recall(some, order=order), [matrices])
    found["growth"] = _drawn(lambda some: lines.growth(some, order=order), [matrices])
    found["speed"] = _drawn(lambda one: rows.speed([one[0]], one[1], order), each)
    return {kind: those for kind, all_ in found.items() if (those := [one for one in all_ if _says(one)])}


def _drawn(make: Callable[[T], Figure], those: Iterable[T]) -> list[Figure]:
    found = []
    for each in those:
        try:
            found.append(make(each))
        except NothingToDraw:
            continue
    return found


def _halves(chapter: Chapter) -> list[seen_unseen.SeenPart]:
    """What trained methods do on structures seen and unseen; nothing where results do not say which."""
    try:
        return seen_unseen.seen_and_unseen(chapter.places, "level")
    except BenchError:
        return []


def _says(figure: Figure) -> bool:
    """Whether charts say more than the table: several kinds, pairs, seconds or methods."""
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
    return [_picture(kind, found, drawing) for kind, found in figures(chapter, list(styles)).items()]


def _picture(kind: str, found: Sequence[Figure], drawing: Drawing) -> Picture:
    panels: dict[str, list[Markup]] = {}
    scale, size, reading = "", "wide", READINGS[kind][1]
    for figure in found:
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
    "upsample": (
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
        "Frames per second of one process and one thread; hollow marks are not ranked. The line joins the "
        f"ranked methods that no other beats in both. {OUTSIDE}",
    ),
}
"""Kind -> its title, and how to read it."""
