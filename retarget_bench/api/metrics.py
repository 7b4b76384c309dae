"""Metrics: a prediction beside its case, or sets of them, become named numbers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from retarget_bench.api.cases import TASKS, Case
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.completing import texts, whole

Direction = Literal["lower", "higher", "target", "none"]
LARGEST_OF = {"% of frames": 100.0, "% of clips": 100.0, "degrees": 180.0}
"""Unit -> the largest number that it allows."""
ROUNDING = 1e-6


def against_source(value_id: str) -> str:
    """The id under which a value against the source is stored, beside that against the reference."""
    return f"{value_id}_src"


@dataclass(frozen=True)
class Value:
    """One named number that a metric returns, as its card declares it.

    id:        ``mpjpe_h.world``; unique over all metrics.
    label:     the column's heading.
    meaning:   one line for people who never saw it.
    unit:      ``% of height``, ``m``, ``1``, ...
    better:    ``lower``, ``higher``, ``target`` (best at ``goal``, ranked by |log(value / goal)|) or
               ``none`` (a description, never ranked).
    tolerance: how far a value may move before a regression gate fails, in the value's unit.
    needs:     out of ``reference``, ``source``, ``contacts``, ``touches``, ``rotations``, ``mesh``,
               ``ground``, ``clips``; where one is missing the value is *not applicable*. ``mesh``: the
               target's skin is known in the prediction, and in the reference where there is one. ``clips``:
               enough of the pair of bodies are answered (``PairMetric.least``).
    index:     what the value is a curve over (``threshold``, ``joint``), or "" for one number.
    with_self: in the intra group this value pools self pairs too (a legacy protocol).
    protocol: of position errors, what fixes the number: the keys of ``protocols.PROTOCOL``. Two protocols
               differ by what these say; ``bench table --protocols`` lists them.
    doubt:     the id of a value, in per cent, that says in how many cases the reference itself is beyond
               what this value allows; where these are too many, no method is ranked by it. "": none.
    least, most: what no number can be below or above; None: what unit and direction say (``bounds``).
    source_formula: of a value that also exists against the source, which needs no reference: its formula
               there; "": there is none. It is computed and stored beside this one (``from_source``).
    """

    id: str
    label: str
    meaning: str
    unit: str
    better: Direction
    formula: str
    source: str
    tolerance: float = 1e-6
    goal: float = 1.0
    needs: tuple[str, ...] = ("reference",)
    index: str = ""
    with_self: bool = False
    protocol: Mapping[str, str] = field(default_factory=dict)
    doubt: str = ""
    least: float | None = None
    most: float | None = None
    source_formula: str = ""

    @property
    def from_source(self) -> Value | None:
        """The same value with the source in the reference's place; None where there is none."""
        if not self.source_formula:
            return None
        return replace(
            self,
            id=against_source(self.id),
            label=f"{self.label}, source",
            meaning=self.meaning.replace("reference", "source"),
            formula=self.source_formula,
            needs=tuple("source" if need == "reference" else need for need in self.needs),
            source_formula="",
        )

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest number that is possible. Where the card does not say: errors and
        ratios are not negative, scores without a unit go from 0 to 1, shares to 100 %, angles to 180.
        """
        score = self.better == "higher" and self.unit == "1"
        least = 0.0 if score or self.better in ("lower", "target") else -math.inf
        most = 1.0 if score else LARGEST_OF.get(self.unit, math.inf)
        return least if self.least is None else self.least, most if self.most is None else self.most

    def allows(self, number: float) -> bool:
        """True for a number within the bounds, but for rounding."""
        least, most = self.bounds
        return least - ROUNDING <= number <= most + ROUNDING


def protocol(
    error: str = "distance",
    divided_by: str = "h",
    joints: str = "native",
    placed: str = "world",
    frames: str = "all",
    self_pairs: str = "apart",
) -> dict[str, str]:
    """The ``Value.protocol`` of a position error; without arguments that of ``mpjpe_h.world``."""
    facts = (error, divided_by, joints, placed, frames, self_pairs)
    return dict(
        zip(("error", "divided by", "joints", "placed", "frames", "self pairs"), facts, strict=True)
    )


@dataclass(frozen=True)
class MetricCard:
    """A family of values that are computed together; ``version`` moves when any number does.

    values: as they are declared and listed. ``computed`` has those against the source, too.
    tasks: those whose plain runs it takes part in.
    kind:  ``case`` (a ``Metric``), ``pair`` (a ``PairMetric``) or ``set`` (a ``SetMetric``); "": what its
           methods say.
    """

    name: str
    summary: str
    version: str
    values: tuple[Value, ...]
    tasks: tuple[str, ...] = TASKS[:1]
    kind: Literal["", "case", "pair", "set"] = ""

    def __post_init__(self) -> None:
        texts(self, "name", "summary", "version")
        object.__setattr__(self, "values", tuple(whole(each, Value) for each in self.values))

    @property
    def computed(self) -> tuple[Value, ...]:
        """Every value that results may hold a number of: those declared, then those against the source."""
        twins = (value.from_source for value in self.values)
        return (*self.values, *(twin for twin in twins if twin is not None))


class Metric(ABC):
    """Turns one comparison into named numbers."""

    card: MetricCard

    @abstractmethod
    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Value id -> number, or index -> number for curves. Ids that do not apply are left out."""


