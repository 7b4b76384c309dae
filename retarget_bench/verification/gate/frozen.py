"""Metrics on frozen motions: predictions with known faults, kept as files, that no generator can change.

A file holds any of the engine's frozen dataclasses: their arrays, and all else as JSON. A character's
measures are found anew when it is read, so that a change of how bodies are measured is seen. Skins are left
out. Rotations are stored in single precision, and are unit again when they are read.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench import api
from retarget_bench.api import AnyMetric, Case, Ground, Prediction, Sample, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import BenchError, FileError, NotSupported
from retarget_bench.evaluation import score
from retarget_bench.evaluation.pairs import of_case
from retarget_bench.motion import character, measures, motion, rotation, skeleton
from retarget_bench.results.store import Values, read_npz
from retarget_bench.verification.gate.golden import CLOUDS, MOTION, MOTIONS, Measured
from retarget_bench.verification.rewriting import played

SCHEMA = 1
DATACLASSES = {
    name: cls
    for module in (api, character, motion, skeleton)
    for name, cls in vars(module).items()
    if isinstance(cls, type) and is_dataclass(cls)
}
"""Name -> dataclass that a file may hold."""


@dataclass(frozen=True)
class FrozenCase:
    """One case and several predictions of it.

    predictions: name of the fault -> prediction. origin: what it was made from, and how.
    """

    name: str
    case: Case
    predictions: Mapping[str, Prediction]
    origin: str


# ---------------------------------------------------------------------------------------------- files
def read(path: Path) -> FrozenCase:
    """The content of a file. Raises FileError where it is missing, damaged, from a newer version or
    something else."""
    problem = "is not a file of frozen motions, or is damaged"
    arrays = read_npz(path, problem)
    try:
        tree = json.loads(str(arrays.pop("tree")))
        schema = tree["schema"]
    except (ValueError, KeyError, TypeError) as error:
        raise FileError(path, f"{problem} ({error})") from error
    if not isinstance(schema, int) or schema > SCHEMA:
        raise FileError(
            path, f"has schema {schema} of frozen motions; this version reads up to {SCHEMA}. Upgrade"
        )
    try:
        parts = _unpacked(tree["thing"], arrays, [])
        return FrozenCase(path.stem, parts["case"], parts["predictions"], parts["origin"])
    except (KeyError, IndexError, TypeError, ValueError, BenchError) as error:
        raise FileError(path, f"holds something that this version cannot build: {error}") from error


def _unpacked(packed: Any, arrays: Mapping[str, np.ndarray], objects: list[Any]) -> Any:
    """The object of a part of a file. objects: the dataclasses of the file so far."""
    if not isinstance(packed, dict):
        return packed
    if "same" in packed:
        return objects[packed["same"]]
    if "array" in packed:
        array = arrays[packed["array"]]
        return array.astype(np.float64) if array.dtype == np.float32 else array
    if "mapping" in packed:
        return {key: _unpacked(value, arrays, objects) for key, value in packed["mapping"].items()}
    if "tuple" in packed:
        return tuple(_unpacked(each, arrays, objects) for each in packed["tuple"])
    inside = {name: _unpacked(value, arrays, objects) for name, value in packed["fields"].items()}
    if packed["is"] == "Character":
        parts = (inside[name] for name in ("skeleton", "roles", "reference_pose"))
        inside["measures"] = measures.measure(*parts)
    if packed["is"] == "Motion":
        inside["rotations"] = rotation.normalise(inside["rotations"])
    objects.append(DATACLASSES[packed["is"]](**inside))
    return objects[-1]


# ------------------------------------------------------------------------------------------ measuring
def measure(
    now: Measured,
    folder: Path,
    metrics: Sequence[AnyMetric],
    progress: Callable[[int, int], None],
) -> None:
    """Add every value of every metric on every frozen motion. Raises FileError."""
    paths = sorted((folder / MOTIONS).glob("*.npz"))
    if not paths:
        now.missing.append(f"{folder / MOTIONS} has no frozen motion")
    of_sets = [metric for metric in metrics if isinstance(metric, SetMetric)]
    of_cases = [of_case(metric) for metric in metrics if not isinstance(metric, SetMetric)]
    for done, path in enumerate(paths, 1):
        held = read(path)
        now.facts[f"file/{path.stem}"] = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        for name, case, prediction in _questions(held):
            row = f"{MOTION}/{name}"
            scored = score.score(of_cases, case, prediction)
            now.add(row, scored.values)
            now.errors |= {f"{row}/{metric}": why for metric, why in scored.faults.items()}
            for metric in of_sets:
                _keep(now, row, metric, partial(set_features, metric, case, prediction))
        progress(done, len(paths))
    for metric in of_sets:
        for row in ROWS:
            _keep(now, f"{CLOUDS}/{row}", metric, partial(set_values, metric, row))


def _keep(now: Measured, row: str, metric: SetMetric, values: Callable[[], Mapping[str, Any]]) -> None:
    try:
        now.add(row, values())
    except Exception as error:  # a metric's own fault is a finding, not the end
        now.errors[f"{row}/{metric.card.name}"] = f"{type(error).__name__}: {error}"


RATES = (24.0, 60.0, 120.0)
"""Frames per second that motions are also played at: at 30, a formula without its rate may be right."""
NEARLY_STILL = {"cross_hands": (14.8, 15.6)}
"""Rates at which the reference accelerates by less and by more than a still clip, 0.1 heights/s^2."""
UNEVEN = Ground(
    heights=np.array([[0.0, 0.04, -0.03], [0.07, 0.01, 0.05]]), origin=(-0.9, -0.4), spacing=1.3
)
"""Metres; feet tread between its samples."""


def _questions(frozen: FrozenCase) -> Iterator[tuple[str, Case, Prediction]]:
    """Every prediction with its case; one of them also without labels, without any right answer, at other
    rates and on uneven ground."""
    for name, prediction in frozen.predictions.items():
        yield f"{frozen.name}/{name}", frozen.case, prediction
    name, prediction = next(iter(frozen.predictions.items()))
    yield f"{frozen.name}/{name}, no labels", replace(frozen.case, contacts=None), prediction
    unknown = {each.name: None for each in fields(Case) if each.default is None}
    yield f"{frozen.name}/{name}, no answer", replace(frozen.case, **unknown), prediction  # type: ignore[arg-type]
    yield f"{frozen.name}/{name}, uneven", replace(frozen.case, ground=UNEVEN), prediction
    for fps in (*RATES, *NEARLY_STILL.get(frozen.name, ())):
        yield f"{frozen.name}/{name}, {fps:g} fps", played(frozen.case, fps), replace(prediction, fps=fps)


# --------------------------------------------------------------------------------- metrics of sets
WINDOWS, FEATURES, CLIPS = 240, 16, 24
"""Size of the clouds: enough for every value to be defined, few enough to take no time."""
ROWS = ("one way", "the other", "three quarters of one")


def clouds() -> tuple[Sample, Sample]:
    """Two overlapping sets of points, the second narrower and to one side; the same wherever it is made."""
    drawn = np.random.Philox(key=5).random_raw(2 * WINDOWS * FEATURES * 4) >> np.uint64(11)
    # sums of four uniform numbers: nearly normal, by plain arithmetic
    points = (drawn.astype(np.float64) * 2.0**-53).reshape(2, WINDOWS, FEATURES, 4).sum(axis=-1) - 2.0
    clips = np.repeat([f"clip {number}" for number in range(CLIPS)], WINDOWS // CLIPS)
    return Sample(points[0], clips), Sample(0.8 * points[1] + 0.1, clips)


def set_values(metric: SetMetric, row: str) -> dict[str, float]:
    """Every value of the card of two clouds, one way round or the other, or of a part of one, which metrics
    make from the whole; undefined ones are left out."""
    real, generated = reversed(clouds()) if row == ROWS[1] else clouds()
    real = real.part(np.arange(WINDOWS * 3 // 4)) if row == ROWS[2] else real
    values = {value.id: metric.value(value.id, real, generated) for value in metric.card.values}
    return {key: float(each) for key, each in values.items() if math.isfinite(each)}


def set_features(metric: SetMetric, case: Case, prediction: Prediction) -> Values:
    """Sums over the features of a frozen motion, weighted so that their order counts.

    Empty where the body has no features, no right answer, or no window in the motion.
    """
    if case.reference is None:
        return {}
    try:
        features = metric.features(Comparison(case, prediction))
    except NotSupported:
        return {}
    if not len(features.generated):
        return {}
    weights = np.arange(1, features.generated.shape[1] + 1) / features.generated.shape[1]
    sums = {
        "generated": np.asarray(features.generated, dtype=np.float64) @ weights,
        "real": np.asarray(features.real, dtype=np.float64) @ weights,
        "speed": np.asarray(features.speed, dtype=np.float64),
    }
    return {f"{metric.card.name}.features": {name: float(each.mean()) for name, each in sums.items()}}
