"""What there is to train on: the clips of takes that are neither tested nor steered by."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import overload

from retarget_bench.motion.motion import Motion

from .motions import Clip, Motions

Training = Mapping[str, Mapping[str, "Clips"]]
"""Structure -> character -> its clips."""


class Clips(Sequence[Motion]):
    """Clips of one character, each cut when it is asked for."""

    def __init__(self, motions: Motions, listed: Sequence[Clip]) -> None:
        self._motions, self._listed = motions, tuple(listed)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(clip.name for clip in self._listed)

    def __len__(self) -> int:
        return len(self._listed)

    @overload
    def __getitem__(self, index: int) -> Motion: ...
    @overload
    def __getitem__(self, index: slice) -> Clips: ...
    def __getitem__(self, index: int | slice) -> Motion | Clips:
        if isinstance(index, slice):
            return Clips(self._motions, self._listed[index])
        return self._motions.clip(self._listed[index])

    def __iter__(self) -> Iterator[Motion]:
        return (self[index] for index in range(len(self)))
