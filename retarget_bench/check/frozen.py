"""Metrics on frozen motions: predictions with known faults, kept as files, that no generator can change."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

from retarget_bench import score
from retarget_bench.api import Case, Metric, Prediction
from retarget_bench.check import packing
from retarget_bench.check.table import Table, flat
from retarget_bench.errors import FileError

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
    folder: Path, metrics: Sequence[Metric], progress: Callable[[int, int], None]
) -> tuple[Table, dict[str, str]]:
    """Every value of every metric on every frozen motion, and ``<motion> <metric>`` -> what went wrong."""
    table: Table = {}
    failures: dict[str, str] = {}
    paths = sorted((folder / FOLDER).glob("*.npz"))
    for done, path in enumerate(paths, 1):
        for name, case, prediction in _asked(read(path)):
            table[name] = {}
            for metric in metrics:
                try:
                    table[name] |= flat(score.score([metric], case, prediction))
                except Exception as error:  # a metric's own fault is a finding, not the end
                    failures[f"{name} {metric.card.name}"] = f"{type(error).__name__}: {error}"
        progress(done, len(paths))
    return table, failures


def _asked(frozen: Frozen) -> Iterator[tuple[str, Case, Prediction]]:
    """Every prediction with its case; one of them also without labels, and one without any right answer."""
    for name, prediction in frozen.predictions.items():
        yield f"{frozen.name}/{name}", frozen.case, prediction
    name, prediction = next(iter(frozen.predictions.items()))
    yield f"{frozen.name}/{name}, no labels", replace(frozen.case, contacts=None), prediction
    known = {each.name: None for each in fields(Case) if each.default is None}
    yield f"{frozen.name}/{name}, no answer", replace(frozen.case, **known), prediction  # type: ignore[arg-type]
