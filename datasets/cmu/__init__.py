"""CMU motion capture, to train on: real takes of many subjects, each with a skeleton of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Literal

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_split
from retarget_bench.errors import BenchError, Unusable, some
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.catalogue import (
    CatalogueEntry,
    bvh_files,
    catalogue,
    contents,
    fingerprint,
)
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.motion import Motion
from retarget_bench.training.lazy_clips import Cast, NamedClips, parts

from .onto import Onto, Pairs
from .takes import Part, part_of, performer

FPS = 30.0
SHORTEST = 30
"""Frames of a take from which it is used."""
LONGEST = 300
"""Frames of a case, about: longer takes are cut into equal clips."""
ROUNDING = 1e-3
"""Share of the height by which takes of one skeleton may differ in their bones."""
PLACE = "RETARGET_BENCH_CMU"
"""The environment variable that says where the takes lie."""
_CACHED = 16


class Cmu(Dataset):
    """Takes of a folder, ``SUBJECT_TAKE.bvh``, one skeleton for each subject.

    Training has all subjects but those of the test and of validation. Cases are the takes of these, of a
    subject to itself with a reference, to the others of its part without.
    """

    card = DatasetCard(
        name="cmu",
        summary="CMU motion capture for training: real takes, one skeleton for each subject",
        version="1",
        licence=(
            "CMU Graphics Lab Motion Capture Database: free for research and products, not to be resold; "
            "obtained from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"
        ),
        obtain=(
            "BVH files of mocap.cs.cmu.edu in one folder, called SUBJECT_TAKE.bvh as in 05_01.bvh; give "
            f"it with --root DIR, cmu[root=DIR], or the environment variable {PLACE}"
        ),
        parameters={
            "root": f"the folder of the files; by default what {PLACE} says",
            "part": "test (subjects 01, 02, 03, 06, 07 and 131) or validation (17, 35, 49 and 91)",
            "unit": "unit of the files, or auto",
            "bodies": "number of drawn training bodies of the puppets that ik puts takes on; what fails "
            "checks of contact, speed and floor is not trained on",
            "own": "whether training has takes by those who performed them, too; false: for methods with a "
            "network for each joint set",
        },
    )

    def __init__(
        self,
        root: str = "",
        part: Literal["test", "validation"] = "test",
        unit: str = "auto",
        bodies: int = 0,
        own: bool = True,
    ) -> None:
        if part not in ("test", "validation"):
            raise BenchError(f"cmu: there is no part {part!r}; cases are of test or validation")
        self._root, self._part, self._unit = root or os.environ.get(PLACE, ""), part, unit
        if bodies < 0:
            raise BenchError(f"cmu: bodies={bodies} is no number of bodies")
        if not (own or bodies):
            raise BenchError("cmu[own=false] has nothing to train on but what bodies=NUMBER gives")
        self._bodies, self._own = bodies, own
        self._take = lru_cache(maxsize=_CACHED)(self._read)
        self._character = lru_cache(maxsize=None)(self._first_body)

    # ------------------------------------------------------------------------------- the contract
    @property
    def content(self) -> str:
        """A hash of the bytes of the takes, the part, and how they are read."""
        entries = {name: self._entries[path] for name, path in self._files.items()}
        onto = f", {self._onto.identity}" if self._onto else ""
        return f"{fingerprint(entries)} ({self._part}, unit {self._unit}{onto})"

    @property
    def label(self) -> str:
        name = f"cmu, on {self._bodies} bodies drawn" if self._bodies else "cmu"
        return name if self._part == "test" else f"{name}, {self._part}"

    @cached_property
    def notes(self) -> Sequence[str]:
        notes = list(self.training_notes)
        if not self._listed:
            notes.append(f"no take of the {self._part} is there: nothing to test on")
        return tuple(notes)

    def characters(self) -> Mapping[str, Character]:
        """Those of the cases."""
        return {_called(who): self._character(who) for who in self._takes[self._part]}

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Take by take, to every body of the part."""
        if task != "retarget" or split not in self.card.splits:
            return ()
        infos = (
            self._info(name, whose, target)
            for name, (take, _) in self._listed.items()
            for whose in [performer(take)]
            for target in self._takes[self._part]
        )
        return tuple(info for info in infos if info.split == split)

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this part, FileError where a file cannot be read."""
        cast = self.characters()
        take, frames = self._listed.get(info.clip, ("", slice(0)))
        if info.source != _called(performer(take)) or info.target not in cast:
            raise BenchError(f"{self.label} has no case {info.id}")
        source = self._take(take).at(frames)
        if info.source == info.target:
            return Case(info, source, source.character, source)
        return Case(info, source, cast[info.target])

    # ------------------------------------------------------------------------------- to train on
    def training(self) -> Cast:
        """Structure -> subject, or body that takes are put on -> whole takes."""
        cast: dict[str, dict[str, NamedClips]] = {}
        for who, takes in (self._takes["train"] if self._own else {}).items():
            cast.setdefault(self._character(who).structure, {})[_called(who)] = NamedClips(
                takes, self.motion
            )
        if self._onto:
            for name, takes in self._onto.by_body.items():
                clips = NamedClips(takes, partial(self._onto.motion, name=name))
                cast.setdefault(self._onto.cast[name].structure, {})[name] = clips
        return cast

    def training_pairs(self) -> Pairs | None:
        """Takes by their performer and by the bodies that they are put on, none exact; None without
        bodies."""
        if not self._onto:
            return None
        lengths = {take: self._frames(take) for take in self._onto.takes}
        return Pairs(self._onto, lengths)

    @property
    def training_notes(self) -> Sequence[str]:
        """Files that are not used, with the reason."""
        files = [f"{name} ({why})" for name, why in self._problems.items()]
        return (f"{len(files)} files left out: {some(files, 6)}",) if files else ()

    def validation(self) -> Cmu | None:
        """Takes of subjects that training goes without; None where there are none."""
        return Cmu(self._root, "validation", self._unit) if self._takes["validation"] else None

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Characters, structures and clips that training and its validation have: what weights carry."""
        parts = [self._takes["train"], self._takes["validation"]]
        onto = self._onto.by_body if self._onto else ()
        structures = {self._character(who).structure for part in parts for who in part}
        structures |= {self._onto.cast[name].structure for name in onto} if self._onto else set()
        return {
            "characters": [*(_called(who) for part in parts for who in part), *onto],
            "structures": sorted(structures),
            "clips": sorted(take for part in parts for takes in part.values() for take in takes),
        }

    def motion(self, take: str) -> Motion:
        """A whole take. Raises FileError where it cannot be read."""
        return self._take(take)

    def body(self, take: str) -> Character:
        """The performer of a take."""
        return self._character(performer(take))

    def content_of(self, take: str) -> str:
        """A hash of a take's file."""
        return self._entries[self._files[take]].content

    # ------------------------------------------------------------------------------- what there is
    @cached_property
    def _files(self) -> Mapping[str, Path]:
        """Take -> file."""
        if not self._root:
            raise BenchError(f"cmu needs a folder of takes: {self.card.obtain}")
        folder = Path(self._root).expanduser()
        if not folder.is_dir():
            raise BenchError(f"cmu: there is no folder {folder}; {self.card.obtain}")
        files = {name: path for name, path in bvh_files(folder).items() if performer(name)}
        if not files:
            raise BenchError(
                f"{folder} holds no takes called SUBJECT_TAKE.bvh, as in 05_01.bvh; "
                f"it holds {contents(folder)}"
            )
        return files

    @cached_property
    def _entries(self) -> Mapping[Path, CatalogueEntry]:
        return catalogue(Path(self._root).expanduser(), self._files.values())

    @cached_property
    def _problems(self) -> Mapping[str, str]:
        """Takes that are left out -> why."""
        problems = {}
        bones: dict[str, str] = {}
        for name, path in self._files.items():
            entry = self._entries[path]
            frames = entry.frames_at(FPS)
            if part_of(name) is None:
                problems[name] = "motion of the test on another skeleton"
            elif entry.problem or frames < SHORTEST:
                problems[name] = entry.problem or f"{frames} frames at {FPS:g} per second"
            elif bones.setdefault(performer(name), entry.hierarchy) != entry.hierarchy:
                problems[name] = "another skeleton than the subject's first take"
        return problems

    @cached_property
    def _takes(self) -> Mapping[Part, Mapping[str, Sequence[str]]]:
        """Part -> performer -> takes."""
        by_part: dict[Part, dict[str, list[str]]] = {"train": {}, "validation": {}, "test": {}}
        for name in self._files:
            part = part_of(name)
            if part and name not in self._problems:
                by_part[part].setdefault(performer(name), []).append(name)
        return by_part

    @cached_property
    def _listed(self) -> Mapping[str, tuple[str, slice]]:
        """Clip of a case -> the take that it is cut from, and its frames."""
        listed = {}
        for takes in self._takes[self._part].values():
            for take in takes:
                cut = parts(self._frames(take), LONGEST)
                for number, frames in enumerate(cut, 1):
                    listed[take if len(cut) == 1 else f"{take}-{number:02d}"] = (take, frames)
        return listed

    @cached_property
    def _onto(self) -> Onto | None:
        if not self._bodies:
            return None
        takes = [take for performers in self._takes["train"].values() for take in performers]
        return Onto(self, takes, self._bodies)

    def _frames(self, take: str) -> int:
        return self._entries[self._files[take]].frames_at(FPS)

    def _info(self, clip: str, source: str, target: str) -> CaseInfo:
        alike = self._character(source).structure == self._character(target).structure
        split, names = usual_split(source == target, alike), (_called(source), _called(target))
        cut = self._listed[clip][1]
        case = f"cmu/{names[0]}>{names[1]}/{clip}"
        return CaseInfo(case, "retarget", split, *names, clip, frames=cut.stop - cut.start)

    def _first_body(self, who: str) -> Character:
        """The body of a performer's first take; its structure is named after the number of joints."""
        first = next(part[who][0] for part in self._takes.values() if who in part)
        body = self._imported(first).character
        return replace(body, name=_called(who), structure=f"cmu{len(body.skeleton)}")

    def _read(self, take: str) -> Motion:
        motion, body = self._imported(take), self._character(performer(take))
        if not motion.skeleton.same_as(body.skeleton, tolerance=ROUNDING * body.height):
            raise Unusable(take, "has other bones than the subject's first take")
        return body.motion(motion.rotations, motion.root, motion.fps)

    def _imported(self, take: str) -> Motion:
        return importer.load(self._files[take], Reading(unit=self._unit), fps=FPS).motion


def _called(who: str) -> str:
    return f"cmu{who}" if who.isdigit() else f"cmu_{who}"


plugin = Cmu
