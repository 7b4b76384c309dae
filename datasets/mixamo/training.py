"""What a protocol leaves to train on: structure, character, clips."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.motion.bvh.catalogue import CatalogueEntry
from retarget_bench.motion.motion import Motion
from retarget_bench.training.lazy_clips import LazyClips

from .motions import Motions

Training = Mapping[str, Mapping[str, "Clips"]]
"""Structure -> character -> its clips."""


class Clips(LazyClips[tuple[str, Path]]):
    """Motions of one character, each read when it is asked for."""

    def __init__(
        self,
        motions: Motions,
        character: str,
        files: Mapping[str, Path],
        entries: Mapping[Path, CatalogueEntry],
    ) -> None:
        super().__init__(list(files.items()))
        self._motions, self._entries, self.character = motions, entries, character

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.listed)

    def made(self, each: tuple[str, Path]) -> Motion:
        _, path = each
        return self._motions.motion(self.character, path, self._entries[path])


def training(
    motions: Motions, files: Mapping[str, Mapping[str, Path]], entries: Mapping[Path, CatalogueEntry]
) -> Training:
    """Every character with its readable files, under the structure that most of them have."""
    found: dict[str, dict[str, Clips]] = {}
    for name, mine in files.items():
        structures = {
            clip: each
            for clip, path in mine.items()
            if (each := _structure(motions, name, path, entries[path]))
        }
        if structures:
            usual = Counter(structures.values()).most_common(1)[0][0]
            kept = {clip: mine[clip] for clip, each in structures.items() if each == usual}
            found.setdefault(usual, {})[name] = Clips(motions, name, kept, entries)
    return found


def _structure(motions: Motions, name: str, path: Path, entry: CatalogueEntry) -> str:
    """Of the body in a file; "" where it cannot be used."""
    if entry.problem:
        return ""
    try:
        return motions.rig(name, path, entry).character.structure
    except BenchError:
        return ""
