"""Data sets: where cases and training data come from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from retarget_bench.api.cases import Case, CaseInfo, TrainingPair
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

SPLITS: Mapping[str, str] = {
    "self": "each character performs its own motion, so that copying is exact",
    "intra": "another character of the same structure performs it",
    "cross": "a character of another structure performs it",
}
"""The usual splits, in order, and what their cases have in common. A data set may have others."""
SELF, INTRA, CROSS = SPLITS


def usual_split(same: bool, alike: bool) -> str:
    """The usual split of a pair. same: of one character; alike: of one structure."""
    return SELF if same else INTRA if alike else CROSS


def usual_splits(*names: str) -> dict[str, str]:
    """The usual splits of these names, for a card."""
    return {name: SPLITS[name] for name in names}


@dataclass(frozen=True)
class DatasetCard:
    """Description of a data set, its licence, and how to get it.

    splits: its splits in the order in which they are shown, and what the cases of each have in common.
    locations: parameters that say where files lie: no part of what results are known by; the content is.
    """

    name: str
    summary: str
    version: str
    licence: str
    obtain: str
    tasks: tuple[str, ...] = ("retarget",)
    splits: Mapping[str, str] = field(default_factory=lambda: SPLITS)
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Parameter name -> one line that says what it does."""
    locations: tuple[str, ...] = ("root",)


@dataclass(frozen=True)
class Unreadable:
    """The files of a data set that cannot be read.

    files:    how many were looked at.
    problems: name of a file -> what is wrong with it.
    """

    files: int
    problems: Mapping[str, str]

    @property
    def sentence(self) -> str:
        listed = [f"{name} ({problem})" for name, problem in self.problems.items()]
        more = f" and {len(listed) - _LISTED} more" if len(listed) > _LISTED else ""
        return f"{len(listed)} of {self.files} files cannot be read: {', '.join(listed[:_LISTED])}{more}"


_LISTED = 5


class TrainingClips(Protocol):
    """Training motions of one character, each made when it is asked for."""

    @property
    def names(self) -> Sequence[str]: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Motion: ...


Cast = Mapping[str, Mapping[str, TrainingClips]]
"""Structure -> character -> its clips."""
Manifest = Mapping[str, Sequence[str]]
"""``characters``, ``structures``, and ``kinds`` or ``clips``: what training had."""


class TrainingPairs(Protocol):
    """Pairs by index, always the same under an index, each made or read when it is asked for.

    together: so many pairs in a row share their motions and are made together; ``bench train --prepare``,
    which makes all beforehand, asks for every ``together``-th.
    """

    @property
    def together(self) -> int: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> TrainingPair: ...


class FrameLabels(Protocol):
    """kind, phase: ``(frames,)``; touches: name -> ``(frames,)`` bool."""

    @property
    def kind(self) -> np.ndarray: ...
    @property
    def phase(self) -> np.ndarray: ...
    @property
    def touches(self) -> Mapping[str, np.ndarray]: ...


class Dataset(ABC):
    """A source of cases. Building one must be quick: files are read when cases are asked for.

    What is not abstract is optional, and stands here with its default.
    """

    card: DatasetCard

    @cached_property
    def content(self) -> str:
        """Identifies the data in keys: a hash of the files, or generator version and parameters. Needed."""
        raise NotImplementedError(f"data set {self.card.name} has no content")

    @cached_property
    def label(self) -> str:
        """What tables call it: ``mixamo``, or ``mixamo san-partial (23 of 106 clips)``."""
        return self.card.name

    @cached_property
    def notes(self) -> Sequence[str]:
        """Sentences that belong under every table of it: what was dropped and why."""
        return ()

    @abstractmethod
    def characters(self) -> Mapping[str, Character]:
        """Its bodies by name."""

    @abstractmethod
    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """A fixed list, in a fixed order."""

    @abstractmethod
    def load(self, info: CaseInfo) -> Case:
        """A case, read now."""

    # ------------------------------------------------------------------------------------- of cases
    real: Callable[[str, str], Sequence[CaseInfo]] | None = None
    """``real(task, structure)``, where there are cases without references and real motion to compare their
    answers with: cases, for ``load``, whose references are the tested part's real motion of bodies of a
    structure, each body and clip once, with the kinds of the cases without references."""

    @cached_property
    def unreadable(self) -> Unreadable | None:
        """The files that cannot be read; None where all can."""
        return None

    def unseen(self, info: CaseInfo) -> Collection[str] | None:  # noqa: ARG002
        """Those of ``source``, ``target`` and ``kind`` of a case that the training part does not have; None
        where that is not known."""
        return None

    def conditions(self, info: CaseInfo) -> Mapping[str, float]:  # noqa: ARG002
        """Conditions of a derived task's case, known without loading it: ``noise``, ``proportion``, ..."""
        return {}

    def labels(self, info: CaseInfo) -> FrameLabels | None:  # noqa: ARG002
        """Labels of every frame of a case, for exports."""
        return None

    def parts(self) -> Mapping[str, Dataset]:
        """The parts that an export writes apart: ``train``, ``validation``, ``test``; all under "" where
        there are none."""
        return {"": self}

    # --------------------------------------------------------------------------------- to be trained on
    def training(self) -> Cast:
        """All clips to train on, whichever part the cases are of; none of them is in a case of the test or
        of ``validation()``. Empty where there is nothing to train on."""
        return {}

    def validation(self) -> Dataset | None:
        """The validation part: cases that share no clip with the test and none with
        ``training()``, best with characters that ``training()`` does not have."""
        return None

    def training_manifest(self) -> Manifest:
        """All that training and its validation have. Weights carry it, so that tables can part what is new
        to them from what is not."""
        return {}

    def training_pairs(self) -> TrainingPairs | None:
        """The same performances by any two training bodies; none is in a case of any part. None: there are
        none with these parameters."""
        return None

    @cached_property
    def training_notes(self) -> Sequence[str]:
        """Sentences about the training part: what was left out and why, or why there is none."""
        return ()


def chosen_splits(data: Dataset, names: Sequence[str]) -> list[str]:
    """The splits asked for, or all, in the order of the data set. Raises BenchError for one that it has
    not."""
    there = data.card.splits
    if unknown := [split for split in names if split not in there]:
        raise BenchError(f"{data.label} has no split {unknown[0]!r}; it has {' and '.join(there)}")
    return [split for split in there if split in names or not names]
