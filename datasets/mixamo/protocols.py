"""Files of a Mixamo folder, ``Character/clip.bvh``, and the cases that a protocol asks of them."""

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from retarget_bench.api import CaseInfo
from retarget_bench.api.datasets import usual_split
from retarget_bench.errors import BenchError, FileError, some
from retarget_bench.motion.files.catalogue import CatalogueEntry, bvh_files, contents, existing, subfolders

from .motions import Motions

NOT_CHARACTERS = ("std_bvhs", "mean_var")
"""Folders of the archive of SAN's authors that hold rest poses and statistics, not clips."""
EXAMPLE = "DIR holds one folder per character with its clips, as in DIR/BigVegas/Running.bvh"
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
class Layout:
    """The files found.

    clips:  character -> clip name (file name without ``.bvh``) -> file; both sorted by name.
    listed: the clip names of ``test_list.txt``, or None where there is no such file.
    """

    root: Path
    clips: dict[str, dict[str, Path]]
    listed: tuple[str, ...] | None

    @property
    def characters(self) -> tuple[str, ...]:
        return tuple(self.clips)

    @property
    def names(self) -> tuple[str, ...]:
        """Every clip that any character performs, sorted."""
        return tuple(sorted({name for clips in self.clips.values() for name in clips}))


def find(root: str) -> Layout:
    """Look at the folder; raises BenchError with what is there instead and what to give."""
    if not root:
        raise BenchError(
            "mixamo needs a folder of BVH files that you have got from Mixamo (they may not be passed on): "
            f"give --root DIR, or mixamo[root=DIR]. {EXAMPLE}."
        )
    folder = existing(Path(root).expanduser())
    if folder.is_file():
        raise BenchError(f"{folder} is a file: give the folder of all characters. {EXAMPLE}.")
    clips = {each.name: files for each in _folders(folder) if (files := bvh_files(each))}
    names = Counter(name for files in clips.values() for name in files)
    shared = sum(count > 1 for count in names.values())
    if not clips or (shared < 0.5 * len(names) and _deeper(folder)):
        raise BenchError(_no_clips(folder))
    return Layout(folder, clips, _test_list(folder / "test_list.txt"))


def _folders(folder: Path) -> list[Path]:
    return [each for each in subfolders(folder) if each.name not in NOT_CHARACTERS]


def _deeper(folder: Path) -> list[Path]:
    """Folders that hold no BVH files but folders with some: what a parent of the right folder has."""
    below = [each for each in _folders(folder) if not bvh_files(each)]
    return [each for each in below if any(bvh_files(deep) for deep in _folders(each))]


def _test_list(path: Path) -> tuple[str, ...] | None:
    if not path.is_file():
        return None
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(path, f"is not a list of clip names, one per line ({error})") from error
    names = (re.sub(r"(?i)\.bvh$", "", line.strip()) for line in lines if line.strip())
    return tuple(dict.fromkeys(names))


def _no_clips(folder: Path) -> str:
    """The reason why a folder is not a Mixamo root, and which neighbour is."""
    if own := bvh_files(folder):
        hint = f"--root {folder.resolve().parent}"
        return (
            f"{folder} holds {len(own)} BVH files itself, so it looks like the folder of one character: "
            f"give the folder above it, {hint}. {EXAMPLE}."
        )
    if deeper := _deeper(folder):
        return (
            f"{folder} is no folder of characters that perform the same clips, but a folder in it may be: "
            f"give --root {' or --root '.join(str(each) for each in deeper[:5])}. {EXAMPLE}."
        )
    others = sorted({each.suffix.lower() for each in folder.glob("*/*") if each.is_file() and each.suffix})
    unread = f"; its folders hold {some(others)} files, and only BVH is read" if others else ""
    return f"{folder} holds no Character/clip.bvh; it holds {contents(folder)}{unread}. {EXAMPLE}."


# ---------------------------------------------------------------------------------------- protocols
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
    targets = [
        candidates[0]
        for names in folders
        if (candidates := [name for name in names if name in layout.clips])
    ]
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
_LISTED = 5
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
    selection: Selection, files: Files, entries: Mapping[Path, CatalogueEntry], motions: Motions
) -> Listing:
    """Every pair of the selection on every clip that both have at the same length, clip by clip."""
    clips, notes = _readable(selection, files, entries, motions)
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
                split = usual_split(source == target, same)
                case = f"mixamo/{source}>{target}/{name}"
                listing.infos.append(CaseInfo(case, "retarget", split, source, target, name, frames=frames))
    notes += _dropped(absent, "for want of the clip on one side")
    notes += _dropped(short, f"for having fewer than {selection.multiple} frames")
    notes += [f"{note}: {_lengths(clips, unequal)}" for note in _dropped(unequal, "for unequal lengths")]
    structures: dict[str, set[str]] = {}
    for (character, _), clip in clips.items():
        structures.setdefault(character, set()).add(clip.structure)
    notes += [
        f"the folder {name} holds rigs of {len(rigs)} structures; each clip counts with its own"
        for name, rigs in structures.items()
        if len(rigs) > 1
    ]
    return listing


def _readable(
    selection: Selection, files: Files, entries: Mapping[Path, CatalogueEntry], motions: Motions
) -> tuple[dict[tuple[str, str], Clip], list[str]]:
    """(character, clip) -> its facts, and the notes on files that are left out."""
    readable: dict[tuple[str, str], Clip] = {}
    broken: list[str] = []
    foreign: list[str] = []
    for character, clips in files.items():
        for name, path in clips.items():
            entry = entries[path]
            body, problem = "", entry.problem
            if not problem:
                try:
                    body = motions.rig(character, path, entry).native.structure
                except BenchError as error:
                    problem = str(error)
            if problem:
                broken.append(f"{character}/{path.name} ({problem})")
            elif selection.structure.get(character, body) != body:
                foreign.append(f"{character}/{path.name}")
            else:
                readable[character, name] = Clip(body, entry.frames_at(motions.fps))
    reasons = ((broken, "cannot be used"), (foreign, "another rig than the protocol's character"))
    notes = [
        f"{len(names)} file{'s' * (len(names) > 1)} left out, {why}: {some(names, _LISTED)}"
        for names, why in reasons
        if names
    ]
    return readable, notes


def _dropped(counts: Mapping[str, int], why: str) -> list[str]:
    if not counts:
        return []
    pairs, clips = sum(counts.values()), len(counts)
    return [f"{pairs} ordered pairs in {clips} clip{'s' * (clips > 1)} left out {why}"]


def _lengths(clips: Mapping[tuple[str, str], Clip], names: Mapping[str, int]) -> str:
    shown = []
    for name in list(names)[:_LISTED]:
        each = ", ".join(f"{who} {clip.frames}" for (who, what), clip in clips.items() if what == name)
        shown.append(f"{name} ({each} frames)")
    return "; ".join(shown) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
