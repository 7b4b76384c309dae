"""Protocols: the clips and pairs that are asked of a Mixamo folder, and the cases its files can answer."""

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.motion.bvh.catalogue import CatalogueEntry, some
from retarget_bench.motion.motion import resampled_frames

from .layout import Layout

SAN_CLIPS = 106
SAN_SOURCE = "BigVegas"
SAN_TARGETS = ("Mousey", "Goblin", "Mremireh", "Vampire")
"""Aberman et al. 2020, released code: BigVegas to each (cross), and all ordered pairs (intra, self)."""
SAN_FPS = 30.0
SAN_MULTIPLE = 4
"""SAN's code floors the length of every clip to a multiple of this."""
FOLDS = 5
_SALT = "mixamo-folds-191"
"""Chosen among the first thousand so that Aj, BigVegas, Goblin_m, Kaya and Mousey_m fall in five different
folds and the clips of SAN's test list spread evenly."""
_VARIANT = re.compile(r" \(\d+\)$")
"""``Idle (1)``: another take of ``Idle``, kept in the same fold."""


class Asked(NamedTuple):
    """Numbers that a protocol asks for, found or not; ``characters`` are the targets."""

    clips: int
    characters: int
    pairs: int


@dataclass(frozen=True)
class Selection:
    """Clips and pairs that a protocol asks of a folder.

    clips, pairs: what is asked and can be there; pairs are (source, target) folder names.
    asked:        how much the protocol asks for.
    structure:    character -> the native structure that the protocol takes for granted.
    multiple:     clips are cut to a multiple of so many frames.
    """

    clips: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    asked: Asked
    structure: dict[str, str] = field(default_factory=dict)
    multiple: int = 1

    @property
    def characters(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for pair in self.pairs for name in pair))


def everything(layout: Layout) -> Selection:
    """All ordered pairs of the characters found, on all clips found."""
    return _all_pairs(layout, layout.names)


def san(layout: Layout) -> Selection:
    """SAN's test: its clips (``test_list.txt``, else all found), BigVegas and four targets."""
    clips = layout.listed if layout.listed is not None else layout.names
    targets = [name for base in SAN_TARGETS if (name := _folder_of(layout, base))]
    pairs = [(source, target) for source in targets for target in targets]
    structure = dict.fromkeys(targets, "mixamo-B")
    if SAN_SOURCE in layout.clips:
        pairs = [(SAN_SOURCE, target) for target in targets] + pairs
        structure[SAN_SOURCE] = "mixamo-A"
    asked = Asked(max(SAN_CLIPS, len(clips)), len(SAN_TARGETS), len(SAN_TARGETS) * (len(SAN_TARGETS) + 1))
    return Selection(tuple(sorted(clips)), tuple(pairs), asked, structure, SAN_MULTIPLE)


def one_fold(layout: Layout, fold: int) -> Selection:
    """All ordered pairs, on the clips that this fold holds out."""
    return _all_pairs(layout, tuple(name for name in layout.names if fold_of(name) == fold))


def steering(layout: Layout, tested: Selection, held_out: tuple[str, ...], fold: int) -> Selection:
    """The validation part: untested clips of one fold, all ordered pairs of characters not held out."""
    characters = [name for name in layout.characters if name not in held_out]
    clips = tuple(name for name in layout.names if name not in tested.clips and fold_of(name) == fold)
    pairs = tuple((source, target) for source in characters for target in characters)
    return Selection(clips, pairs, Asked(len(clips), len(characters), len(pairs)), multiple=tested.multiple)


def fold_of(name: str) -> int:
    """The fold that holds a clip or a character out: a function of its name alone, so that adding files
    moves nothing."""
    text = f"{_SALT}:{_VARIANT.sub('', name)}"
    return int(hashlib.sha256(text.encode()).hexdigest(), 16) % FOLDS


def _folder_of(layout: Layout, base: str) -> str | None:
    """A target's folder: split rigs carry the suffix ``_m``."""
    return next((name for name in (f"{base}_m", base) if name in layout.clips), None)


def _all_pairs(layout: Layout, clips: tuple[str, ...]) -> Selection:
    pairs = tuple((source, target) for source in layout.characters for target in layout.characters)
    return Selection(clips, pairs, Asked(len(clips), len(layout.characters), len(pairs)))


Files = Mapping[str, Mapping[str, Path]]
_NAMED = 5
"""So many are named in a note; the rest are counted."""


