"""What a card says of the motion, the machine, and what weights have seen."""

import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import torch

from retarget_bench.api import Dataset
from retarget_bench.errors import BenchError
from retarget_bench.training import log, parallel
from retarget_bench.training.data import TrainingData
from retarget_bench.training.joint_datasets import JointDataset
from retarget_bench.training.record import Record, Run

POINTS = 40
"""Of the loss curve on a card."""
OTHER_DATA = "{} is no longer the data that this run began with; train anew in another folder"
UNKNOWN = "what the weights that training began with have seen is not known in full"
UNWATCHED = "no weights were chosen by validation, these are the last ones"


def completed(run: Run, data: Dataset, training_data: TrainingData, device: torch.device) -> Run:
    """The run with what is known when its motion is gathered, whether it begins or goes on.

    Raises BenchError where it began with other motion.
    """
    if run.data.motion not in ("", training_data.hash):
        raise BenchError(OTHER_DATA.format(run.dataset))
    motion = replace(
        run.data,
        motion=training_data.hash,
        clips=sum(map(len, training_data.clips.values())),
        hours=round(training_data.frames / run.recipe.fps / 3600, 3),
    )
    return replace(
        run,
        data=motion,
        hardware=hardware(device),
        torch=torch.__version__,
        processes=parallel.world(),
        job=parallel.job(),
        training_manifest=joined(run.training_manifest or {}, manifest(data, training_data)),
        notes=list(dict.fromkeys((*training_data.notes, *run.notes))),
    )


def card(run: Run, folder: Path) -> Record:
    """The card of the run's weights as they are now."""
    unwatched = [] if run.best else [UNWATCHED]
    return replace(
        run.record,
        recipe=replace(run.recipe, steps=run.limit.steps),  # of the preset's none where time was limited
        seconds=round(run.seconds),
        curve=log.losses(folder, POINTS),
        notes=[*run.notes, *unwatched],
    )


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
