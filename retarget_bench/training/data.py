"""Training data of a method: the unpaired clips of a data set as arrays, and windows drawn from them."""

import hashlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.training.augmentation.augmenter import Augmenter, ClipWindow
from retarget_bench.training.augmentation.body import AugmentedBody

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
