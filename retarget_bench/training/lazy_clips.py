"""Training clips that are made on demand, as data sets offer them by ``training()``."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from copy import copy
from typing import Generic, Self, TypeVar, overload

from retarget_bench.motion.motion import Motion

Listed = TypeVar("Listed")


class LazyClips(Sequence[Motion], ABC, Generic[Listed]):
    """Motions of one character. listed: what each is made from; a slice has a part of it."""

    def __init__(self, listed: Sequence[Listed]) -> None:
        self.listed = tuple(listed)

    @abstractmethod
    def made(self, each: Listed) -> Motion:
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
        return self.made(self.listed[index])

    def __iter__(self) -> Iterator[Motion]:
        return (self.made(each) for each in self.listed)
