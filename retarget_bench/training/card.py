"""The card of trained weights: their data, training config, budget, machine and scores."""

import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from retarget_bench.api import Dataset
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import log, parallel
from retarget_bench.training.checkpoint import Checkpoint
from retarget_bench.training.data import TrainingData
from retarget_bench.training.joint_datasets import JointDataset
from retarget_bench.training.request import Request, without_places

POINTS = 40
"""Of the loss curve on a card."""
UNPARTED = "the data set has no validation part"
UNKNOWN = "what the weights that training began with have seen is not known in full"
PARTS = (
    "the training motion, and for validation the cases that the data keep for that; a part 'test' in "
    "content names the cases that they offer for tests, which were not used"
)
UNWATCHED = "no weights were chosen by validation, these are the last ones"


def card(
    request: Request,
    data: Dataset,
    training_data: TrainingData,
    at: Checkpoint,
    folder: Path,
    device: torch.device,
) -> dict[str, Any]:
    """Plain data, as ``weights.py`` describes it."""
    losses = log.losses(folder, POINTS)
    best, spec = at.best, Spec.parse(request.method)
    # without the weights that were asked for: those that are trained were scored
    scored = Spec(spec.name, {name: x for name, x in spec.parameters.items() if name != "weights"})
    config = asdict(request.recipe)
    if not request.limit.steps:  # the time was limited, not the preset's number of steps
        del config["steps"]
    unknown = [UNKNOWN] if request.init and not request.seen_all else []
    before = [f"the budget was first {', then '.join(request.earlier)}"] if request.earlier else []
    return {
        "method": spec.name,
        "version": request.version,
        "facts": dict(request.facts),
        "data": {
            "spec": without_places(request.dataset),
            "label": data.label,
            "parts": PARTS,
            "content": request.content,
            "motion": request.motion,
            "clips": sum(map(len, training_data.clips.values())),
            "hours": round(training_data.frames / request.recipe.fps / 3600, 3),
        },
        "recipe": config,
        "preset": request.preset,
        "budget": request.budget,
        "command": request.command,
        "seed": request.seed,
        "steps": at.step,
        "step": best.step if best else at.step,
        "seconds": round(at.seconds),
        "hardware": hardware(device),
        "torch": torch.__version__,
        "processes": parallel.world(),
        "init": request.init or None,
        "losses": {name: value for name, value in losses[-1].items() if name != "step"} if losses else {},
        "curve": losses,
        "validation": list(at.validation),
        "scores": dict(best.scores) if best else {},
        "scored_as": str(scored) if best else "",
        "training_manifest": joined(request.seen, manifest(data, training_data)),
        "notes": [*training_data.notes, *before, *unknown, *([] if best else [UNWATCHED])],
    }


def manifest(data: Dataset, training_data: TrainingData) -> dict[str, list[str]]:
    """All that training and its validation have seen, by the data set's manifest, without the characters,
    structures and clips that were left out; the training data alone where the data set has none."""
    if isinstance(data, JointDataset):
        lists: dict[str, list[str]] = {}
        for member in data.members:
            lists = joined(lists, _manifest(member.data, member.names, training_data))
        return lists
    return _manifest(data, {name: name for name in training_data.clips}, training_data)


def _manifest(data: Dataset, names: Mapping[str, str], training_data: TrainingData) -> dict[str, list[str]]:
    """The same of one data set. names: what it calls its characters -> what the training data call them."""
    included = {own: name for own, name in names.items() if name in training_data.clips}
    manifest = data.training_manifest()
    if not manifest:
        structures = {training_data.characters[name].structure for name in included.values()}
        return {"characters": sorted(included), "structures": sorted(structures)}
    offered = data.training()
    out = {name for cast in offered.values() for name in cast} - set(included)
    out |= {structure for structure, cast in offered.items() if out.issuperset(cast)}
    listed = {clip for cast in offered.values() for clips in cast.values() for clip in clips.names}
    unused = listed - {clip.name for name in included.values() for clip in training_data.clips[name]}
    without = {key: unused if key == "clips" else out for key in manifest}
    return {
        key: [str(name) for name in names if name not in without[key]] for key, names in manifest.items()
    }


def joined(before: Mapping[str, Sequence[str]], now: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Two manifests as one, key by key: of weights that were trained, and trained again."""
    keys = dict.fromkeys((*now, *before))
    return {key: list(dict.fromkeys((*before.get(key, ()), *now.get(key, ())))) for key in keys}


def hardware(device: torch.device) -> str:
    """The GPU's name; or the processor's and how many threads torch uses on it."""
    if device.type == "cuda":
        return torch.cuda.get_device_name(device)
    lines: list[str] = []
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    model_names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    processor = next(model_names, platform.processor() or platform.machine())
    return f"{processor}, {torch.get_num_threads()} threads"
