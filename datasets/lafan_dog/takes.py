"""Takes in the two folders: their parts of the data set, and their motion, cut into clips."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from retarget_bench.errors import BenchError, FileError, some
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.actions import Action, action
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files.catalogue import bvh_files, contents, existing
from retarget_bench.motion.files.reading import Reading
from retarget_bench.training.lazy_clips import parts

Part = Literal["train", "validation", "test"]
Protocol = Literal["auto", "pan", "own"]
PERSON, DOG = "person", "dog"
SPECIES = (PERSON, DOG)
TAKES = {
    PERSON: re.compile(r"(?P<recording>[A-Za-z]+\d+)_subject(?P<subject>\d+)"),
    DOG: re.compile(r"D1_(?P<recording>[0-9a-z]+?)z?_KAN\d+_\d+"),
}
"""Names of takes in LAFAN1 and in MANN's archive; takes of one recording go to one part."""
LIKE = {PERSON: "walk1_subject1.bvh", DOG: "D1_009_KAN01_001.bvh"}
EXAMPLE = "DIR holds two folders, as in DIR/lafan1/walk1_subject1.bvh and DIR/dog/D1_009_KAN01_001.bvh"

LOCOMOTION = {
    "aiming1": (1, 4),
    "aiming2": (2, 3, 5),
    "run1": (2, 5),
    "run2": (1, 4),
    "sprint1": (2, 4),
    "walk1": (1, 2, 5),
    "walk2": (1, 3, 4),
    "walk3": (1, 2, 3, 4, 5),
    "walk4": (1,),
}
"""LAFAN1's recordings that PAN uses (aiming, run, sprint, walk), and the subjects of their takes."""
PAN_TAKES = frozenset(f"{what}_subject{who}" for what, subjects in LOCOMOTION.items() for who in subjects)
PAN_SUBJECT = "1"
"""The subject that PAN tests on."""

_SALT = "lafan-dog-11431"
"""Chosen so that every part of the takes at hand has sitting and moving ones of both species."""

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
CACHED = 8
"""So many takes a process keeps."""


@dataclass(frozen=True)
class Takes:
    """The files of a part's takes. files: species -> take -> file, sorted by name.

    part:  species -> take -> which part it belongs to. pan: whether people are split as in the paper.
    others: files that are no takes by their names, or that the protocol leaves out.
    """

    root: Path
    files: Mapping[str, Mapping[str, Path]]
    part: Mapping[str, Mapping[str, Part]]
    pan: bool
    others: tuple[Path, ...]


def find(root: str, folders: Mapping[str, str], protocol: Protocol) -> Takes:
    """Look at the folders; raises BenchError with what is there instead and what to give.

    folders: species -> its folder, under ``root`` or on its own.
    """
    if not root:
        raise BenchError(
            "lafan_dog needs your copies of LAFAN1 and of MANN's dog (neither may be passed on here): give "
            f"--root DIR, or lafan_dog[root=DIR]. {EXAMPLE}"
        )
    top = existing(Path(root).expanduser())
    if top.is_file():
        raise BenchError(f"{top} is a file: give the folder of both folders. {EXAMPLE}")
    for species, key in ((PERSON, "people"), (DOG, "dogs")):
        if not (top / folders[species]).is_dir():
            raise BenchError(
                f"{top} holds no folder {folders[species]} with the takes of the {species}; it holds "
                f"{contents(top)}. Give its name with lafan_dog[{key}=NAME]. {EXAMPLE}"
            )
    files = {species: bvh_files(top / folders[species]) for species in SPECIES}
    takes = {
        species: {name: path for name, path in paths.items() if TAKES[species].fullmatch(name)}
        for species, paths in files.items()
    }
    for species, paths in takes.items():
        if not paths:
            folder, like = top / folders[species], LIKE[species]
            there = f"its BVH files are {some(list(files[species]))}" if files[species] else ""
            there = there or f"it holds {contents(folder)}"
            raise BenchError(f"{folder} holds no take of a {species}, called as in {like}; {there}")
    absent = sorted(PAN_TAKES - takes[PERSON].keys())
    if protocol == "pan" and absent:
        raise BenchError(
            f"lafan_dog: protocol=pan needs all {len(PAN_TAKES)} takes of LAFAN1 that begin with aiming, "
            f"run, sprint or walk; {len(absent)} are not there: {some(absent, 4)}"
        )
    pan = protocol != "own" and not absent
    if pan:
        takes[PERSON] = {name: path for name, path in takes[PERSON].items() if name in PAN_TAKES}
    others = [
        path for species in SPECIES for name, path in files[species].items() if name not in takes[species]
    ]
    part = {species: {name: part_of(species, name, pan) for name in takes[species]} for species in SPECIES}
    return Takes(top, takes, part, pan, tuple(others))


