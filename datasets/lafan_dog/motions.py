"""Takes as motions of one person and one dog, cut into clips, and the clips that are trained on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.actions import Action, action
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.clips import LazyClips

from .takes import DOG, PERSON

FPS = 30.0
"""Of the cases, as in the paper: LAFAN1's own, and every second frame of the dog."""
SHORTEST = 30
"""Frames of a take from which it is cut into clips: a second, in which something is done."""
STRUCTURES = {PERSON: "lafan", DOG: "mann"}
"""Structure of a species: this and the number of joints, as in ``lafan22``."""
ROUNDING = 1e-3
"""Share of the height by which bones may differ from take to take."""
PLAUSIBLE = {PERSON: (1.2, 2.5), DOG: (0.4, 1.6)}
"""Metres of role height of a body that was read in the right unit."""
MISFIT = "has bones of another length than the others of its species"
KEPT = 8
"""So many takes a process keeps."""


@dataclass(frozen=True)
class Clip:
    """Frames ``first`` to before ``end`` of a take."""

    name: str
    species: str
    take: str
    first: int
    end: int

    @property
    def frames(self) -> int:
        return self.end - self.first


def cut(species: str, take: str, frames: int, most: int) -> list[Clip]:
    """A take of so many frames in clips of equal length, of about ``most`` frames each."""
    number = max(round(frames / most), 1)
    ends = [frames * each // number for each in range(number + 1)]
    return [
        Clip(f"{take}-{each + 1:02d}", species, take, ends[each], ends[each + 1]) for each in range(number)
    ]


@dataclass
class Motions:
    """The bodies, and the motion of takes. files: species -> take -> file.

    All takes of a species are of one body: that of its first take by name that can be read.
    """

    files: Mapping[str, Mapping[str, Path]]
    _bodies: dict[str, tuple[Path, Character]] = field(default_factory=dict)
    _actions: dict[Clip, Action] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._kept = lru_cache(maxsize=KEPT)(self._read)

    def body(self, species: str) -> Character:
        """Raises BenchError where no take can be read, or what is read is no person or dog."""
        if species not in self._bodies:
            self._bodies[species] = self._found(species)
        return self._bodies[species][1]

    def misfit(self, species: str, name: str) -> str:
        """The difference of a take's body from the others', read from its header; "" where there is
        none."""
        self.body(species)
        usual = bvh.parse_header(self._bodies[species][0]).hierarchy
        own = bvh.parse_header(self.files[species][name]).hierarchy
        if own.names != usual.names or not np.array_equal(own.parents, usual.parents):
            return f"has other joints than {self._bodies[species][0].name}"
        # the root's offset is the first frame's place
        apart = np.abs(own.offsets[1:] - usual.offsets[1:]).max(initial=0.0)
        return MISFIT if apart > ROUNDING * np.abs(usual.offsets[1:]).max(initial=0.0) else ""

    def take(self, species: str, name: str) -> Motion:
        """A whole take. Raises FileError where it cannot be read or is of another body."""
        return self._kept(species, name)

    def clip(self, clip: Clip) -> Motion:
        return self.take(clip.species, clip.take).at(slice(clip.first, clip.end))

    def action(self, clip: Clip) -> Action:
        """The action of a clip."""
        if clip not in self._actions:
            self._actions[clip] = action(self.clip(clip))
        return self._actions[clip]

    def _read(self, species: str, name: str) -> Motion:
        path = self.files[species][name]
        body, motion = self.body(species), _imported(path)
        if not motion.skeleton.same_as(body.skeleton, tolerance=ROUNDING * body.height):
            raise FileError(path, MISFIT)
        return body.motion(motion.rotations, motion.root, motion.fps)

    def _found(self, species: str) -> tuple[Path, Character]:
        problems = []
        for path in self.files[species].values():
            try:
                return path, _named(species, _imported(path).character, path)
            except FileError as error:
                problems.append(str(error))
        raise BenchError(f"no take of a {species} can be used: {problems[0]}")


def _imported(path: Path) -> Motion:
    """Both archives are in centimetres, Y up, with the root's place in the world."""
    return importer.load(path, unit="cm", up="y", root="absolute", fps=FPS).motion


def _named(species: str, found: Character, path: Path) -> Character:
    low, high = PLAUSIBLE[species]
    if found.four_legged != (species == DOG):
        legs = "four legs" if found.four_legged else "two legs"
        raise FileError(path, f"shows a body on {legs}, which is no {species}")
    if not low < found.height < high:
        raise FileError(path, f"read in centimetres, its {species} is {found.height:.3g} m high")
    return replace(found, name=species, structure=f"{STRUCTURES[species]}{len(found.skeleton)}")


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
