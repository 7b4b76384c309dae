"""Files in which what metrics need of finished cases waits until all cases of a unit are done."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.results.store import ResultPaths, case_file, read_npz, write_npz

UNREADABLE = "cannot be read; score it anew with --overwrite always"


@dataclass(frozen=True, eq=False)
class Extract:
    """What a metric of pairs or sets needs of one case. facts: as JSON holds them. arrays: in single
    precision."""

    facts: Mapping[str, Any]
    arrays: Sequence[np.ndarray] = ()


def folder(paths: ResultPaths) -> Path:
    """The folder of a unit that is not complete."""
    return paths.folder / f"{paths.method}.waiting"


def file(paths: ResultPaths, case_id: str) -> Path:
    """The file of a finished case."""
    return folder(paths) / f"{case_file(case_id)}.npz"


def write(path: Path, extracts: Mapping[str, Extract]) -> None:
    """Write a case's extract for each metric, as two arrays: with a dozen small ones, the archive would
    take longer than their making. Raises FileError."""
    facts = {
        metric: {"facts": each.facts, "shapes": [array.shape for array in each.arrays]}
        for metric, each in extracts.items()
    }
    numbers = [np.asarray(array, np.float32).ravel() for each in extracts.values() for array in each.arrays]
    joined = np.concatenate(numbers) if numbers else np.zeros(0, np.float32)
    write_npz(path, {"facts": np.array(json.dumps(facts)), "numbers": joined})


def read(path: Path) -> dict[str, Extract]:
    """The extracts of a case, by metric. Raises FileError."""
    stored, extracts = read_npz(path, UNREADABLE), {}
    try:
        left = stored["numbers"]
        for metric, each in json.loads(str(stored["facts"])).items():
            arrays = []
            for shape in each["shapes"]:
                arrays.append(left[: math.prod(shape)].reshape(shape).copy())  # not the whole file's
                left = left[math.prod(shape) :]
            extracts[metric] = Extract(each["facts"], arrays)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise FileError(path, f"{UNREADABLE} ({error})") from error
    return extracts
