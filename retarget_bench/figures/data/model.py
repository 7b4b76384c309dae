"""Chart data before drawing: series of marks with intervals, limits, and the cases behind each mark."""

from collections.abc import Callable
from dataclasses import dataclass

from retarget_bench.analysis.summary import Mean
from retarget_bench.errors import BenchError

BEYOND = ("above", "below")
"""Groups of the marks that lie beyond an axis."""


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
    """One number in a chart. at: its place: a row, a second, frames per second, a joint; name: of that
    place."""

    at: float
    mean: Mean
    cases: Cases
    name: str = ""


@dataclass(frozen=True)
class Axis:
    """An axis. ticks: (place, text), where not usual."""

    label: str
    low: float
    high: float
    log: bool = False
    ticks: tuple[tuple[float, str], ...] = ()

    def beyond(self, number: float) -> str:
        """``above`` or ``below`` of a number that the axis does not reach; "" of others."""
        room = 1e-9 * (self.high - self.low)
        return "above" if number > self.high + room else "below" if number < self.low - room else ""


@dataclass(frozen=True)
class Series:
    """What a chart shows of a method, or of its results on structures that its training had, or had not.

    name:     in the legend. marks: in the order of their places.
    unranked: why the method is not ranked, so that its numbers are not compared with others'; "" if it is.
    unseen:   of structures that training had not. extra: marks beside the line.
    box:      quantiles of the marks at 5, 25, 50, 75 and 95 %, in the row of this number.
    """

    method: str
    name: str
    marks: tuple[Mark, ...]
    unranked: str = ""
    unseen: bool = False
    extra: tuple[Mark, ...] = ()
    box: tuple[int, tuple[float, ...]] | None = None

    @property
    def title(self) -> str:
        return f"{self.name} ({self.unranked})" if self.unranked else self.name

    def groups(self, axis: Axis) -> dict[str, tuple[Mark, ...]]:
        """All marks by how they are drawn: ``marks``, ``extra``, and ``above`` or ``below`` the axis."""
        inside: Callable[[Mark], bool] = lambda mark: not axis.beyond(mark.mean.value)  # noqa: E731
        groups = {"marks": tuple(filter(inside, self.marks)), "extra": tuple(filter(inside, self.extra))}
        for way in BEYOND:
            every = (*self.marks, *self.extra)
            groups[way] = tuple(mark for mark in every if axis.beyond(mark.mean.value) == way)
        return {name: marks for name, marks in groups.items() if marks}


@dataclass(frozen=True)
class Chart:
    """Series over two axes.

    at, value: the axes of places and of numbers. rows: whether places are rows, from top to bottom.
    joined:    whether a line joins the marks of a series. named: whether places name the series.
    guide:     (place, number) along a dotted line. above: label and ticks of a second x axis.
    tied:      the rows that the data cannot tell from the best.
    """

    split: str
    title: str
    at: Axis
    value: Axis
    series: tuple[Series, ...]
    rows: bool = False
    joined: bool = False
    named: bool = False
    guide: tuple[tuple[float, float], ...] = ()
    above: tuple[str, tuple[tuple[float, str], ...]] | None = None
    tied: tuple[int, ...] = ()

    @property
    def x(self) -> Axis:
        return self.value if self.rows else self.at

    @property
    def y(self) -> Axis:
        return self.at if self.rows else self.value


@dataclass(frozen=True)
class SkeletonChart:
    """A method's errors by joint, on a body of the target's structure in the common reference pose.

    places: ``(joints, 2)`` metres, right and up. bones: pairs of joints. errors: the scale of colours, from
    0 to what is darkest. marks: ``at`` being the joint, largest errors last.
    """

    split: str
    method: str
    body: str
    places: tuple[tuple[float, float], ...]
    bones: tuple[tuple[int, int], ...]
    errors: Axis
    marks: tuple[Mark, ...]
    structure: str


@dataclass(frozen=True)
class Figure:
    """Charts of one kind. title: what they show. dataset: the label of the data. notes: what their numbers
    are, and what is left out."""

    kind: str
    dataset: str
    title: str
    charts: tuple[Chart, ...] = ()
    skeletons: tuple[SkeletonChart, ...] = ()
    notes: tuple[str, ...] = ()
