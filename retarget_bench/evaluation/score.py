"""Second stage: metrics turn a case and its prediction into named numbers."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from retarget_bench.api import Case, Metric, Prediction, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError
from retarget_bench.motion.motion import Motion, PointSets, Positions
from retarget_bench.results.store import Values


def score(metrics: Sequence[Metric], case: Case, prediction: Prediction) -> Values:
    """Every value that applies to this case. Raises BenchError where a metric breaks its contract."""
    comparison = Comparison(case, prediction)
    values: Values = {}
    for metric in metrics:
        applicable = {value.id for value in metric.card.values if not missing(value, case, prediction)}
        if not applicable:
            continue
        for value_id, number in metric.compute(comparison).items():
            if value_id in applicable:
                values[value_id] = _finite(metric, value_id, number)
    return values


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
    }
    return next((need for need in value.needs if not has.get(need, False)), "")


def _finite(metric: Metric, value_id: str, number: Any) -> Any:
    if type(number) is float and math.isfinite(number):  # nearly all: joints and frames have one each
        return number
    if isinstance(number, Mapping):
        return {str(key): _finite(metric, value_id, each) for key, each in number.items()}
    number = float(number)
    if not math.isfinite(number):
        raise BenchError(
            f"metric {metric.card.name!r} gave {number} for {value_id!r}; a value that is undefined "
            "for a case must be left out"
        )
    return number
