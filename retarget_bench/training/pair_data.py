"""Training data out of pairs: clips of one name are the same performance by different characters."""

from collections.abc import Mapping
from typing import Any

from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.parallel import carried_out
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.clips import Progress
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.gather import StoredClips, scratch
from retarget_bench.training.joint_datasets import dataset, split_spec

_GROUPS = 100
"""So many performances are one job."""


def gather_pairs(data: Spec, trainee: Spec, fps: float, jobs: int, progress: Progress) -> TrainingData:
    """Every performance of the training pairs of a data set, or of several, in a fixed order.

    Raises NotSupported where there is none, or one cannot be had.
    """
    parts = split_spec(data)
    payloads: list[dict[str, Any]] = []
    for number, part in enumerate(parts):
        pairs = dataset(part).training_pairs()
        groups = range(0, len(pairs), pairs.together) if pairs is not None else range(0)
        common = {
            "dataset": part,
            "part": number,
            "method": trainee,
            "fps": fps,
            "plugins": registry.files(),
        }
        payloads += [
            {**common, "groups": groups[first : first + _GROUPS]}
            for first in range(0, len(groups), _GROUPS)
        ]
    if not payloads:
        raise NotSupported(f"{dataset(data).label} has no training pairs, which {trainee} learns from")
    clips: dict[str, list[ClipArrays]] = {}
    characters: dict[str, Character] = {}
    with scratch() as folder:
        results: dict[int, tuple[StoredClips, dict[str, Character]]] = {}
        progress(0, len(payloads))
        numbered = [{**each, "file": folder / str(number)} for number, each in enumerate(payloads)]
        for outcome in carried_out(performances, numbered, jobs):
            if outcome.error:
                raise NotSupported(f"{data}: its training pairs cannot be had: {outcome.error}")
            results[outcome.number] = outcome.result
            progress(len(results), len(payloads))
        for _, (stored, bodies) in sorted(results.items()):
            characters |= bodies
            for clip in stored.read():
                clips.setdefault(clip.character, []).append(clip)
    return TrainingData(characters, {name: clips[name] for name in sorted(clips)}, ())


def performances(job: Mapping[str, Any]) -> tuple[StoredClips, dict[str, Character]]:
    """Some performances as arrays in a file, and their characters: a worker's job."""
    registry.know_files(job["plugins"])
    method: Any = bound.method(job["method"]).built
    pairs = dataset(job["dataset"]).training_pairs()
    assert pairs is not None
    suffix = f"-{job['part'] + 1}" if job["part"] else ""
    clips: dict[tuple[str, str], ClipArrays] = {}
    characters: dict[str, Character] = {}
    for index in (first + number for first in job["groups"] for number in range(pairs.together)):
        pair = pairs[index]
        for motion in (pair.source.motion, pair.target.motion):
            name, clip = motion.character.name + suffix, pair.clip + suffix
            if (name, clip) not in clips and not method.unfit(motion.character):
                arrays = method.prepare(motion.resample(job["fps"]))
                clips[name, clip] = ClipArrays(name, clip, arrays)
                characters.setdefault(name, motion.character)
    return StoredClips.write(job["file"], list(clips.values())), characters
