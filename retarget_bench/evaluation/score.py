"""Second stage: metrics turn a case and its prediction into named numbers.

A fault of a metric costs its own values of that case, and becomes a sentence.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from retarget_bench.api import AnyMetric, Case, Metric, PairMetric, Prediction, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.immutable import immutable
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.attempt import attempt, kind, sentence
from retarget_bench.motion.motion import Motion, PointSets, Positions
from retarget_bench.results.store import Values

T = TypeVar("T")
COPY = "what metrics are given cannot be written to, so take a copy (numpy.array)"
BASE, PER_FRAME = 60.0, 1.0
"""Seconds that a metric has for a case, and for each of its frames."""
LARGEST = 1e100
"""No number is larger: squares of such ones can still be summed and written."""
LONGEST_INDEX = 10_000
"""Characters of the index of a point of a curve."""
SHOWN = 80

Faults = dict[str, str]
"""Metric -> a sentence on what it did wrong."""
Before = Callable[[str], None]
"""Called with the name of a metric before it is asked. Raises BenchError where it is not to be asked."""


@dataclass(frozen=True)
class Scored:
    """Values of a case by id, and the faults of those metrics whose values it therefore lacks."""

    values: Values = field(default_factory=dict)
    faults: Faults = field(default_factory=dict)

    def sound(self) -> Values:
        """The values where no metric failed. Raises BenchError for the first that did."""
        for name, fault in self.faults.items():
            raise BenchError(f"metric {name} failed: {fault}")
        return self.values


def nothing(metric: str) -> None:
    """Every metric is asked."""
    del metric


def score(
    metrics: Sequence[Metric],
    case: Case,
    prediction: Prediction,
    before: Before = nothing,
) -> Scored:
    """Every value that applies to this case.

    Raises BenchError where the case itself does not fit together.
    """
    comparison = compared(case, prediction)
    scored = Scored()
    for metric in metrics:
        applicable = {value.id for value in metric.card.computed if not missing(value, case, prediction)}
        if not applicable:
            continue
        try:
            ask = partial(_values, metric, comparison, applicable)
            scored.values.update(ask_metric(metric, ask, comparison, before))
        except BenchError as fault:
            scored.faults[metric.card.name] = fault_of(fault)
    return scored


def ask_metric(
    metric: AnyMetric,
    ask: Callable[[], T],
    comparison: Comparison,
    before: Before,
) -> T:
    """Ask a metric about a case. Raises BenchError where it fails, or is not to be asked."""
    before(metric.card.name)
    return attempt(ask, seconds(comparison.frames), f"metric {metric.card.name}")


def fault_of(error: BenchError) -> str:
    """The sentence for an error of a metric."""
    message = sentence(error)
    return f"{message}; {COPY}" if any(word in message for word in ("read-only", "WRITEABLE")) else message


def compared(case: Case, prediction: Prediction) -> Comparison:
    """A prediction beside its case, of which no metric can change what the others see. Raises BenchError
    where they do not fit together."""
    return Comparison(immutable(case), immutable(prediction))


def seconds(frames: int) -> float:
    """The time that a metric has for so many frames."""
    return BASE + PER_FRAME * frames


def missing(value: Value, case: Case, prediction: Prediction) -> str:
    """The first need of a value that this case lacks; "" where it applies."""
    answers = [prediction, *([case.reference] if case.reference is not None else [])]
    has = {
        "reference": case.reference is not None,
        "contacts": case.contacts is not None,
        "touches": bool(case.touches),
        "rotations": all(isinstance(each, Motion) for each in answers),
        "mesh": case.target.skin is not None and not any(isinstance(each, Positions) for each in answers),
        "source": not isinstance(case.source, PointSets),
        "ground": True,
        "clips": True,  # whether there are enough is known when all are answered
    }
    return next((need for need in value.needs if not has.get(need, False)), "")


# ------------------------------------------------------------------------------------ what metrics answer
def _values(metric: Metric, comparison: Comparison, applicable: Collection[str]) -> Values:
    return checked(metric, metric.compute(comparison), applicable)


def checked(metric: Metric | PairMetric, answer: Any, applicable: Collection[str]) -> Values:
    """The values of an answer that apply, as they are written. Raises BenchError for what cannot be."""
    if not isinstance(answer, Mapping):
        raise BenchError(f"gave {kind(answer)} instead of numbers by the ids of values")
    declared = {value.id: value for value in metric.card.computed}
    if unknown := [key for key in answer if key not in declared]:
        raise BenchError(f"gave {unknown[0]!r}, a value that its card does not declare")
    applied = {declared[key].id: each for key, each in answer.items() if key in applicable}
    return {key: _value(declared[key], each) for key, each in applied.items()}


def _value(declared: Value, answer: Any) -> float | dict[str, float]:
    if isinstance(answer, Mapping) != bool(declared.index):
        expected = f"numbers by {declared.index}" if declared.index else "a number"
        raise BenchError(f"gave {kind(answer)} instead of {expected} for {declared.id}")
    if isinstance(answer, Mapping):
        return {_index(declared.id, key): as_number(declared.id, each) for key, each in answer.items()}
    return as_number(declared.id, answer)


def as_number(value_id: str, answer: Any) -> float:
    """A number as it is written. Raises BenchError for what is none, or is not finite, or too large."""
    if type(answer) is float and -LARGEST < answer < LARGEST:  # nearly all: joints and frames have one each
        return answer
    try:
        number = math.nan if isinstance(answer, str | bytes) else float(answer)
    except (TypeError, ValueError):
        number = math.nan
    except OverflowError:  # an integer
        number = math.inf
    if abs(number) < LARGEST:
        return number
    if math.isfinite(number) or isinstance(answer, int):
        raise BenchError(f"gave a number beyond {LARGEST:g} for {value_id}")
    if isinstance(answer, float | np.floating):
        raise BenchError(f"gave {number} for {value_id}; what is undefined for a case must be left out")
    raise BenchError(f"gave {kind(answer)} instead of a number for {value_id}")


def _index(value_id: str, key: object) -> str:
    index = str(key)
    written = index.encode(errors="ignore").decode().replace("\0", "")
    if written != index or not 0 < len(index) <= LONGEST_INDEX:
        raise BenchError(f"gave an index for {value_id} that cannot be written, {index[:SHOWN]!r}")
    return index
