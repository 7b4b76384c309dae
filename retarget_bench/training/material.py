"""What a method is trained on: the unpaired clips of a data set as arrays, and windows drawn from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.api import Dataset
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.executor import LocalPool
from retarget_bench.motion.character import Character
from retarget_bench.plan import dataset, method
from retarget_bench.registry import files as plugin_files
from retarget_bench.spec import Spec
from retarget_bench.work import know

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Clip:
    """One clip of one character: arrays ``(frames, ...)`` float32, as ``Trainable.prepare`` made them."""

    character: str
    name: str
    arrays: Arrays

    @property
    def frames(self) -> int:
        return len(next(iter(self.arrays.values())))


@dataclass(frozen=True, eq=False)
class Windows:
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
class Material:
    """All clips, by character.

    characters: name -> body, of those that have clips. clips: character -> its clips.
    notes:      sentences on what was left out and why.
    """

    characters: Mapping[str, Character]
    clips: Mapping[str, Sequence[Clip]]
    notes: Sequence[str] = field(default=())

    @cached_property
    def structures(self) -> Mapping[str, tuple[str, ...]]:
        """Structure -> names of its characters, both sorted."""
        found: dict[str, list[str]] = {}
        for name in sorted(self.clips):
            found.setdefault(self.characters[name].structure, []).append(name)
        return {name: tuple(found[name]) for name in sorted(found)}

    @cached_property
    def frames(self) -> int:
        """Of all clips together."""
        return sum(clip.frames for mine in self.clips.values() for clip in mine)

    def draw(self, numbers: np.random.Generator, characters: Sequence[str], frames: int) -> Windows:
        """One window per character asked for, each start of each of its clips as likely as any other."""
        cuts = [self._cut(numbers, name, frames) for name in characters]
        first = cuts[0][0].arrays
        rows = {
            key: np.zeros((len(cuts), frames, *array.shape[1:]), array.dtype)
            for key, array in first.items()
        }
        lengths = np.zeros(len(cuts), dtype=np.int64)
        for row, (clip, start) in enumerate(cuts):
            lengths[row] = min(frames, clip.frames - start)
            for key, array in clip.arrays.items():
                rows[key][row, : lengths[row]] = array[start : start + frames]
        return Windows(rows, lengths, tuple(characters))

    def cast(
        self, numbers: np.random.Generator, rows: int, among: Sequence[str] | None = None
    ) -> list[str]:
        """Names for the rows of a batch, each character (of ``among``) as likely as any other."""
        names = sorted(self.clips) if among is None else list(among)
        return [names[k] for k in numbers.integers(len(names), size=rows)]

    def stacked(self, key: str, characters: Sequence[str] | None = None) -> np.ndarray:
        """``(frames of all clips, ...)``: one array of every clip in a row, for statistics."""
        names = sorted(self.clips) if characters is None else characters
        return np.concatenate([clip.arrays[key] for name in names for clip in self.clips[name]])

    def _cut(self, numbers: np.random.Generator, name: str, frames: int) -> tuple[Clip, int]:
        ends = self._starts(name, frames)
        at = int(numbers.integers(ends[-1]))
        number = int(np.searchsorted(ends, at, side="right"))
        return self.clips[name][number], at - int(ends[number - 1] if number else 0)

    def _starts(self, name: str, frames: int) -> np.ndarray:
        """``(clips,)`` how many windows the clips up to each have."""
        key = (name, frames)
        if key not in self._counted:
            counts = [max(clip.frames - frames, 0) + 1 for clip in self.clips[name]]
            self._counted[key] = np.cumsum(counts)
        return self._counted[key]

    @cached_property
    def _counted(self) -> dict[tuple[str, int], np.ndarray]:
        return {}


def gather(
    data: Spec, trainee: Spec, fps: float, jobs: int, progress: Callable[[int, int], None]
) -> Material:
    """Every training clip that the method can take, in a fixed order.

    progress: called with the number of characters done and their total.
    Raises NotSupported where nothing is left to train on, BenchError where a clip cannot be had.
    """
    listed = _training(dataset(data))
    asked: Any = method(trainee)
    cast = {name: clips for mine in listed.values() for name, clips in mine.items()}
    bodies = _bodies(dataset(data), cast)
    unfit = {name: why for name in sorted(cast) if (why := asked.unfit(bodies[name]))}
    fit = [name for name in sorted(cast) if name not in unfit]
    payloads = [
        {"dataset": data, "method": trainee, "character": name, "fps": fps, "plugins": plugin_files()}
        for name in fit
    ]
    clips: dict[str, list[Clip]] = {}
    progress(0, len(payloads))
    for done in LocalPool(jobs).run("retarget_bench.training.material:clips_of", payloads):
        if done.error:
            raise BenchError(f"{fit[done.job]}: its training motion cannot be had: {done.error}")
        clips[fit[done.job]] = done.result
        progress(len(clips), len(payloads))
    kept = {name: clips[name] for name in fit if clips[name]}
    if not kept:
        why = f": {next(iter(unfit.values()))}" if unfit else ""
        raise NotSupported(f"{dataset(data).label} has no motion that {trainee} can be trained on{why}")
    notes = tuple(f"not trained on {name}: {why}" for name, why in unfit.items())
    return Material({name: bodies[name] for name in kept}, kept, notes)


def clips_of(job: Mapping[str, Any]) -> list[Clip]:
    """The clips of one character as arrays; what a worker process does."""
    know(job["plugins"])
    name, asked = job["character"], method(job["method"])
    listed = _training(dataset(job["dataset"]))
    (clips,) = (mine[name] for mine in listed.values() if name in mine)
    found = []
    for number in range(len(clips)):
        motion = clips[number].resample(job["fps"])
        if motion.frames > 1:
            arrays = asked.prepare(motion)  # type: ignore[attr-defined]
            found.append(
                Clip(name, clips.names[number], {k: np.asarray(a, np.float32) for k, a in arrays.items()})
            )
    return found


def _training(data: Dataset) -> Mapping[str, Mapping[str, Any]]:
    """Structure -> character -> clips: a sequence of motions with ``names``."""
    found: Mapping[str, Mapping[str, Any]] = getattr(data, "training", dict)()
    usable = {name: mine for name, mine in found.items() if mine}
    if not usable:
        raise NotSupported(
            f"{data.label.strip()} has no training motion; see training() in datasets/puppets"
        )
    return usable


def _bodies(data: Dataset, cast: Mapping[str, Any]) -> dict[str, Character]:
    """The characters themselves; one that no case shows is known by its first clip."""
    known = data.characters()
    return {name: known[name] if name in known else cast[name][0].character for name in sorted(cast)}
