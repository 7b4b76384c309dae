"""Training clips that are made on demand, as data sets offer them by ``training()``."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import copy
from itertools import pairwise
from typing import Generic, Self, TypeVar, overload

from retarget_bench.errors import BenchError, Unusable
from retarget_bench.motion.motion import Motion

Listed = TypeVar("Listed")


class LazyClips(Sequence[Motion], ABC, Generic[Listed]):
    """Motions of one character. listed: what each is made from; a slice has a part of it."""

    def __init__(self, listed: Sequence[Listed]) -> None:
        self.listed = tuple(listed)

    @abstractmethod
    def motion(self, each: Listed) -> Motion:
        """The motion itself."""

    def __len__(self) -> int:
        return len(self.listed)

    @overload
    def __getitem__(self, index: int) -> Motion: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> Motion | Self:
        if isinstance(index, slice):
            part = copy(self)
            part.listed = self.listed[index]
            return part
        return self.motion(self.listed[index])

    def __iter__(self) -> Iterator[Motion]:
        return (self.motion(each) for each in self.listed)


class NamedClips(LazyClips[str]):
    """Motions that are read by the names of their clips; what cannot be read is ``Unusable``."""

    def __init__(self, names: Sequence[str], read: Callable[[str], Motion]) -> None:
        super().__init__(names)
        self._read = read

    @property
    def names(self) -> tuple[str, ...]:
        return self.listed

    def motion(self, each: str) -> Motion:
        try:
            return self._read(each)
        except Unusable:
            raise
        except BenchError as error:
            raise Unusable(each, str(error)) from error


def parts(frames: int, length: int) -> list[slice]:
    """Equal parts of so many frames, each of about ``length``."""
    number = max(round(frames / length), 1)
    ends = [frames * each // number for each in range(number + 1)]
    return [slice(first, end) for first, end in pairwise(ends)]


Cast = Mapping[str, Mapping[str, NamedClips]]
"""Structure -> character -> its clips."""


def manifest(cast: Cast, aside: Iterable[str]) -> Mapping[str, Sequence[str]]:
    """Characters, structures and clips of ``cast`` and of validation (``aside``): what weights carry."""
    clips = {clip for characters in cast.values() for each in characters.values() for clip in each.names}
    return {
        "characters": sorted(name for characters in cast.values() for name in characters),
        "structures": sorted(cast),
        "clips": sorted({*clips, *aside}),
    }
