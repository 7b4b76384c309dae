"""Training clips of data sets, as arrays that a method has prepared from them, in a fixed order."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

import numpy as np

from retarget_bench.api import Dataset, TrainingClips
from retarget_bench.errors import NotSupported, Unusable, some
from retarget_bench.files import cache_folder, slug
from retarget_bench.motion.character import Character, Motion
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.augmentation.augmenter import Augmenter
from retarget_bench.training.augmentation.body import AugmentedBody
from retarget_bench.training.augmentation.reshaping import carried, reshaped
from retarget_bench.training.clips import Progress, by_character, training_clips
from retarget_bench.training.config import Augmentation
from retarget_bench.training.data import Arrays, ClipArrays, TrainingData
from retarget_bench.training.joint_datasets import dataset


def gather(
    data: Spec,
    trainee: Spec,
    fps: float,
    jobs: int,
    progress: Progress,
    augmentation: Augmentation | None = None,
) -> TrainingData:
    """Every training clip that the method can take, in a fixed order.

    Raises NotSupported where nothing is left to train on or a clip cannot be had.
    """
    listed = training_clips(dataset(data))
    method: Any = bound.method(trainee).built
    cast = {name: clips for characters in listed.values() for name, clips in characters.items()}
    bodies = _bodies(dataset(data), cast)
    unfit = {name: why for name, body in bodies.items() if (why := method.unfit(body))}
    unfit |= dict.fromkeys(sorted(set(cast) - set(bodies)), "none of its clips can be used")
    fit = [name for name in bodies if name not in unfit]
    common = {"dataset": data, "method": trainee, "fps": fps, "augmentation": augmentation}
    included: dict[str, list[ClipArrays]] = {}
    with scratch() as folder:
        results = by_character(clips_of, fit, {**common, "folder": folder}, jobs, progress)
        for stored, *_ in results.values():
            for clip in stored.read():
                included.setdefault(clip.character, []).append(clip)
    others = (_reshaped(bodies[name], method, augmentation) for name in fit)
    bodies |= {other.name: other for other in others if other is not None}
    if not included:
        why = f": {next(iter(unfit.values()))}" if unfit else ""
        raise NotSupported(f"{dataset(data).label} has no motion that {trainee} can be trained on{why}")
    notes = _unfit(unfit)
    notes += dataset(data).training_notes
    for name, (_, number, _) in results.items():
        if number:
            clips = f"{number} clip{'s' * (number > 1)}"
            notes.append(f"not trained on {clips} of {name}, in which the body is another one")
    notes += _unusable({name: unusable for name, (*_, unusable) in results.items() if unusable})
    augmenter = None if augmentation is None else Augmenter(augmentation, fps, method.prepare)
    return TrainingData({name: bodies[name] for name in included}, included, tuple(notes), augmenter)


_FEW = 5
"""Characters that are left out, or have unusable clips, up to which each has a note of its own."""


def _unfit(reasons: Mapping[str, str]) -> list[str]:
    """Sentences on characters that a method cannot be trained on, with the reason for each."""
    each = [f"{name}: {why}" for name, why in reasons.items()]
    if len(each) <= _FEW:
        return [f"not trained on {one}" for one in each]
    return [f"not trained on {len(each)} characters: {some(each, 3)}"]


def _unusable(unusable: Mapping[str, Sequence[str]]) -> list[str]:
    """Sentences on clips that cannot be used, by character."""
    if len(unusable) <= _FEW:
        return [
            f"not trained on {len(clips)} clip{'s' * (len(clips) > 1)} of {name}: {some(clips, 10)}"
            for name, clips in unusable.items()
        ]
    every = [clip for clips in unusable.values() for clip in clips]
    return [f"not trained on {len(every)} clips of {len(unusable)} characters: {some(every, 10)}"]


_Shapes = Mapping[str, tuple[int, ...]]


@dataclass(frozen=True)
class StoredClips:
    """Arrays of clips in one file, clip after clip, float32.

    clips: of each, in order, character, name, frames, and array -> its shape without frames, of
    ``ClipArrays.arrays`` and of ``motion``.
    """

    file: Path
    clips: tuple[tuple[str, str, int, _Shapes, _Shapes], ...]

    @classmethod
    def write(cls, file: Path, clips: Sequence[ClipArrays]) -> Self:
        """Raises OSError."""
        with file.open("wb") as out:
            for clip in clips:
                for array in (*clip.arrays.values(), *clip.motion.values()):
                    np.ascontiguousarray(array, np.float32).tofile(out)

        def shapes(arrays: Arrays) -> _Shapes:
            return {key: array.shape[1:] for key, array in arrays.items()}

        facts = ((c.character, c.name, c.frames, shapes(c.arrays), shapes(c.motion)) for c in clips)
        return cls(file, tuple(facts))

    def read(self) -> list[ClipArrays]:
        """Clips whose arrays are read from disk as they are needed, so that any amount of motion fits. The
        file is mapped once, since a process may only have so many open."""
        if not self.clips:
            return []
        values = np.asarray(np.memmap(self.file, np.float32, mode="r"))
        clips, first = [], 0
        for character, name, frames, *kinds in self.clips:
            parts: list[dict[str, np.ndarray]] = []
            for shapes in kinds:
                parts.append({})
                for key, shape in shapes.items():
                    size = frames * math.prod(shape)
                    parts[-1][key] = values[first : first + size].reshape(frames, *shape)
                    first += size
            clips.append(ClipArrays(character, name, *parts))
        return clips


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder that is gone afterwards; what is mapped into memory from it stays readable."""
    try:
        place: Path | None = cache_folder() / "training"
        assert place is not None
        place.mkdir(parents=True, exist_ok=True)
    except OSError:
        place = None
    with TemporaryDirectory(dir=place, ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def clips_of(job: Mapping[str, Any]) -> tuple[StoredClips, int, list[str]]:
    """The clips of one character as arrays in files, the number of those left out since their body is
    another one, and those that cannot be used, each with the reason; what a worker process does."""
    registry.know_files(job["plugins"])
    name, method, data = job["character"], bound.method(job["method"]).built, dataset(job["dataset"])
    (clips,) = (characters[name] for characters in training_clips(data).values() if name in characters)
    body = _bodies(data, {name: clips})[name]
    augmentation = job["augmentation"]
    other = _reshaped(body, method, augmentation)
    usable: list[ClipArrays] = []
    others, unusable = 0, []
    for number in range(len(clips)):
        try:
            motion = clips[number].resample(job["fps"])
        except Unusable as error:
            unusable.append(f"{error.clip} ({error.why})")
            continue
        if not _alike(body, motion.character):
            others += 1
        elif motion.frames > 1:
            usable.append(_prepared(motion, name, clips.names[number], method, augmentation))
            if other is not None:
                again = carried(motion, other)
                usable.append(_prepared(again, other.name, clips.names[number], method, augmentation))
    return StoredClips.write(job["folder"] / slug(name), usable), others, unusable


def _prepared(
    motion: Motion, character: str, clip: str, method: Any, augmentation: Augmentation | None
) -> ClipArrays:
    arrays = {key: np.asarray(array, np.float32) for key, array in method.prepare(motion).items()}
    return ClipArrays(character, clip, arrays, _source(motion) if augmentation is not None else {})


def _reshaped(body: Character, method: Any, augmentation: Augmentation | None) -> Character | None:
    """The further body that augmentation makes of one, where it does."""
    if augmentation is None or not augmentation.slant:
        return None
    other = reshaped(body, augmentation.slant)
    return None if other is None or method.unfit(other) else other


def _source(motion: Motion) -> Arrays:
    """See ``ClipArrays.motion``."""
    aligned = AugmentedBody(motion.character).see(motion)
    return {"rotations": aligned.astype(np.float32), "root": motion.root.astype(np.float32)}


def _alike(body: Character, other: Character) -> bool:
    """The same joints, and bones of the same lengths to a thousandth of the height."""
    if body is other:
        return True
    skeleton, other_skeleton = body.skeleton, other.skeleton
    if (
        skeleton.names != other_skeleton.names
        or skeleton.parents.tolist() != other_skeleton.parents.tolist()
    ):
        return False
    lengths = (np.linalg.norm(each.offsets[1:], axis=-1) for each in (skeleton, other_skeleton))
    return bool(np.abs(np.subtract(*lengths)).max(initial=0.0) <= 1e-3 * body.height)


def _bodies(data: Dataset, cast: Mapping[str, Any]) -> dict[str, Character]:
    """The characters themselves; one that no case shows is known by its first usable clip, or left out."""
    shown = data.characters()
    bodies = {name: shown[name] if name in shown else _body(cast[name]) for name in sorted(cast)}
    return {name: body for name, body in bodies.items() if body is not None}


def _body(clips: TrainingClips) -> Character | None:
    for number in range(len(clips)):
        with suppress(Unusable):
            return clips[number].character
    return None
