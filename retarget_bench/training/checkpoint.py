"""Checkpoints: tensors as ``step-N.safetensors``, and ``checkpoint.json``, which names those that count.

Tensors are written first, then the JSON file replaces the one before it, then older tensors are removed. So
a process that dies at any moment leaves a whole checkpoint, and a full disk leaves the one before it.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
from torch import Tensor

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, write_text

SCHEMA = 1
NAME = "checkpoint.json"
_TENSORS = re.compile(r"\b(step|best)-\d+\.safetensors$")
"""Also what a killed process left half written, whose name begins with a dot."""


@dataclass(frozen=True)
class Best:
    """The best weights so far: the step they are of, their score, and what was measured by split."""

    step: int
    score: float
    scores: Mapping[str, Any]


@dataclass(frozen=True)
class Checkpoint:
    """State of a run.

    step:     steps done. seconds: what they took, over all resumptions.
    state:    everything that the next step depends on: ``modules/...`` and ``optimisers/PHASE/...``, and
              ``average/...`` where weights are averaged.
    best:     None before the first validation. exported: the tensors of those weights, as exported.
    validation: of every validation the step, seconds, scores and number of cases by split.
    """

    step: int
    seconds: float
    state: Mapping[str, Tensor]
    best: Best | None = None
    exported: Mapping[str, Tensor] = field(default_factory=dict)
    validation: tuple[Mapping[str, Any], ...] = ()


def write(folder: Path, checkpoint: Checkpoint) -> None:
    """Store a checkpoint in place of the one before. Raises FileError (a full disk), which keeps that."""
    before = _listed(folder)
    facts: dict[str, Any] = {
        "schema": SCHEMA,
        "step": checkpoint.step,
        "seconds": round(checkpoint.seconds, 3),
        "state": _put(folder / f"step-{checkpoint.step}.safetensors", checkpoint.state),
        "best": None,
        "validation": list(checkpoint.validation),
    }
    if (best := checkpoint.best) is not None:
        stored = before.get("best") if before else None
        if stored is None or stored["step"] != best.step:
            stored = _put(folder / f"best-{best.step}.safetensors", checkpoint.exported)
        facts["best"] = {**vars(best), "file": stored["file"], "sha256": stored["sha256"]}
    write_text(folder / NAME, json.dumps(facts, indent=1) + "\n")
    current = {facts["state"]["file"], facts["best"]["file"] if facts["best"] else ""}
    for path in folder.glob("*.safetensors"):
        if _TENSORS.search(path.name) and path.name not in current:
            path.unlink(missing_ok=True)


def read(folder: Path) -> Checkpoint | None:
    """The last checkpoint of a run, tensors on the CPU; None where there is none yet.

    Raises FileError where a file is missing or damaged.
    """
    facts = _listed(folder)
    if facts is None:
        return None
    best = facts["best"]
    try:
        return Checkpoint(
            step=int(facts["step"]),
            seconds=float(facts["seconds"]),
            state=_get(folder, facts["state"]),
            best=Best(int(best["step"]), float(best["score"]), dict(best["scores"])) if best else None,
            exported=_get(folder, best) if best else {},
            validation=tuple(dict(each) for each in facts["validation"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(folder / NAME, f"is not a readable checkpoint ({error!r})") from error


def _listed(folder: Path) -> dict[str, Any] | None:
    path = folder / NAME
    try:
        facts: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if facts["schema"] != SCHEMA:
            raise FileError(path, f"is of format {facts['schema']}; this version reads format {SCHEMA}")
        if lacking := {"step", "seconds", "state", "best", "validation"} - set(facts):
            raise FileError(path, f"is not a readable checkpoint (it lacks {', '.join(sorted(lacking))})")
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(path, f"is not a readable checkpoint ({error})") from error
    return facts


def _put(path: Path, tensors: Mapping[str, Tensor]) -> dict[str, str]:
    """Write tensors; the file's name and hash."""
    # copies: two names may share memory, which the format does not take
    data = safetensors.torch.save({key: tensor.detach().cpu().clone() for key, tensor in tensors.items()})
    with atomic(path) as temporary:
        temporary.write_bytes(data)
    return {"file": path.name, "sha256": hashlib.sha256(data).hexdigest()}


def _get(folder: Path, entry: Mapping[str, str]) -> dict[str, Tensor]:
    path = folder / entry["file"]
    try:
        data = path.read_bytes()
        if hashlib.sha256(data).hexdigest() != entry["sha256"]:
            raise FileError(path, f"is not the file that {NAME} names: its hash differs")
        return safetensors.torch.load(data)
    except (OSError, safetensors.SafetensorError) as error:
        raise FileError(path, f"cannot be read ({error})") from error
