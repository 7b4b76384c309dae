"""Training data of a method: the unpaired clips of a data set as arrays, and windows drawn from them."""

import hashlib
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
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
from retarget_bench.training.augmentation.augmenter import Augmenter, ClipWindow
from retarget_bench.training.augmentation.body import AugmentedBody
from retarget_bench.training.augmentation.reshaping import carried, reshaped
from retarget_bench.training.clips import Progress, by_character, training_clips
from retarget_bench.training.config import Augmentation
from retarget_bench.training.joint_datasets import dataset

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class ClipArrays:
    """One clip of one character.

    arrays: ``(frames, ...)`` float32, as ``Trainable.prepare`` made them.
    motion: where windows are augmented, the ``rotations`` ``(frames, joints, 4)``, in aligned form, and the
            ``root`` ``(frames, 3)`` that they were made of; else empty.
    """

    character: str
    name: str
    arrays: Arrays
    motion: Arrays = field(default_factory=dict)

    @property
    def frames(self) -> int:
        return len(next(iter(self.arrays.values())))

    def starts(self, frames: int, hop: int = 1) -> range:
        """First frames of windows ``frames`` long: multiples of ``hop``. One where the clip is shorter."""
        return range(0, max(self.frames - frames, 0) + 1, hop)


LeftOut = Callable[[ClipArrays, Sequence[int]], Collection[int]]
"""Those of the starts of a clip's windows that are never drawn; some window of each character must be."""


@dataclass(frozen=True, eq=False)
class WindowBatch:
    """Rows of a batch that were cut from clips.

    arrays:     ``(rows, frames, ...)``; a clip that is shorter than a window is followed by zeros.
    lengths:    ``(rows,)`` int64: how many frames of each row are real.
    characters: whose clip each row is from.
    """

    arrays: Arrays
    lengths: np.ndarray
    characters: tuple[str, ...]

    @property
    def mask(self) -> np.ndarray:
        """``(rows, frames)`` bool: False at padding."""
        frames = next(iter(self.arrays.values())).shape[1]
        return np.asarray(np.arange(frames) < self.lengths[:, None])


@dataclass(frozen=True, eq=False)
class TrainingData:
    """All clips, by character.

    characters: name -> body, of those that have clips. clips: character -> its clips.
    notes:      sentences on what was left out and why.
    augmenter:  changes windows as they are drawn; None: they are as the clips have them.
    """

    characters: Mapping[str, Character]
    clips: Mapping[str, Sequence[ClipArrays]]
    notes: Sequence[str] = ()
    augmenter: Augmenter | None = None
    _counted: dict[Any, tuple[Sequence[Sequence[int]], np.ndarray]] = field(
        default_factory=dict, init=False, repr=False
    )

    @cached_property
    def structures(self) -> Mapping[str, tuple[str, ...]]:
        """Structure -> names of its characters, both sorted."""
        names: dict[str, list[str]] = {}
        for name in sorted(self.clips):
            names.setdefault(self.characters[name].structure, []).append(name)
        return {name: tuple(names[name]) for name in sorted(names)}

    @cached_property
    def hash(self) -> str:
        """Sixteen hex digits of every array with its name and shape, whose clip it is, in a fixed order."""
        digest = hashlib.sha256()
        for name in sorted(self.clips):
            for clip in self.clips[name]:
                for key, array in sorted(clip.arrays.items()):
                    digest.update(repr((name, clip.name, key, array.shape, array.dtype.str)).encode())
                    digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()[:16]

    @cached_property
    def frames(self) -> int:
        """Of all clips together."""
        return sum(clip.frames for clips in self.clips.values() for clip in clips)

    def draw(
        self,
        numbers: np.random.Generator,
        characters: Sequence[str],
        frames: int,
        hop: int = 1,
        left_out: LeftOut | None = None,
    ) -> WindowBatch:
        """One window per character, each start of each of its clips as likely as any other.

        hop: windows begin at multiples of it; left_out: but at these. Arrays of characters that differ in
        shape (in joints) are followed by zeros. Single frames are not augmented.
        """
        cuts = [self._cut(numbers, name, frames, hop, left_out) for name in characters]
        shapes = {
            key: np.max([clip.arrays[key].shape[1:] for clip, _ in cuts], axis=0, initial=0).tolist()
            for key in cuts[0][0].arrays
        }
        rows = {
            key: np.zeros((len(cuts), frames, *map(int, shapes[key])), array.dtype)
            for key, array in cuts[0][0].arrays.items()
        }
        lengths = np.array([min(frames, clip.frames - start) for clip, start in cuts])
        changed: Mapping[int, Arrays] = {}
        if self.augmenter is not None and frames > 1:
            windows = [
                ClipWindow(self._augmented[clip.character], **clip.motion, start=start, length=length)
                for (clip, start), length in zip(cuts, lengths.tolist(), strict=True)
            ]
            changed = self.augmenter.changed(numbers, windows, warping=left_out is None)
        for row, (clip, start) in enumerate(cuts):
            for key, array in clip.arrays.items():
                window = changed[row][key] if row in changed else array[start : start + frames]
                part = (slice(lengths[row]), *(slice(size) for size in array.shape[1:]))
                rows[key][row][part] = window
        return WindowBatch(rows, lengths, tuple(characters))

    def cast(
        self, numbers: np.random.Generator, rows: int, among: Sequence[str] | None = None
    ) -> list[str]:
        """Names for the rows of a batch, each character (of ``among``) as likely as any other."""
        names = sorted(self.clips) if among is None else list(among)
        return [names[k] for k in numbers.integers(len(names), size=rows)]

    def another(self, numbers: np.random.Generator, name: str) -> str:
        """A character other than this one, each as likely; there are two or more."""
        names = sorted(self.clips)
        step = 1 + int(numbers.integers(len(names) - 1))
        return names[(names.index(name) + step) % len(names)]

    def stacked(self, key: str, characters: Sequence[str] | None = None) -> np.ndarray:
        """``(frames of all clips, ...)``: one array of every clip in a row, for statistics."""
        names = sorted(self.clips) if characters is None else characters
        return np.concatenate([clip.arrays[key] for name in names for clip in self.clips[name]])

    @cached_property
    def _augmented(self) -> Mapping[str, AugmentedBody]:
        return {name: AugmentedBody(body) for name, body in self.characters.items()}

    def _cut(
        self, numbers: np.random.Generator, name: str, frames: int, hop: int, left_out: LeftOut | None
    ) -> tuple[ClipArrays, int]:
        starts, ends = self._starts(name, frames, hop, left_out)
        at = int(numbers.integers(ends[-1]))
        number = int(np.searchsorted(ends, at, side="right"))
        return self.clips[name][number], starts[number][at - int(ends[number - 1] if number else 0)]

    def _starts(
        self, name: str, frames: int, hop: int, left_out: LeftOut | None
    ) -> tuple[Sequence[Sequence[int]], np.ndarray]:
        """First frames of the windows of each clip, and ``(clips,)`` their number up to each."""
        key = (name, frames, hop, left_out)
        if key not in self._counted:
            starts: list[Sequence[int]] = [clip.starts(frames, hop) for clip in self.clips[name]]
            if left_out is not None:
                without = [left_out(*each) for each in zip(self.clips[name], starts, strict=True)]
                starts = [
                    [start for start in firsts if start not in odd]
                    for firsts, odd in zip(starts, without, strict=True)
                ]
            self._counted[key] = starts, np.cumsum([len(firsts) for firsts in starts])
        return self._counted[key]


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
