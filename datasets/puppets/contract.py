"""The common interface of the frozen corpus of the puppets and the generated ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, Protocol, TypeVar

import numpy as np

from retarget_bench.api import Case, CaseInfo, Contacts
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.lazy_clips import LazyClips

VERSION = "3"
"""Of the generator: moves when any motion or list does."""

Version = Literal["1.0", "1.1"]
"""Of the performances: as designed, or with what recorded people have beside."""
Source = Literal["exact", "captured"]
"""Of the sources of cases: as performed, or with the noise of motion capture."""
Size = Literal["tiny", "default", "large", "kinds"]
Part = Literal["test", "validation"]
Surface = Literal["bare", "clothed"]
Manner = Literal["usual", "second"]
"""Of a motion: the reference's, and that of the other right answer."""
USUAL: Manner = "usual"
SECOND: Manner = "second"


class Corpus(Protocol):
    """One part of a corpus.

    variant: what there is to it beside size, part and seed, as it stands in ``content``; mostly nothing.
    clips:   clip -> kind of performance.
    bodies:  the number of bodies of the cast, drawn ones not counted.
    """

    @property
    def variant(self) -> str: ...
    @property
    def clips(self) -> Mapping[str, str]: ...
    @property
    def bodies(self) -> int: ...
    @property
    def cast(self) -> Mapping[str, Character]:
        """Everybody, drawn training bodies too."""

    def cases(self, split: str) -> Sequence[CaseInfo]: ...
    def between_legs(self) -> Sequence[CaseInfo]:
        """Cases from people to dogs, then from dogs to people."""

    def real(self, structure: str) -> Sequence[CaseInfo]:
        """Every clip by every body of a structure that performs it in a case, as a self case."""

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this corpus."""

    def motion(self, clip: str, name: str, manner: Manner) -> Motion | None:
        """A body in a clip of this part. None: it is not among the motions that are at hand."""

    def labels(self, info: CaseInfo) -> Labels: ...
    def unseen(self, info: CaseInfo) -> frozenset[str]: ...
    def exclusions(self) -> Mapping[str, Mapping[str, float]]: ...
    def performers(self) -> Mapping[str, tuple[str, ...]]: ...
    def training(self) -> Training: ...
    def training_manifest(self) -> Mapping[str, Sequence[str]]: ...


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of one clip by one body.

    kind:     ``(frames,)`` text: what is done in each frame; sequences change.
    phase:    ``(frames,)`` 0 to 1 within what is done, or turns of its cycle.
    contacts: of the feet: planted, pivoting, or neither.
    touches:  "left hand on right_knee" -> ``(frames,)`` bool: the hand rests there.
    """

    kind: np.ndarray
    phase: np.ndarray
    contacts: Contacts
    touches: Mapping[str, np.ndarray]


class Cast(Mapping[str, Character]):
    """Bodies as characters, each made on first access."""

    def __init__(self, names: Iterable[str], make: Callable[[str], Character]) -> None:
        self._names, self._make, self._made = tuple(names), make, dict[str, Character]()

    def __getitem__(self, name: str) -> Character:
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Listed(Protocol):
    """A clip as a list has it, known without its motion."""

    @property
    def name(self) -> str: ...
    @property
    def frames(self) -> int: ...


T = TypeVar("T", bound=Listed)


class Clips(LazyClips[T], Generic[T]):
    """Training motions of one character, each made on first access."""

    def __init__(self, character: str, listed: Sequence[T], make: Callable[[T, str], Motion]) -> None:
        super().__init__(listed)
        self.character, self._make = character, make

    def motion(self, each: T) -> Motion:
        return self._make(each, self.character)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(clip.name for clip in self.listed)

    @property
    def frames(self) -> int:
        """Number of frames of all clips together."""
        return sum(clip.frames for clip in self.listed)


Training = Mapping[str, Mapping[str, Clips]]
"""Structure -> character -> its clips."""


def absent(info: CaseInfo, size: Size, part: Part) -> BenchError:
    """The error for a case that a corpus does not have."""
    return BenchError(f"puppets[size={size},part={part}] has no case {info.id}")


def in_double(rotations: np.ndarray) -> np.ndarray:
    """Unit quaternions ``(frames, joints, 4)`` from those in single precision, in which motions are kept:
    they are off by less than a micrometre."""
    local = rotations.astype(np.float64)
    local /= np.sqrt((local * local).sum(axis=-1, keepdims=True))
    return local
