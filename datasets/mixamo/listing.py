"""From what a protocol asks to the cases that the files can answer, and what had to be left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.motion.bvh.catalogue import CatalogueEntry, some
from retarget_bench.motion.motion import resampled_frames

from .protocols import Selection

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
