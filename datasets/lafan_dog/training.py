"""What there is to train on: the clips of takes that are neither tested nor steered by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from retarget_bench.motion.motion import Motion
from retarget_bench.training.lazy_clips import LazyClips

from .motions import Clip, Motions

Training = Mapping[str, Mapping[str, "Clips"]]
"""Structure -> character -> its clips."""


class Clips(LazyClips[Clip]):
    """Clips of one character, each cut when it is asked for."""

    def __init__(self, motions: Motions, listed: Sequence[Clip]) -> None:
        super().__init__(listed)
        self._motions = motions

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(clip.name for clip in self.listed)

    def made(self, each: Clip) -> Motion:
        return self._motions.clip(each)