@dataclass(frozen=True)
class Clip:
    """One readable file: its native structure and its length in cases."""

    structure: str
    frames: int


@dataclass
class Listing:
    """The cases of a selection, and sentences about what is not among them."""

    infos: list[CaseInfo] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def clips(self) -> int:
        return len({info.clip for info in self.infos})

    @property
    def pairs(self) -> int:
        return len({info.pair for info in self.infos})


def readable(
    files: Files,
    entries: Mapping[Path, CatalogueEntry],
    structure: Callable[[str, Path, CatalogueEntry], str],
    selection: Selection,
    fps: float,
) -> tuple[dict[tuple[str, str], Clip], list[str]]:
    """(character, clip) -> what is known of it, and the notes on those that are left out.

    ``structure`` gives a file's native structure, or raises BenchError where its body cannot be used.
    """
    found: dict[tuple[str, str], Clip] = {}
    broken: list[str] = []
    foreign: list[str] = []
    for character, clips in files.items():
        for name, path in clips.items():
            entry = entries[path]
            if entry.problem:
                broken.append(f"{character}/{path.name} ({entry.problem})")
                continue
            try:
                body = structure(character, path, entry)
            except BenchError as error:
                broken.append(f"{character}/{path.name} ({error})")
                continue
            if selection.structure.get(character, body) != body:
                foreign.append(f"{character}/{path.name}")
                continue
            frames = resampled_frames(entry.frames, entry.fps, fps)
            found[character, name] = Clip(body, frames)
    notes = [_note(broken, "cannot be used")] if broken else []
    if foreign:
        notes.append(_note(foreign, "another rig than the protocol's character"))
    return found, notes


def list_cases(
    dataset: str, selection: Selection, clips: Mapping[tuple[str, str], Clip], notes: Sequence[str]
) -> Listing:
    """Every pair of the selection on every clip that both have at the same length, clip by clip."""
    listing = Listing(notes=list(notes))
    absent: dict[str, int] = {}
    unequal: dict[str, int] = {}
    short: dict[str, int] = {}
    for name in selection.clips:
        for source, target in selection.pairs:
            first, second = clips.get((source, name)), clips.get((target, name))
            if first is None or second is None:
                absent[name] = absent.get(name, 0) + 1
            elif first.frames != second.frames:
                unequal[name] = unequal.get(name, 0) + 1
            elif not (frames := first.frames // selection.multiple * selection.multiple):
                short[name] = short.get(name, 0) + 1
            else:
                split = "self" if source == target else "cross"
                split = "intra" if split == "cross" and first.structure == second.structure else split
                case = f"{dataset}/{source}>{target}/{name}"
                listing.infos.append(CaseInfo(case, "retarget", split, source, target, name, frames=frames))
    listing.notes += _dropped(absent, "for want of the clip on one side")
    listing.notes += _dropped(short, f"for having fewer than {selection.multiple} frames")
    listing.notes += [
        f"{note}: {_lengths(clips, unequal)}" for note in _dropped(unequal, "for unequal lengths")
    ]
    listing.notes += _mixed(clips)
    return listing


def _dropped(counts: Mapping[str, int], why: str) -> list[str]:
    if not counts:
        return []
    pairs, clips = sum(counts.values()), len(counts)
    return [f"{pairs} ordered pairs in {clips} clip{'s' * (clips > 1)} left out {why}"]


def _lengths(clips: Mapping[tuple[str, str], Clip], names: Mapping[str, int]) -> str:
    shown = []
    for name in list(names)[:_NAMED]:
        each = ", ".join(f"{who} {clip.frames}" for (who, what), clip in clips.items() if what == name)
        shown.append(f"{name} ({each} frames)")
    return "; ".join(shown) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")


def _mixed(clips: Mapping[tuple[str, str], Clip]) -> list[str]:
    """Characters whose folder holds rigs of several structures."""
    structures: dict[str, set[str]] = {}
    for (character, _), clip in clips.items():
        structures.setdefault(character, set()).add(clip.structure)
    return [
        f"the folder {name} holds rigs of {len(found)} structures; each clip counts with its own"
        for name, found in structures.items()
        if len(found) > 1
    ]


def _note(files: Sequence[str], why: str) -> str:
    return f"{len(files)} file{'s' * (len(files) > 1)} left out, {why}: {some(files, _NAMED)}"
