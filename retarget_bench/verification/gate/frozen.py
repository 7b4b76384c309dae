"""Metrics on frozen motions: predictions with known faults, kept as files, that no generator can change."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np

from retarget_bench.api import Case, Metric, Prediction, Sample, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.optional import is_set_metric
from retarget_bench.errors import FileError, NotSupported
from retarget_bench.evaluation import score
from retarget_bench.verification.gate import packing
from retarget_bench.verification.gate.table import Table, flat

FOLDER = "frozen"


@dataclass(frozen=True)
class FrozenCase:
    """One case and several predictions of it.

    predictions: name of the fault -> prediction. origin: what it was made from, and how.
    """

    name: str
    case: Case
    predictions: Mapping[str, Prediction]
    origin: str


def write(folder: Path, frozen: FrozenCase) -> None:
    """One file ``<name>.npz``. Raises FileError."""
    parts = {"case": frozen.case, "predictions": frozen.predictions, "origin": frozen.origin}
    packing.write(folder / f"{frozen.name}.npz", parts)


def read(path: Path) -> FrozenCase:
    """Raises FileError where the file is missing, damaged, from a newer version or something else."""
    parts = packing.read(path)
    try:
        return FrozenCase(path.stem, parts["case"], parts["predictions"], parts["origin"])
    except (KeyError, TypeError) as error:
        raise FileError(path, f"is not a frozen case with predictions ({error})") from error


def hashes(folder: Path) -> dict[str, str]:
    """File name -> eight hex digits of what it holds, for every frozen motion."""
    found = sorted((folder / FOLDER).glob("*.npz"))
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest()[:8] for path in found}


def measure(
    folder: Path, metrics: Sequence[Metric | SetMetric], progress: Callable[[int, int], None]
) -> FrozenMeasures:
    """Every value of every metric on every frozen motion. Raises FileError."""
    found = FrozenMeasures()
    paths = sorted((folder / FOLDER).glob("*.npz"))
    for done, path in enumerate(paths, 1):
        held = read(path)
        for metric in metrics:
            if is_set_metric(metric) and (hash_ := network(metric, held.case)):
                found.networks.setdefault(metric.card.name, {})[held.case.target.structure] = hash_
            for name, case, prediction in _asked(held):
                found.keep(name, metric, partial(_columns, metric, case, prediction))
        progress(done, len(paths))
    for metric in metrics:
        if is_set_metric(metric):
            for name in ROWS:
                found.keep(name, metric, partial(set_values, metric, name))
    return found


@dataclass
class FrozenMeasures:
    """table: ``<file>/<prediction>`` -> column -> number. failures: ``<row> <metric>`` -> what went wrong.

    networks: set metric -> structure -> hash of what makes its features.
    """

    table: Table = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    networks: dict[str, dict[str, str]] = field(default_factory=dict)

    def keep(
        self, row: str, metric: Metric | SetMetric, columns: Callable[[], Mapping[str, float]]
    ) -> None:
        kept = self.table.setdefault(row, {})
        try:
            kept |= columns()
        except Exception as error:  # a metric's own fault is a finding, not the end
            self.failures[f"{row} {metric.card.name}"] = f"{type(error).__name__}: {error}"


def _columns(metric: Metric | SetMetric, case: Case, prediction: Prediction) -> Mapping[str, float]:
    if not is_set_metric(metric):
        return flat(score.score([cast(Metric, metric)], case, prediction))
    return set_features(metric, case, prediction)


def _asked(frozen: FrozenCase) -> Iterator[tuple[str, Case, Prediction]]:
    """Every prediction with its case; one of them also without labels, and one without any right answer."""
    for name, prediction in frozen.predictions.items():
        yield f"{frozen.name}/{name}", frozen.case, prediction
    name, prediction = next(iter(frozen.predictions.items()))
    yield f"{frozen.name}/{name}, no labels", replace(frozen.case, contacts=None), prediction
    known = {each.name: None for each in fields(Case) if each.default is None}
    yield f"{frozen.name}/{name}, no answer", replace(frozen.case, **known), prediction  # type: ignore[arg-type]


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


def set_values(metric: SetMetric, row: str) -> dict[str, float]:
    """Every value of the card of two clouds, one way round or the other; undefined ones are left out."""
    real, generated = clouds() if row == ROWS[0] else reversed(clouds())
    found = {value.id: metric.value(value.id, real, generated) for value in metric.card.values}
    return {key: float(each) for key, each in found.items() if math.isfinite(each)}


def set_features(metric: SetMetric, case: Case, prediction: Prediction) -> dict[str, float]:
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
