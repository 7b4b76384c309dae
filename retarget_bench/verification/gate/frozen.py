"""Metrics on frozen motions: predictions with known faults, kept as files, that no generator can change."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import cast

from retarget_bench.api import Case, Metric, Prediction, SetMetric
from retarget_bench.errors import FileError
from retarget_bench.evaluation import score
from retarget_bench.verification.gate import packing, sets
from retarget_bench.verification.gate.table import Table, flat

FOLDER = "frozen"


@dataclass(frozen=True)
class Frozen:
    """One case and several predictions of it.

    predictions: name of the fault -> prediction. origin: what it was made from, and how.
    """

    name: str
    case: Case
    predictions: Mapping[str, Prediction]
    origin: str


def write(folder: Path, frozen: Frozen) -> None:
    """One file ``<name>.npz``. Raises FileError."""
    parts = {"case": frozen.case, "predictions": frozen.predictions, "origin": frozen.origin}
    packing.write(folder / f"{frozen.name}.npz", parts)


def read(path: Path) -> Frozen:
    """Raises FileError where the file is missing, damaged, from a newer version or something else."""
    parts = packing.read(path)
    try:
        return Frozen(path.stem, parts["case"], parts["predictions"], parts["origin"])
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
            if not hasattr(metric, "compute") and (hash_ := sets.network(metric, held.case)):
                found.networks.setdefault(metric.card.name, {})[held.case.target.structure] = hash_
            for name, case, prediction in _asked(held):
                found.keep(name, metric, partial(_columns, metric, case, prediction))
        progress(done, len(paths))
    for metric in metrics:
        if not hasattr(metric, "compute"):
            for name in sets.ROWS:
                found.keep(name, metric, partial(sets.values, metric, name))
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
    if hasattr(metric, "compute"):
        return flat(score.score([cast(Metric, metric)], case, prediction))
    return sets.features(metric, case, prediction)


def _asked(frozen: Frozen) -> Iterator[tuple[str, Case, Prediction]]:
    """Every prediction with its case; one of them also without labels, and one without any right answer."""
    for name, prediction in frozen.predictions.items():
        yield f"{frozen.name}/{name}", frozen.case, prediction
    name, prediction = next(iter(frozen.predictions.items()))
    yield f"{frozen.name}/{name}, no labels", replace(frozen.case, contacts=None), prediction
    known = {each.name: None for each in fields(Case) if each.default is None}
    yield f"{frozen.name}/{name}, no answer", replace(frozen.case, **known), prediction  # type: ignore[arg-type]
