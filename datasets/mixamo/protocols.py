"""Protocols: the clips and pairs that are asked of a Mixamo folder, and the cases its files can answer."""

import hashlib
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.api import CaseInfo
from retarget_bench.errors import BenchError
from retarget_bench.motion.bvh.catalogue import CatalogueEntry, some
from retarget_bench.motion.character import resampled_frames

from .layout import Layout

SAN_CLIPS = 106
SAN_SOURCE = "BigVegas"
SAN_TARGETS = ("Mousey", "Goblin", "Mremireh", "Vampire")
"""Aberman et al. 2020, released code: BigVegas to each (cross), and all ordered pairs (intra, self)."""
SAN_PAIRS = len(SAN_TARGETS) * (len(SAN_TARGETS) + 1)
SAN_FPS = 30.0
SAN_MULTIPLE = 4
"""SAN's code floors the length of every clip to a multiple of this."""
FOLDS = 5
_SALT = "mixamo-folds-191"
"""Chosen among the first thousand so that Aj, BigVegas, Goblin_m, Kaya and Mousey_m fall in five different
folds and the clips of SAN's test list spread evenly."""
_VARIANT = re.compile(r" \(\d+\)$")
"""``Idle (1)``: another take of ``Idle``, kept in the same fold."""


@dataclass(frozen=True)
class Selection:
    """Clips and pairs that a protocol asks of a folder.

    clips, pairs: as far as they can be there; pairs are (source, target) folder names.
    structure:    character -> the native structure that the protocol takes for granted.
    multiple:     clips are cut to a multiple of so many frames.
    """

    clips: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    structure: dict[str, str] = field(default_factory=dict)
    multiple: int = 1

    @property
    def characters(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for pair in self.pairs for name in pair))


def all_pairs(clips: Iterable[str], characters: Sequence[str], multiple: int = 1) -> Selection:
    """All ordered pairs of characters on all of the clips."""
    pairs = tuple((source, target) for source in characters for target in characters)
    return Selection(tuple(clips), pairs, multiple=multiple)


def san(layout: Layout) -> Selection:
    """SAN's test: its clips (``test_list.txt``, else all found), BigVegas and four targets."""
    clips = layout.listed if layout.listed is not None else layout.names
    folders = ((f"{base}_m", base) for base in SAN_TARGETS)  # split rigs carry the suffix
    targets = [found[0] for names in folders if (found := [name for name in names if name in layout.clips])]
    pairs = [(source, target) for source in targets for target in targets]
    structure = dict.fromkeys(targets, "mixamo-B")
    if SAN_SOURCE in layout.clips:
        pairs = [(SAN_SOURCE, target) for target in targets] + pairs
        structure[SAN_SOURCE] = "mixamo-A"
    return Selection(tuple(sorted(clips)), tuple(pairs), structure, SAN_MULTIPLE)


def fold_of(name: str) -> int:
    """The fold that holds a clip or a character out: a function of its name alone, so that adding files
    moves nothing."""
    text = f"{_SALT}:{_VARIANT.sub('', name)}"
    return int(hashlib.sha256(text.encode()).hexdigest(), 16) % FOLDS


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


def list_cases(
    dataset: str,
    selection: Selection,
    files: Files,
    entries: Mapping[Path, CatalogueEntry],
    structure: Callable[[str, Path, CatalogueEntry], str],
    fps: float,
) -> Listing:
    """Every pair of the selection on every clip that both have at the same length, clip by clip.

    structure: gives a file's native structure, or raises BenchError where its body cannot be used.
    """
    clips, notes = _readable(selection, files, entries, structure, fps)
    listing = Listing(notes=notes)
    absent, unequal, short = Counter[str](), Counter[str](), Counter[str]()
    for name in selection.clips:
        for source, target in selection.pairs:
            first, second = clips.get((source, name)), clips.get((target, name))
            if first is None or second is None:
                absent[name] += 1
            elif first.frames != second.frames:
                unequal[name] += 1
            elif not (frames := first.frames // selection.multiple * selection.multiple):
                short[name] += 1
            else:
                same = first.structure == second.structure
                split = "self" if source == target else "intra" if same else "cross"
                case = f"{dataset}/{source}>{target}/{name}"
                listing.infos.append(CaseInfo(case, "retarget", split, source, target, name, frames=frames))
    notes += _dropped(absent, "for want of the clip on one side")
    notes += _dropped(short, f"for having fewer than {selection.multiple} frames")
    notes += [f"{note}: {_lengths(clips, unequal)}" for note in _dropped(unequal, "for unequal lengths")]
    structures: dict[str, set[str]] = {}
    for (character, _), clip in clips.items():
        structures.setdefault(character, set()).add(clip.structure)
    notes += [
        f"the folder {name} holds rigs of {len(found)} structures; each clip counts with its own"
        for name, found in structures.items()
        if len(found) > 1
    ]
    return listing


def _readable(
    selection: Selection,
    files: Files,
    entries: Mapping[Path, CatalogueEntry],
    structure: Callable[[str, Path, CatalogueEntry], str],
    fps: float,
) -> tuple[dict[tuple[str, str], Clip], list[str]]:
    """(character, clip) -> its facts, and the notes on files that are left out."""
    found: dict[tuple[str, str], Clip] = {}
    broken: list[str] = []
    foreign: list[str] = []
    for character, clips in files.items():
        for name, path in clips.items():
            entry = entries[path]
            try:
                body = "" if entry.problem else structure(character, path, entry)
            except BenchError as error:
                body, problem = "", str(error)
            else:
                problem = entry.problem
            if problem:
                broken.append(f"{character}/{path.name} ({problem})")
            elif selection.structure.get(character, body) != body:
                foreign.append(f"{character}/{path.name}")
            else:
                found[character, name] = Clip(body, resampled_frames(entry.frames, entry.fps, fps))
    reasons = ((broken, "cannot be used"), (foreign, "another rig than the protocol's character"))
    notes = [
        f"{len(names)} file{'s' * (len(names) > 1)} left out, {why}: {some(names, _NAMED)}"
        for names, why in reasons
        if names
    ]
    return found, notes


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
