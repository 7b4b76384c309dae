"""People of LAFAN1 and the dog of MANN, carried to each other: no right answers, only real motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Literal

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.api.datasets import usual_splits
from retarget_bench.errors import BenchError, some
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.catalogue import CatalogueEntry, by_name, catalogue, fingerprint
from retarget_bench.training.lazy_clips import Cast, NamedClips

from .takes import DOG, FPS, PERSON, SHORTEST, SPECIES, Clip, Motions, Part, Protocol, Takes, cut, find

OWN = (
    "the split is our own: of five recordings, by a hash of their names, two are tested, one steers "
    "training and two are trained on"
)
AS_IN_PAN = "people are split as in PAN (subject1 is tested), the dog's split is our own"
DEPENDENT = "clips of one take are no independent draws: true intervals are wider than those given"


class LafanDog(Dataset):
    """Clips of a few seconds, each carried to the other species without a reference; self pairs with one.

    The setting of PAN, section 7. Kinds are ``idle``, ``move`` and ``sit``, told from the motion
    (``retarget_bench/motion/actions.py``). Where all takes are there that the paper uses of LAFAN1, people
    are split as in the paper, which tests on ``subject1``; else all takes are used, and the split is our
    own, by name. The dog's is our own always, since the paper drew its own at random. Answers are compared
    with the test motion of their species as sets (FID, KID).
    """

    card = DatasetCard(
        name="lafan_dog",
        summary="LAFAN1's people and MANN's dog, carried to each other without references (PAN, section 7)",
        version="1",
        licence="LAFAN1: CC BY-NC-ND 4.0 (Ubisoft); the dog: CC BY-NC 4.0 (AI4Animation); get your own",
        obtain=(
            "LAFAN1: lafan1.zip of github.com/ubisoft/ubisoft-laforge-animation-dataset, unpacked into "
            "DIR/lafan1. The dog: the motion capture archive of SIGGRAPH_2018 (MANN) that "
            "github.com/sebastianstarke/AI4Animation links to, its BVH files in DIR/dog. Then give --root "
            "DIR. PAN tests on subject1 of 23 takes of LAFAN1 and drew the dog's split at random. Unless "
            "all 23 are there, people are split by our own rule, as the dog always is: that split shares "
            "no list with the paper's"
        ),
        splits=usual_splits("self", "cross"),
        parameters={
            "root": "the folder that holds both folders",
            "people": "the folder of LAFAN1's BVH files, in root or elsewhere",
            "dogs": "the folder of the dog's BVH files, in root or elsewhere",
            "seconds": "about how long clips are; takes are cut into equal ones",
            "protocol": (
                "pan (people: the paper's 23 takes, subject1 is tested), own (all takes, by name) or auto "
                "(pan where all of its takes are there)"
            ),
            "part": "test, or validation: other takes, neither tested nor trained on",
        },
        locations=("root", "people", "dogs"),
    )

    def __init__(
        self,
        root: str = "",
        people: str = "lafan1",
        dogs: str = "dog",
        seconds: float = 8.0,
        protocol: Protocol = "auto",
        part: Literal["test", "validation"] = "test",
    ) -> None:
        if not 2.2 <= seconds <= 600.0:
            raise BenchError(
                f"lafan_dog: seconds={seconds:g}; clips last 2.2 (the 64 frames of a window) to 600"
            )
        self._root, self._folders = root, {PERSON: people, DOG: dogs}
        self._seconds, self._protocol, self._part = seconds, protocol, part

    # ------------------------------------------------------------------------------- the contract
    @property
    def content(self) -> str:
        """A hash of the bytes of the takes and of how they are read, split and cut."""
        files = fingerprint(by_name(self._takes.files, self._entries))
        return f"{files} ({self._split}, {self._seconds:g} s, {self._part})"

    @property
    def label(self) -> str:
        name = f"lafan_dog ({self._split})"
        return name if self._part == "test" else f"{name}, {self._part}"

    @cached_property
    def notes(self) -> Sequence[str]:
        takes = self._takes
        of_part = []
        for species in SPECIES:
            names = [name for name, part in takes.part[species].items() if part == self._part]
            of_part.append(f"{species}: {some(names, 12) or 'none'}")
        notes = ["; ".join(of_part), AS_IN_PAN if takes.pan else OWN, DEPENDENT]
        if takes.others:
            listed = some([path.name for path in takes.others], 4)
            notes.append(f"{len(takes.others)} files left out, no takes of this protocol by name: {listed}")
        if self._problems:
            listed = some([f"{name} ({why})" for name, why in self._problems.items()], 4)
            notes.append(f"{len(self._problems)} takes left out: {listed}")
        return tuple(notes)

    def characters(self) -> Mapping[str, Character]:
        return {species: self._motions.body(species) for species in SPECIES}

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Clip by clip."""
        if task != "retarget" or split not in self.card.splits:
            return ()
        return tuple(
            info
            for clip in self._clips[self._part]
            for target in SPECIES
            if (info := self._info(clip, target)).split == split
        )

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this part, FileError where a file cannot be read."""
        clip = self._listed.get(info.clip)
        if clip is None or clip.species != info.source or info.target not in SPECIES:
            raise BenchError(f"{self.label} has no case {info.id}")
        source = self._motions.clip(clip)
        if info.source == info.target:
            return Case(info, source, source.character, source)
        return Case(info, source, self._motions.body(info.target))

    def real(self, task: str, structure: str) -> Sequence[CaseInfo]:
        """The self cases of a species: what answers of that species are compared with."""
        bodies = self.characters()
        return [info for info in self.cases(task, "self") if bodies[info.target].structure == structure]

    # ------------------------------------------------------------------------------- beyond it
    def training(self) -> Cast:
        """Structure -> character -> clips of takes that are neither tested nor in ``validation``."""
        clips = {clip.name: clip for clip in self._clips["train"]}
        cast = {}
        for species in SPECIES:
            if names := [name for name, clip in clips.items() if clip.species == species]:
                read = NamedClips(names, lambda name: self._motions.clip(clips[name]))
                cast[self._motions.body(species).structure] = {species: read}
        return cast

    def validation(self) -> LafanDog:
        """The validation part: takes of its own."""
        folders = (self._folders[PERSON], self._folders[DOG])
        return LafanDog(self._root, *folders, self._seconds, self._protocol, "validation")

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Characters, structures and clips that training and its validation have: what weights carry."""
        clips = [*self._clips["train"], *self._clips["validation"]]
        return {
            "characters": list(SPECIES),
            "structures": [self._motions.body(species).structure for species in SPECIES],
            "clips": sorted(clip.name for clip in clips),
        }

    # ------------------------------------------------------------------------------- what there is
    @cached_property
    def _takes(self) -> Takes:
        return find(self._root, self._folders, self._protocol)

    @cached_property
    def _entries(self) -> Mapping[Path, CatalogueEntry]:
        files = [path for takes in self._takes.files.values() for path in takes.values()]
        return catalogue(self._takes.root, files)

    @cached_property
    def _motions(self) -> Motions:
        usable = {
            species: {name: path for name, path in takes.items() if not self._unusable(path)}
            for species, takes in self._takes.files.items()
        }
        for species, takes in usable.items():
            if not takes:
                path = next(iter(self._takes.files[species].values()))
                raise BenchError(f"no take of a {species} can be used: {path}: {self._unusable(path)}")
        return Motions(usable)

    def _unusable(self, path: Path) -> str:
        """The reason why a take cannot be used, from its header; "" where it can."""
        entry = self._entries[path]
        frames = entry.frames_at(FPS)
        if entry.problem or frames >= SHORTEST:
            return entry.problem
        return f"has {frames} frames at {FPS:g} per second; clips have {SHORTEST} or more"

    @property
    def _split(self) -> str:
        return "people split as in PAN" if self._takes.pan else "own split"

    @cached_property
    def _clips(self) -> Mapping[Part, list[Clip]]:
        """Clips by part, of takes that can be read and are of the species' body."""
        by_part: dict[Part, list[Clip]] = {"train": [], "validation": [], "test": []}
        for species in SPECIES:
            for name, path in self._takes.files[species].items():
                if name not in self._problems:
                    frames = self._entries[path].frames_at(FPS)
                    clips = cut(species, name, frames, round(self._seconds * FPS))
                    by_part[self._takes.part[species][name]] += clips
        return by_part

    @cached_property
    def _listed(self) -> Mapping[str, Clip]:
        return {clip.name: clip for clip in self._clips[self._part]}

    @cached_property
    def _problems(self) -> Mapping[str, str]:
        """Takes that are left out, and why."""
        problems = {}
        for species in SPECIES:
            for name, path in self._takes.files[species].items():
                problem = self._unusable(path) or self._motions.misfit(species, name)
                if problem:
                    problems[name] = problem
        return problems

    def _info(self, clip: Clip, target: str) -> CaseInfo:
        return CaseInfo(
            id=f"{self.card.name}/{clip.species}>{target}/{clip.name}",
            task="retarget",
            split="self" if clip.species == target else "cross",
            source=clip.species,
            target=target,
            clip=clip.name,
            kind=self._motions.action(clip),
            frames=clip.frames,
        )


plugin = LafanDog