class PairMetric(ABC):
    """Numbers of cases that all clips of their pair of bodies decide together, as an error after a fit.

    The extract of each case waits until its split is complete. A pair with fewer than ``least`` answered
    clips has no values.
    """

    card: MetricCard
    least: int = 0

    @abstractmethod
    def extract(self, comparison: Comparison) -> np.ndarray:
        """What the values need of a case, in an array of any shape; it is stored in single precision. Asked
        only where every value of the card applies."""

    @abstractmethod
    def values(self, clips: Sequence[np.ndarray]) -> Sequence[Mapping[str, float]]:
        """The values of each clip of a pair, from its extract, in the order of the cases' ids."""


@dataclass(frozen=True, eq=False)
class CaseFeatures:
    """Features of one case for a set metric: its windows as feature vectors.

    generated: ``(windows, d)`` float32, of the prediction.
    real:      ``(windows, d)`` float32, of the same windows of the reference; no rows without one.
    speed:     ``(windows,)`` level speed of the reference's root, else the source's, heights per second.
    """

    generated: np.ndarray
    real: np.ndarray
    speed: np.ndarray


@dataclass(frozen=True, eq=False)
class Sample:
    """A set of windows. features: ``(n, d)`` float64. clips: ``(n,)`` the source clip of each.

    whole, rows: of a part, the set that it is taken from and the indices of its windows there. A
    metric can reuse there what it computed for pairs of windows of the whole.
    """

    features: np.ndarray
    clips: np.ndarray
    whole: Sample | None = None
    rows: np.ndarray | None = None

    def part(self, rows: np.ndarray) -> Sample:
        """Some windows of a set, by their indices."""
        return Sample(self.features[rows], self.clips[rows], self, rows)


TWO_LEGS = "two legs"
"""Name of the set of all cases from bodies on two legs to such bodies; others are named by structures."""


@dataclass(frozen=True)
class Stretches:
    """Halves of a set that are made of stretches of every clip by turns, instead of whole clips.

    overlap: by how many windows two of them have to be apart to share no frame. length: windows
             in a stretch, about; a clip has at least two stretches, and windows across two are left out.
    """

    overlap: int
    length: int


class SetMetric(ABC):
    """Compares sets of motions instead of single motions: FID and similar values.
    ``evaluation/set_metrics`` draws them."""

    card: MetricCard
    stretches: Stretches | None = None
    """How a set is halved; None: clip by clip."""
    distances: Collection[str] = ()
    """Ids of values that are 0 for equal sets and never less. They are measured from all real motion and
    added to the floor, so that the references score exactly the floor and nothing scores less."""
    unbiased: Collection[str] = ()
    """Ids of values that are 0 on average for real motion. They are withheld where the interval of their
    floor does not hold 0: there, what lies below the floor would mean nothing."""

    def set_of(self, case: Case) -> str:
        """The name of the set, within its split, that a case belongs to; "" where it is in none."""
        return case.target.structure

    @abstractmethod
    def features(self, comparison: Comparison) -> CaseFeatures:
        """The features of a case; no windows where the clip is too short. Raises NotSupported with the
        reason where a body has none."""

    @abstractmethod
    def least(self, value_id: str) -> int:
        """The fewest windows in each set for which a value means anything."""

    @abstractmethod
    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        """A value of two sets; not a number where it is undefined."""


AnyMetric = Metric | PairMetric | SetMetric


def contract_of(metric: Any) -> type[AnyMetric]:
    """The base class of a metric's kind: as its card says, or, where that says nothing, its methods."""
    methods = "set" if hasattr(metric, "features") else "case"
    if hasattr(metric, "extract") and not hasattr(metric, "compute"):
        methods = "pair"
    kind = getattr(metric.card, "kind", "") or methods
    return PairMetric if kind == "pair" else SetMetric if kind == "set" else Metric
