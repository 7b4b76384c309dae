"""Set metrics in the gate: their values on fixed clouds of points, and their features of frozen motions."""

from __future__ import annotations

import math

import numpy as np

from retarget_bench.api import Case, Prediction, Sample, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported

WINDOWS, FEATURES, CLIPS = 240, 16, 24
"""Size of the clouds: enough for every value to be defined, few enough to take no time."""
TOLERANCE = 1e-3
"""Of the sums of features: networks compute in single precision."""


def feature_value(metric: SetMetric) -> str:
    """The id in reports of a metric's features, which are no value of its card."""
    return f"{metric.card.name}.features"


def clouds() -> tuple[Sample, Sample]:
    """Two overlapping sets of points, the second narrower and to one side; the same wherever it is made."""
    drawn = np.random.Philox(key=5).random_raw(2 * WINDOWS * FEATURES * 4) >> np.uint64(11)
    # sums of four uniform numbers: nearly normal, by plain arithmetic
    points = (drawn.astype(np.float64) * 2.0**-53).reshape(2, WINDOWS, FEATURES, 4).sum(axis=-1) - 2.0
    clips = np.repeat([f"clip {number}" for number in range(CLIPS)], WINDOWS // CLIPS)
    return Sample(points[0], clips), Sample(0.8 * points[1] + 0.1, clips)


ROWS = ("clouds/one way", "clouds/the other")


def values(metric: SetMetric, row: str) -> dict[str, float]:
    """Every value of the card of two clouds, one way round or the other; undefined ones are left out."""
    real, generated = clouds() if row == ROWS[0] else reversed(clouds())
    found = {value.id: metric.value(value.id, real, generated) for value in metric.card.values}
    return {key: float(each) for key, each in found.items() if math.isfinite(each)}


def features(metric: SetMetric, case: Case, prediction: Prediction) -> dict[str, float]:
    """Sums over the features of a frozen motion, weighted so that their order counts.

    Empty where there is no network for the body, no right answer, or no window in the motion.
    """
    if case.reference is None:
        return {}
    try:
        found = metric.features(Comparison(case, prediction))
    except NotSupported:
        return {}
    if not len(found.generated):
        return {}
    weights = np.arange(1, found.generated.shape[1] + 1) / found.generated.shape[1]
    sums = {
        "generated": np.asarray(found.generated, dtype=np.float64) @ weights,
        "real": np.asarray(found.real, dtype=np.float64) @ weights,
        "speed": np.asarray(found.speed, dtype=np.float64),
    }
    return {f"{feature_value(metric)}@{name}": float(each.mean()) for name, each in sums.items()}


def network(metric: SetMetric, case: Case) -> str:
    """The hash of the network for a case's target; "" where there is none."""
    try:
        return metric.network(case.target)
    except NotSupported:
        return ""
