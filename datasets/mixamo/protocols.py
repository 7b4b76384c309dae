"""Which clips and pairs of a Mixamo folder are asked: all, SAN's, or one fold of a cross-validation."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field
from typing import NamedTuple

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
    """How much a protocol asks for, found or not; ``characters`` are the targets."""

    clips: int
    characters: int
    pairs: int


@dataclass(frozen=True)
class Selection:
    """What a protocol asks of a folder.

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
    """What training is steered by: untested clips of one fold, all ordered pairs of who is not held out."""
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
