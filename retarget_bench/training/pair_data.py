"""Training data out of pairs: clips of one name are the same performance by different characters."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from retarget_bench.api import optional
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.plan import method
from retarget_bench.evaluation.process_pool import LocalPool
from retarget_bench.evaluation.worker import register_plugins
from retarget_bench.motion.character import Character
from retarget_bench.plugins.registry import files as plugin_files
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.clips import Progress
from retarget_bench.training.data import ClipArrays, StoredClips, TrainingData, mapped, scratch
from retarget_bench.training.joint_datasets import dataset, split_spec

_GROUPS = 50
"""So many performances are one job."""


def gather_pairs(data: Spec, trainee: Spec, fps: float, jobs: int, progress: Progress) -> TrainingData:
    """Every performance of the training pairs of a data set, or of several, in a fixed order.

    Raises NotSupported where there is none, or one cannot be had.
    """
    parts = split_spec(data)
    payloads: list[dict[str, Any]] = []
    for number, part in enumerate(parts):
        pairs = optional.training_pairs(dataset(part))
        groups = range(0, len(pairs), pairs.together) if pairs is not None else range(0)
        common = {"dataset": part, "part": number, "method": trainee, "fps": fps, "plugins": plugin_files()}
        payloads += [
            {**common, "groups": groups[first : first + _GROUPS]}
            for first in range(0, len(groups), _GROUPS)
        ]
    if not payloads:
        raise NotSupported(f"{dataset(data).label} has no training pairs, which {trainee} learns from")
    clips: dict[str, list[ClipArrays]] = {}
    characters: dict[str, Character] = {}
    with scratch() as folder:
        progress(0, len(payloads))
        found: dict[int, tuple[dict[str, StoredClips], dict[str, Character]]] = {}
        for done in LocalPool(jobs).run(performances, [{**each, "folder": folder} for each in payloads]):
            if done.error:
                raise NotSupported(f"{data}: its training pairs cannot be had: {done.error}")
            found[done.job] = done.result
            progress(len(found), len(payloads))
        for job in range(len(payloads)):
            stored, bodies = found[job]
            characters |= bodies
            for name, each in stored.items():
                clips.setdefault(name, []).extend(mapped(name, each))
    return TrainingData(characters, {name: clips[name] for name in sorted(clips)}, ())


def performances(job: Mapping[str, Any]) -> tuple[dict[str, StoredClips], dict[str, Character]]:
    """Some performances as arrays in files, by character, and the characters: a worker's job."""
    register_plugins(job["plugins"])
    asked: Any = method(job["method"])
    pairs = optional.training_pairs(dataset(job["dataset"]))
    assert pairs is not None
    suffix = f"-{job['part'] + 1}" if job["part"] else ""
    arrays: dict[str, list[Mapping[str, np.ndarray]]] = {}
    names: dict[str, list[str]] = {}
    characters: dict[str, Character] = {}
    for first in job["groups"]:
        for index in range(first, first + pairs.together):
            pair = pairs[index]
            for performed in (pair.source, pair.target):
                body = performed.motion.character
                key, clip = body.name + suffix, pair.clip + suffix
                if clip in names.get(key, ()) or asked.unfit(body):
                    continue
                characters.setdefault(key, body)
                names.setdefault(key, []).append(clip)
                arrays.setdefault(key, []).append(asked.prepare(performed.motion.resample(job["fps"])))
    return {key: _stored(job["folder"], names[key], arrays[key]) for key in names}, characters


def _stored(folder: Path, names: Sequence[str], found: Sequence[Mapping[str, np.ndarray]]) -> StoredClips:
    """The arrays of one character's clips, in files of their own."""
    place = Path(mkdtemp(dir=folder))
    files = {}
    for key in found[0]:
        files[key] = place / f"{key}.npy"
        np.save(files[key], np.concatenate([np.asarray(each[key], np.float32) for each in found]))
    lengths = [len(next(iter(each.values()))) for each in found]
    return StoredClips(tuple(zip(names, lengths, strict=True)), files)
