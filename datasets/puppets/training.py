"""What there is to train on: structure, character, clips; no clip is performed by two characters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from retarget_bench.motion.motion import Motion
from retarget_bench.training.lazy_clips import LazyClips

from .clips import Clip, training_clips
from .exclusions import unable
from .families import families
from .parts import bodies
from .solved import Studio

Training = Mapping[str, Mapping[str, "Clips"]]
"""Structure -> character -> its clips."""


class Clips(LazyClips[Clip]):
    """Motions of one character, each solved when it is first asked for."""

    def __init__(self, studio: Studio, character: str, listed: Sequence[Clip]) -> None:
        super().__init__(listed)
        self._studio, self.character = studio, character

    def made(self, each: Clip) -> Motion:
        return self._studio.motion(each, self.character)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(clip.name for clip in self.listed)

    @property
    def frames(self) -> int:
        """Of all clips together, known without solving any."""
        return sum(clip.frames for clip in self.listed)


def training(studio: Studio, size: str, seed: int) -> Training:
    """Every training character with what it is able to do; held-out bodies, structures and kinds are
    absent, and so are the bodies of ``held_out.ASIDE``."""
    found: dict[str, dict[str, Clips]] = {}
    for family in families():
        for name in bodies(family, "train"):
            mine = [clip for clip in training_clips(size, name, seed) if not unable(clip, (name,))]
            structure = family.bodies[name].structure.name
            found.setdefault(structure, {})[name] = Clips(studio, name, mine)
    return found
