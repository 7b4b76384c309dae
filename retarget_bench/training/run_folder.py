"""The folder of a run: its record, ``run.json``, the tensors of its last checkpoint, and the lock.

Those of step N are ``step-N.safetensors``: all that the next step depends on (``modules/...``,
``optimisers/PHASE/...``, and ``average/...`` where weights are averaged), and the best weights so far, as
exported, in full precision (``best/...``). They are written first, then the record replaces the one before
it, then older tensors are removed. So a process that dies at any moment leaves a whole checkpoint, and a
full disk leaves the one before it.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from retarget_bench import files
from retarget_bench.errors import FileError
from retarget_bench.files import LOCK
from retarget_bench.training import tensor_files
from retarget_bench.training.record import Run
from retarget_bench.training.weights import RUN

NAME = RUN
KIND = "the record of a training run"


def read(folder: Path) -> Run | None:
    """The run that a folder holds; None: it holds none. Raises FileError."""
    path = folder / NAME
    if not path.exists():
        return None
    run = tensor_files.read_record(path, Run, KIND)
    if min(run.recipe.batch, run.recipe.window) < 1 or min(run.steps, run.step, run.recipe.steps) < 0:
        raise FileError(path, f"is not {KIND} (a number of rows, frames or steps is none or below zero)")
    if run.scored_as.partition("[")[0] not in ("", run.method):
        raise FileError(path, f"is not {KIND} (it is one of {run.method} and of {run.scored_as})")
    return run


def write(folder: Path, run: Run) -> None:
    """The record of a run whose checkpoint is as it was, or that has none yet. Raises FileError."""
    tensor_files.write_record(folder / NAME, run)


def save(folder: Path, run: Run, tensors: Mapping[str, Tensor]) -> Run:
    """Store a checkpoint in place of the one before; the run with its hash.

    Raises FileError (a full disk), which keeps the one before.
    """
    arrays = {name: _array(each) for name, each in tensors.items()}
    run = tensor_files.write(folder / NAME, run, arrays, _file(folder, run))
    for path in folder.glob("*step-[0-9]*.safetensors"):  # also what a killed process left half written
        if path != _file(folder, run):
            path.unlink(missing_ok=True)
    return run


def tensors(folder: Path, run: Run) -> dict[str, Tensor]:
    """Those of a run's checkpoint, on the CPU; none before the first.

    Raises FileError where they are missing or damaged.
    """
    if not run.steps:
        return {}
    arrays = tensor_files.read_arrays(_file(folder, run), folder / NAME, run.hash)
    return {name: torch.from_numpy(np.array(each)) for name, each in arrays.items()}


def locked(folder: Path) -> AbstractContextManager[None]:
    """The folder for this process alone: see ``files.locked``."""
    return files.locked(folder / LOCK, f"another process is training in {folder}")


def _file(folder: Path, run: Run) -> Path:
    return folder / f"step-{run.steps}.safetensors"


def _array(tensor: Tensor) -> np.ndarray:
    # NumPy has no bfloat16, whose numbers single precision holds exactly
    return (tensor.float() if tensor.dtype == torch.bfloat16 else tensor).detach().cpu().numpy()
