"""Takes in the two folders, and the part of the data set that each belongs to."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from retarget_bench.errors import BenchError
from retarget_bench.motion.bvh.catalogue import bvh_files, contents, some

Part = Literal["train", "validation", "test"]
Protocol = Literal["auto", "pan", "own"]
PERSON, DOG = "person", "dog"
SPECIES = (PERSON, DOG)
TAKES = {
    PERSON: re.compile(r"(?P<recording>[A-Za-z]+\d+)_subject(?P<subject>\d+)"),
    DOG: re.compile(r"D1_(?P<recording>[0-9a-z]+?)z?_KAN\d+_\d+"),
}
"""What takes are called in LAFAN1 and in MANN's archive; takes of one recording go to one part."""
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


@dataclass(frozen=True)
class Takes:
    """The files of a part's takes. found: species -> take -> file, sorted by name.

    part:  species -> take -> which part it belongs to. pan: whether people are split as in the paper.
    others: files that are no takes by their names, or that the protocol leaves out.
    """

    root: Path
    found: Mapping[str, Mapping[str, Path]]
    part: Mapping[str, Mapping[str, Part]]
    pan: bool
    others: tuple[Path, ...]


def find(root: str, folders: Mapping[str, str], protocol: Protocol) -> Takes:
    """Look at the folders; raises BenchError that says what is there instead and what to give.

    folders: species -> its folder, under ``root`` or on its own.
    """
    if not root:
        raise BenchError(
            "lafan_dog needs your copies of LAFAN1 and of MANN's dog (neither may be passed on here): give "
            f"--root DIR, or lafan_dog[root=DIR]. {EXAMPLE}"
        )
    top = Path(root).expanduser()
    if not top.is_dir():
        raise BenchError(_missing(top))
    files = {species: _files(top, species, folders[species]) for species in SPECIES}
    takes = {
        species: {name: path for name, path in mine.items() if TAKES[species].fullmatch(name)}
        for species, mine in files.items()
    }
    for species, mine in takes.items():
        if not mine:
            raise BenchError(_unnamed(species, top / folders[species], files[species]))
    pan = _as_in_pan(set(takes[PERSON]), protocol)
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


def _as_in_pan(names: set[str], protocol: Protocol) -> bool:
    missing = sorted(PAN_TAKES - names)
    if protocol == "pan" and missing:
        raise BenchError(
            f"lafan_dog: protocol=pan needs all {len(PAN_TAKES)} takes of LAFAN1 that begin with aiming, "
            f"run, sprint or walk; {len(missing)} are not there: {some(missing, 4)}"
        )
    return protocol != "own" and not missing


def _files(top: Path, species: str, name: str) -> dict[str, Path]:
    folder = top / name
    if not folder.is_dir():
        key = {PERSON: "people", DOG: "dogs"}[species]
        raise BenchError(
            f"{top} holds no folder {name} with the takes of the {species}; it holds {contents(top)}. Give "
            f"its name with lafan_dog[{key}=NAME]. {EXAMPLE}"
        )
    return bvh_files(folder)


def _unnamed(species: str, folder: Path, files: Mapping[str, Path]) -> str:
    like = {PERSON: "walk1_subject1.bvh", DOG: "D1_009_KAN01_001.bvh"}[species]
    there = f"its BVH files are {some(list(files))}" if files else f"it holds {contents(folder)}"
    return f"{folder} holds no take of a {species}, called as in {like}; {there}"


def _missing(top: Path) -> str:
    if top.is_file():
        return f"{top} is a file: give the folder of both folders. {EXAMPLE}"
    nearest = next((each for each in top.parents if each.is_dir()), Path())
    return f"there is no folder {top}; {nearest} exists and holds {contents(nearest)}. {EXAMPLE}"
