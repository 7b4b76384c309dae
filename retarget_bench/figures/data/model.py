"""Chart data before drawing: series, means, intervals, limits and the cases behind each mark."""

from collections.abc import Mapping
from dataclasses import dataclass

from retarget_bench.analysis.summary import Mean
from retarget_bench.errors import BenchError
from retarget_bench.results.header import ResultHeader


class NothingToDraw(BenchError):
    """Results do not have what a chart shows."""


@dataclass(frozen=True)
class Cases:
    """The cases behind a mark.

    value: the number that they are ordered by; "" where it is not one number per case.
    part:  what the cases have in common, as (``kind``, ``clip`` or ``level``; its name); or
    worst: the numbers of the worst cases in the result matrix, each with its number, worst first.
    what:  what the numbers of ``worst`` are.
    """

    split: str
    value: str = ""
    part: tuple[str, str] | None = None
    worst: tuple[tuple[int, float], ...] | None = None
    what: str = ""


@dataclass(frozen=True)
class Mark:
    """One number in a chart.

    at:     its place along the axis of groups: a row, a second, frames per second, a joint.
    name:   what the place is called. hollow: of a method that is not ranked, or an extra level.
    """

    method: str
    at: float
    mean: Mean
    cases: Cases
    name: str = ""
    hollow: bool = False


@dataclass(frozen=True)
class Axis:
    """An axis of numbers. cut: marks lie beyond its end. ticks: (place, text), where not usual."""

    label: str
    low: float
    high: float
    cut: bool = False
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()

    def beyond(self, mark: Mark) -> bool:
        return self.cut and mark.mean.value > self.high


@dataclass(frozen=True)
class ColourScale:
    """A scale of errors, from ``low``, pale, to ``high`` and more, dark."""

    label: str
    low: float
    high: float

    def share(self, number: float) -> float:
        return min(1.0, max(0.0, (number - self.low) / (self.high - self.low)))


@dataclass(frozen=True)
class Line:
    """A method's curve; seen: whether of structures that its training had, None of all.

    name: in the legend. marks: from left to right. extra: marks beside the line.
    """

    method: str
    name: str
    marks: tuple[Mark, ...]
    seen: bool | None = None
    extra: tuple[Mark, ...] = ()

    @property
    def banded(self) -> bool:
        """True where every mark has an interval."""
        return all(mark.mean.interval is not None for mark in self.marks)


@dataclass(frozen=True)
class LineChart:
    """Lines over two axes. diagonal: whether y = x is drawn. above: ticks and label of a second x axis."""

    split: str
    title: str
    x: Axis
    y: Axis
    lines: tuple[Line, ...]
    diagonal: bool = False
    above: tuple[str, tuple[tuple[float, str], ...]] | None = None

    @property
    def far(self) -> list[Mark]:
        """The highest mark of every line that leaves the chart."""
        highest = (max(line.marks, key=lambda mark: mark.mean.value) for line in self.lines if line.marks)
        return [mark for mark in highest if self.y.beyond(mark)]


@dataclass(frozen=True)
class RowChart:
    """Rows from top to bottom, in each a mark per method with its interval.

    marks:  label -> its marks, ``at`` being the row. together: whether rows are methods themselves.
    joined: groups of rows that the data cannot tell apart.
    """

    split: str
    title: str
    axis: Axis
    rows: tuple[str, ...]
    marks: Mapping[str, tuple[Mark, ...]]
    together: bool = False
    joined: tuple[tuple[int, ...], ...] = ()

    @property
    def far(self) -> list[Mark]:
        return [mark for each in self.marks.values() for mark in each if self.axis.beyond(mark)]


@dataclass(frozen=True)
class PointChart:
    """A mark per method over a second number. front: places and means that no ranked method beats."""

    split: str
    title: str
    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    front: tuple[Mark, ...]

    @property
    def far(self) -> list[Mark]:
        return [mark for mark in self.marks if self.y.beyond(mark)]


@dataclass(frozen=True)
class Box:
    """The spread of a method's clips. quantiles: at 5, 25, 50, 75 and 95 %. marks: clips."""

    method: str
    quantiles: tuple[float, ...]
    marks: tuple[Mark, ...]


@dataclass(frozen=True)
class BoxChart:
    """A box per method."""

    split: str
    title: str
    axis: Axis
    boxes: tuple[Box, ...]


@dataclass(frozen=True)
class HeatMap:
    """Means of one method by source (rows) and target (columns); pairs without a number are left out."""

    method: str
    sources: tuple[str, ...]
    targets: tuple[str, ...]
    scale: ColourScale
    squares: Mapping[tuple[str, str], Mark]
    together: bool = False
    """True where bodies are taken together by structure."""


@dataclass(frozen=True)
class SkeletonChart:
    """A method's errors by joint, on a body of the target's structure in the common reference pose.

    places: ``(joints, 2)`` metres, right and up. bones: pairs of joints. marks: ``at`` being the joint.
    """

    split: str
    method: str
    body: str
    places: tuple[tuple[float, float], ...]
    bones: tuple[tuple[int, int], ...]
    scale: ColourScale
    marks: tuple[Mark, ...]
    structure: str


Chart = LineChart | RowChart | PointChart | BoxChart | HeatMap | SkeletonChart


@dataclass(frozen=True)
class Figure:
    """Charts of one kind. title: what they show. note: how to read intervals and marks, in brackets.

    dataset: the label of the data. methods: label -> a header of its results, in the order of the tables.
    """

    kind: str
    dataset: str
    title: str
    methods: Mapping[str, ResultHeader]
    charts: tuple[Chart, ...]
    note: str = ""

    @property
    def far(self) -> bool:
        """True where a mark lies beyond an axis."""
        return any(getattr(chart, "far", ()) for chart in self.charts)