def part_of(species: str, take: str, pan: bool = False) -> Part:
    """The part of a take: a function of its name alone, so that adding files moves nothing.

    Of five recordings two are tested, one steers training and two are trained on, by a hash of the
    recording's name. pan: people's ``subject1`` is tested, and of the others one in five steers.
    """
    match = TAKES[species].fullmatch(take)
    if match is None:
        raise BenchError(f"lafan_dog: {take!r} is not the name of a take of a {species}")
    fifth = int(hashlib.sha256(f"{_SALT}:{match['recording']}".encode()).hexdigest(), 16) % 5
    if pan and species == PERSON:
        if match["subject"] == PAN_SUBJECT:
            return "test"
        return "validation" if fifth == 2 else "train"
    return "test" if fifth < 2 else "validation" if fifth == 2 else "train"


# ------------------------------------------------------------------------------------------- motion
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
    return [
        Clip(f"{take}-{number:02d}", species, take, part.start, part.stop)
        for number, part in enumerate(parts(frames, most), 1)
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
        self._kept = lru_cache(maxsize=CACHED)(self._read)

    def body(self, species: str) -> Character:
        """Raises BenchError where no take can be read, or what is read is no person or dog."""
        if species not in self._bodies:
            self._bodies[species] = self._first_body(species)
        return self._bodies[species][1]

    def misfit(self, species: str, name: str) -> str:
        """The difference of a take's body from the others', by its header; "" where there is none."""
        self.body(species)
        usual = bvh.parse_header(self._bodies[species][0]).hierarchy
        own = bvh.parse_header(self.files[species][name]).hierarchy
        if own.names != usual.names or not np.array_equal(own.parents, usual.parents):
            return f"has other joints than {self._bodies[species][0].name}"
        # the root's offset is the first frame's place
        apart = np.abs(own.offsets[1:] - usual.offsets[1:]).max(initial=0.0)
        return MISFIT if apart > ROUNDING * np.abs(usual.offsets[1:]).max(initial=0.0) else ""

    def clip(self, clip: Clip) -> Motion:
        """Raises FileError where the take cannot be read or is of another body."""
        return self._kept(clip.species, clip.take).at(slice(clip.first, clip.end))

    def action(self, clip: Clip) -> Action:
        if clip not in self._actions:
            self._actions[clip] = action(self.clip(clip))
        return self._actions[clip]

    def _read(self, species: str, name: str) -> Motion:
        path = self.files[species][name]
        body, motion = self.body(species), _imported(path)
        if not motion.skeleton.same_as(body.skeleton, tolerance=ROUNDING * body.height):
            raise FileError(path, MISFIT)
        return body.motion(motion.rotations, motion.root, motion.fps)

    def _first_body(self, species: str) -> tuple[Path, Character]:
        problems = []
        for path in self.files[species].values():
            try:
                return path, _plausible(species, _imported(path).character, path)
            except FileError as error:
                problems.append(str(error))
        raise BenchError(f"no take of a {species} can be used: {problems[0]}")


def _imported(path: Path) -> Motion:
    """Both archives are in centimetres, Y up, with the root's place in the world."""
    return importer.load(path, Reading(unit="cm", up="y", root_place="absolute"), fps=FPS).motion


def _plausible(species: str, character: Character, path: Path) -> Character:
    low, high = PLAUSIBLE[species]
    if character.four_legged != (species == DOG):
        legs = "four legs" if character.four_legged else "two legs"
        raise FileError(path, f"shows a body on {legs}, which is no {species}")
    if not low < character.height < high:
        raise FileError(path, f"read in centimetres, its {species} is {character.height:.3g} m high")
    return replace(character, name=species, structure=f"{STRUCTURES[species]}{len(character.skeleton)}")
