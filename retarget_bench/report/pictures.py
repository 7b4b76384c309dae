"""The pictures of a chapter: those that there are data for, in the order in which they are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from retarget_bench.report.chapters import Chapter
from retarget_bench.report.charts import ChartStyle

Looks = Mapping[str, ChartStyle]


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


def pictures(chapter: Chapter, looks: Looks) -> list[Picture]:
    """All pictures of a chapter that have anything to show."""
    from retarget_bench.report import curves, joints, levels, pairs, spread

    makers = (
        levels.denoise,
        levels.upsample,
        spread.clips,
        spread.kinds,
        pairs.pairs,
        joints.joints,
        curves.recall,
        curves.growth,
        spread.speed,
    )
    made = (make(chapter, looks) for make in makers)
    return [picture for picture in made if picture is not None and any(each for _, each in picture.panels)]


def by_split(found: Sequence[tuple[str, Sequence[Markup]]]) -> tuple[tuple[str, tuple[Markup, ...]], ...]:
    """Panels, those without a chart left out."""
    return tuple((heading, tuple(charts)) for heading, charts in found if charts)
