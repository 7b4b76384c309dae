"""The motions of a Mixamo folder, read when they are asked for and kept while memory allows."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.motion import bvh
from retarget_bench.motion.bvh.catalogue import CatalogueEntry
from retarget_bench.motion.motion import Motion

from .rigs import Rig, rig

KEEP_BYTES = 200_000_000
"""How much a process keeps of motions that it may be asked for again."""
_BYTES_PER_JOINT = 8 * (4 + 3 + 4)
"""Local rotations, and the positions and global rotations that a motion computes once."""
METRES = {"cm": 0.01, "m": 1.0}
PLAUSIBLE = (0.2, 10.0)
"""Metres: heights of characters that are taken as they are."""


@dataclass
class Motions:
    """Rigs and motions, by file.

    structure, fps, unit, multiple: as the data set's parameters and protocol say.
    """

    structure: str
    fps: float
    unit: str
    multiple: int = 1
    _rigs: dict[tuple[str, str], Rig | BenchError] = field(default_factory=dict)
    _kept: OrderedDict[Path, Motion] = field(default_factory=OrderedDict)
    _bytes: int = 0

    def rig(self, name: str, path: Path, entry: CatalogueEntry) -> Rig:
        """The body in a file; files with the same hierarchy share one object. Raises BenchError."""
        key = (name, entry.hierarchy)
        if key not in self._rigs:
            try:
                self._rigs[key] = self._made(name, path)
            except BenchError as error:
                self._rigs[key] = error
        found = self._rigs[key]
        if isinstance(found, BenchError):
            raise found
        return found

    def motion(self, name: str, path: Path, entry: CatalogueEntry) -> Motion:
        """A file's motion on the joints and at the rate of the cases. Raises BenchError."""
        if path in self._kept:
            self._kept.move_to_end(path)
            return self._kept[path]
        body = self.rig(name, path, entry)
        recording = self._recording(path)
        motion = body.motion(recording.rotations, recording.root, recording.fps, self.fps)
        if motion.frames % self.multiple:
            motion = motion.at(slice(0, motion.frames // self.multiple * self.multiple))
        self._keep(path, motion)
        return motion

    def _recording(self, path: Path) -> bvh.Recording:
        """Mixamo's files state the root's place in the world."""
        return bvh.read(path, root="absolute", scale=METRES[self.unit])

    def _keep(self, path: Path, motion: Motion) -> None:
        self._kept[path] = motion
        self._bytes += _size(motion)
        while self._bytes > KEEP_BYTES and len(self._kept) > 1:
            _, oldest = self._kept.popitem(last=False)
            self._bytes -= _size(oldest)

    def _made(self, name: str, path: Path) -> Rig:
        made = rig(name, self._recording(path).skeleton, self.structure)
        height = made.native.height
        if not PLAUSIBLE[0] < height < PLAUSIBLE[1]:
            other = "m" if height < 1 else "cm"
            cure = f"; give unit={other}" if other != self.unit else ""
            raise BenchError(f"{path}: read in {self.unit}, {name} is {height:.3g} m high{cure}")
        return made


def _size(motion: Motion) -> int:
    return motion.rotations.shape[0] * motion.rotations.shape[1] * _BYTES_PER_JOINT
