"""Mixamo clips, one folder per character: the papers' test set or any part of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from retarget_bench.api import Case, CaseInfo, Dataset, DatasetCard
from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files.catalogue import CatalogueEntry, by_name, catalogue, fingerprint
from retarget_bench.training.lazy_clips import Cast, manifest

from . import protocols
from .motions import Motions, Pairs, training_clips

CARD = DatasetCard(
    name="mixamo",
    summary=(
        "Clips that Mixamo applied to several characters, as DIR/Character/clip.bvh. Its references are "
        "nearly copied rotations: position error to them measures legs and root scale"
    ),
    version="1",
    licence="Mixamo content (Adobe): no redistribution; get your own",
    obtain=(
        "Download the clips from mixamo.com for every character and convert them to BVH, or ask the "
        "authors of SAN (Aberman et al. 2020) for their test archive; then give its folder with --root DIR"
    ),
    parameters={
        "root": "the folder that holds one folder of BVH files per character",
        "fps": "frames per second of the cases; 30 takes every second frame of 60, as SAN does",
        "structure": (
            "joints of the cases: native (the papers' S23 or S28 where the rig is theirs, else body22), "
            "full, body22, S23 or S28; splits always follow the rig in the file"
        ),
        "protocol": (
            "all (every ordered pair of the characters found), san (the papers' clips and pairs) or folds "
            "(one fifth of the clips, the rest to train on)"
        ),
        "fold": "which of the five folds the cases come from (protocol=folds)",
        "part": (
            "test, or validation: clips of the next fold (protocol=san: a fifth of those not tested), "
            "without the characters that are held out"
        ),
        "unit": "unit of the files: cm as Mixamo has it, or m",
    },
)
FOLDS_SUMMARY = (
    "{}. Protocol folds: cases are the clips of one fold in five, held out by name, and each fold also "
    "holds out characters. Where these clips are those of SAN's test_list.txt, they are the papers' own "
    "test clips: whoever trains on the other folds has trained on them, and such numbers do not compare "
    "with the papers'"
)


class Mixamo(Dataset):
    """A case is a pair of characters on a clip that both perform in the same number of frames.

    Structures are those of the rigs as the files have them: A with a ``Pelvis`` (Aj, BigVegas, Kaya), B
    with split spine and shoulders (names in ``_m``), any other by its tree of joints. Files that cannot be
    read, clips that one side lacks and clips of unequal length are left out, and counted below every table.
    With ``protocol=san`` anything less than the papers' whole test set is called ``san-partial``.
    """

    card: DatasetCard = CARD

    def __init__(
        self,
        root: str = "",
        fps: float = 30.0,
        structure: Literal["native", "full", "body22", "S23", "S28"] = "native",
        protocol: Literal["all", "san", "folds"] = "all",
        fold: int = 0,
        unit: Literal["cm", "m"] = "cm",
        part: Literal["test", "validation"] = "test",
    ) -> None:
        if not 1.0 <= fps <= 1000.0:
            raise BenchError(
                f"mixamo: fps={fps:g} is not a frame rate; Mixamo's files have 60, SAN uses 30"
            )
        if not 0 <= fold < protocols.FOLDS:
            raise BenchError(f"mixamo: fold={fold}, but folds are 0 to {protocols.FOLDS - 1}")
        if fold and protocol != "folds":
            raise BenchError(f"mixamo: fold={fold} means something with protocol=folds only")
        if protocol == "san" and (fps != protocols.SAN_FPS or structure != "native"):
            raise BenchError(
                "mixamo: protocol=san means fps=30 and structure=native, as SAN's code has it; "
                "use protocol=all for other rates and joints"
            )
        if part == "validation" and protocol == "all":
            raise BenchError(
                "mixamo: protocol=all tests every clip and leaves none to train on; "
                "part=validation means something with protocol=folds or san"
            )
        self._root, self._fps, self._structure = root, fps, structure
        self._protocol, self._fold, self._unit, self._part = protocol, fold, unit, part
        if protocol == "folds":
            self.card = replace(CARD, summary=FOLDS_SUMMARY.format(CARD.summary))

    # ------------------------------------------------------------------------------- what there is
    @cached_property
    def _layout(self) -> protocols.Layout:
        return protocols.find(self._root)

    @cached_property
    def _selection(self) -> protocols.Selection:
        return self._tested if self._part == "test" else self._steering

    @cached_property
    def _steering(self) -> protocols.Selection:
        """Untested clips of one fold, for all characters that are not held out."""
        fold = (self._fold + 1) % protocols.FOLDS if self._protocol == "folds" else 0
        layout, tested = self._layout, self._tested
        clips = [
            name for name in layout.names if name not in tested.clips and protocols.fold_of(name) == fold
        ]
        characters = [name for name in layout.characters if name not in self.held_out]
        return protocols.all_pairs(clips, characters, tested.multiple)

    @cached_property
    def _tested(self) -> protocols.Selection:
        if self._protocol == "san":
            return protocols.san(self._layout)
        names, fold = self._layout.names, self._fold if self._protocol == "folds" else None
        clips = (name for name in names if fold is None or protocols.fold_of(name) == fold)
        return protocols.all_pairs(clips, self._layout.characters)

    @cached_property
    def _files(self) -> dict[str, dict[str, Path]]:
        """The files that the protocol asks for: character -> clip -> path."""
        selected = set(self._selection.clips)
        return {
            name: {clip: path for clip, path in self._layout.clips[name].items() if clip in selected}
            for name in self._selection.characters
        }

    @cached_property
    def _entries(self) -> dict[Path, CatalogueEntry]:
        files = [path for clips in self._files.values() for path in clips.values()]
        return catalogue(self._layout.root, files)

    @cached_property
    def _others(self) -> dict[Path, CatalogueEntry]:
        """The files that no case shows."""
        files = (path for clips in self._layout.clips.values() for path in clips.values())
        return catalogue(self._layout.root, [path for path in files if path not in self._entries])

    @cached_property
    def _motions(self) -> Motions:
        return Motions(self._structure, self._fps, self._unit, self._selection.multiple)

    @cached_property
    def _listing(self) -> protocols.Listing:
        return protocols.list_cases(self._selection, self._files, self._entries, self._motions)

    # ------------------------------------------------------------------------------- the contract
    @property
    def content(self) -> str:
        """A hash of the bytes of the files that the protocol asks for, and how they are read."""
        files = fingerprint(by_name(self._files, self._entries))
        how = f"{self._fps:g} fps, {self._structure}, {self._unit}, multiple of {self._selection.multiple}"
        return f"{files} ({how})"

    @property
    def label(self) -> str:
        """The name in tables. Anything less than SAN's whole test set is called ``san-partial``."""
        if self._part == "validation":
            return f"{self._with(part='test').label}, validation"
        if self._protocol == "folds":
            return f"mixamo fold {self._fold} of {protocols.FOLDS}{self._variant}"
        if self._protocol == "all":
            return f"mixamo{self._variant}"
        expected, pairs, listing = self._expected_clips, protocols.SAN_PAIRS, self._listing
        if self._whole_san:
            return f"mixamo san ({expected} clips, {pairs} pairs)"
        return f"mixamo san-partial ({listing.clips} of {expected} clips, {listing.pairs} of {pairs} pairs)"

    @cached_property
    def notes(self) -> Sequence[str]:
        notes = list(self._listing.notes)
        if self._part == "validation":
            return (f"{len(self._selection.clips)} clips that no test case shows", *notes)
        if self._protocol == "san" and not self._whole_san:
            expected, infos = self._expected_clips, self._listing.infos
            notes.insert(
                0,
                f"not the papers' test set but {len(infos)} of its {expected * protocols.SAN_PAIRS} cases, "
                f"with {self._listing.clips} of {expected} clips and "
                f"{len({each.target for each in infos})} of {len(protocols.SAN_TARGETS)} target "
                "characters: its numbers do not compare with published ones",
            )
        if self._protocol == "folds":
            held = ", ".join(self.held_out) or "no character"
            notes.insert(0, f"fold {self._fold} holds out {held} and {len(self._selection.clips)} clips")
        return tuple(notes)

    def characters(self) -> Mapping[str, Character]:
        """Every character of the cases, with the body that most of its clips have."""
        bodies = {}
        for name in sorted({name for info in self._listing.infos for name in (info.source, info.target)}):
            clips = {info.clip for info in self._listing.infos if name in (info.source, info.target)}
            paths = [self._files[name][clip] for clip in sorted(clips)]
            counts = Counter(self._entries[path].hierarchy for path in paths)
            usual = counts.most_common(1)[0][0]
            path = next(path for path in paths if self._entries[path].hierarchy == usual)
            bodies[name] = self._motions.rig(name, path, self._entries[path]).character
        return bodies

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Clip by clip, so that the motions of a clip are read once for all its pairs."""
        return tuple(info for info in self._listing.infos if (info.task, info.split) == (task, split))

    def load(self, info: CaseInfo) -> Case:
        """Source, target and reference of a case; raises FileError where a file cannot be read."""
        source = self.motion(info.source, info.clip)
        reference = self.motion(info.target, info.clip)
        return Case(info, source, reference.character, reference)

    # ------------------------------------------------------------------------------- beyond it
    def motion(self, character: str, clip: str) -> Motion:
        """The motion of a character in a clip, on the joints and at the rate of the cases."""
        path = self._layout.clips.get(character, {}).get(clip)
        if path is None:
            raise BenchError(f"{self._layout.root} holds no {character}/{clip}.bvh")
        entry = self._entries[path] if path in self._entries else self._others[path]
        if entry.problem:
            raise FileError(path, entry.problem)
        return self._motions.motion(character, path, entry)

    def training(self) -> Cast:
        """Structure -> character -> clips that no case of test or validation shows.

        folds: every clip of the other three folds, by the characters that this fold does not hold out.
        san:   every clip that the test list does not name but for the fifth that steers, by who is no
               target. all: nothing.
        """
        if self._protocol == "all":
            return {}
        shown = {*self._tested.clips, *self._steering.clips}
        free = (name for name in self._layout.characters if name not in self.held_out)
        files = {
            name: {clip: path for clip, path in self._layout.clips[name].items() if clip not in shown}
            for name in free
        }
        return training_clips(self._motions, files, {**self._others, **self._entries})

    def training_pairs(self) -> Pairs | None:
        """Training clips by any two characters; None where no two of them perform the same one."""
        lengths: dict[str, dict[str, int]] = {}
        for cast in self.training().values():
            for name, clips in cast.items():
                for clip in clips.names:
                    path = self._layout.clips[name][clip]
                    entry = self._entries.get(path) or self._others[path]
                    lengths.setdefault(clip, {})[name] = entry.frames
        pairs = Pairs(lengths, self.motion)
        return pairs if len(pairs) else None

    def validation(self) -> Mixamo:
        """The validation part: clips of the next fold. Raises BenchError with protocol=all."""
        return self._with(part="validation")

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        """Characters, structures and clips that training and its validation have: what weights carry."""
        return manifest(self.training(), self._steering.clips)

    @property
    def held_out(self) -> tuple[str, ...]:
        """Characters that may not be trained on."""
        names = self._layout.characters
        if self._protocol == "folds":
            return tuple(name for name in names if protocols.fold_of(name) == self._fold)
        targets = {target for _, target in self._tested.pairs}
        return tuple(name for name in names if name in targets) if self._protocol == "san" else ()

    def _with(self, part: Literal["test", "validation"]) -> Mixamo:
        """The same data, its other part."""
        same = (self._root, self._fps, self._structure, self._protocol, self._fold, self._unit)
        return Mixamo(*same, part)

    @property
    def _expected_clips(self) -> int:
        """The clips that SAN's protocol asks for, found or not."""
        return max(protocols.SAN_CLIPS, len(self._selection.clips))

    @property
    def _whole_san(self) -> bool:
        listed = self._layout.listed is not None and self._expected_clips == protocols.SAN_CLIPS
        return listed and len(self._listing.infos) == protocols.SAN_CLIPS * protocols.SAN_PAIRS

    @property
    def _variant(self) -> str:
        """Parameters that differ from their defaults, for the label."""
        differences = [f"{self._fps:g} fps"] if self._fps != protocols.SAN_FPS else []
        differences += [self._structure] if self._structure != "native" else []
        return f" ({', '.join(differences)})" if differences else ""


plugin = Mixamo
