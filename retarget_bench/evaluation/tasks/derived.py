"""The cases of a derived task, from the motions that a data set has."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from retarget_bench.api import SELF, TASKS, Case, CaseInfo, Dataset, Unreadable
from retarget_bench.api.datasets import Cast, usual_splits
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.tasks.definitions import QUESTIONS, Level, TaskQuestion
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import PointSets
from retarget_bench.plugins.spec import Spec

SPLIT = SELF
"""Source and target are the same body, so all cases are of this split."""


class TaskDataset(Dataset):
    """A data set of a task, out of one that knows nothing of tasks: the same bodies and training part.

    splits: None: those of the data set.
    """

    version: ClassVar[str]
    """Moves when any case of the task does."""

    def __init__(self, data: Dataset, task: Spec, splits: Mapping[str, str] | None = None) -> None:
        self._data, self.task = data, task
        self.card = replace(data.card, tasks=(task.name,), splits=splits or data.card.splits)

    @property
    def content(self) -> str:
        return f"{self._data.content}; {self.task} {self.version}"

    @property
    def label(self) -> str:
        return f"{self._data.label.strip()}: {self.task}"

    @property
    def notes(self) -> Sequence[str]:
        return self._data.notes

    @property
    def unreadable(self) -> Unreadable | None:
        return self._data.unreadable

    def characters(self) -> Mapping[str, Character]:
        return self._data.characters()

    def training(self) -> Cast:
        """The training part of the data set."""
        return self._data.training()

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        return self._data.training_manifest()


class Derived(TaskDataset):
    """A data set of a task, out of one that knows nothing of tasks.

    Clean motions are the references of its self cases; where it has none, the sources of all its cases.
    Every clean motion is asked at every level. The cases' ids are those of the motions, with the level.
    Raises BenchError for a bad level.
    """

    version = "1"
    """Moves when any case does: how noise is made, which joints are drawn, the usual levels."""

    def __init__(self, data: Dataset, task: Spec) -> None:
        super().__init__(data, task, usual_splits(SPLIT))
        question = QUESTIONS[task.name]
        self.question: TaskQuestion = question(str(task.parameters.get("levels", question.LEVELS)))
        most = task.parameters.get("motions", 0)
        if isinstance(most, bool) or not isinstance(most, int) or most < 0:
            raise BenchError(f"motions is a whole number, 0 for all; got {most}")
        self._most = most

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Raises NotSupported for another task or split."""
        if task != self.task.name or split != SPLIT:
            raise NotSupported(f"{self.label} has the task {self.task.name} and the split {SPLIT} alone")
        return self._infos

    def unseen(self, info: CaseInfo) -> Collection[str] | None:
        """That of the case that it is made of."""
        return self._data.unseen(self._listed[info.id][0])

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this task."""
        if info.id not in self._listed:
            raise BenchError(f"{self.label} has no case {info.id}")
        motion, level = self._listed[info.id]
        case = self._data.load(motion)
        own = motion.source == motion.target
        clean = case.reference if own and case.reference is not None else case.source
        if isinstance(clean, PointSets):
            raise NotSupported(f"{motion.id}: the motion is known by points only")
        source, reference = self.question.ask(clean, level, info.id)
        labels = {"contacts": case.contacts, "ground": case.ground, "touches": case.touches} if own else {}
        return Case(
            info=info,
            source=source,
            target=reference.character,
            reference=reference,
            conditions=self.conditions(info),
            **labels,  # type: ignore[arg-type]
        )

    def conditions(self, info: CaseInfo) -> Mapping[str, float]:
        """The conditions of a case as numbers, without loading the motion."""
        level = self._listed[info.id][1]
        return self.question.conditions(self.characters()[info.target], level) or {}

    # ----------------------------------------------------------------------------------------- lists
    @cached_property
    def _infos(self) -> Sequence[CaseInfo]:
        task = self.task.name
        return [
            replace(motion, id=case_id, task=task, split=SPLIT, target=motion.source)
            for case_id, (motion, _) in self._listed.items()
        ]

    @cached_property
    def _listed(self) -> Mapping[str, tuple[CaseInfo, Level]]:
        """Case id -> the data set's own case that its motion is from, and the level."""
        cast = self.characters()
        return {
            "/".join(filter(None, (_own_id(motion), level.suffix))): (motion, level)
            for motion in _spread(self._motions(), self._most, cast)
            for level in self.question.levels
            if self.question.conditions(cast[motion.source], level) is not None
        }

    def _motions(self) -> Sequence[CaseInfo]:
        """The data set's own cases that clean motions are taken from, each motion once."""
        task, splits = TASKS[0], self._data.card.splits
        if SPLIT in splits and (own := self._data.cases(task, SPLIT)):
            return own
        motions: dict[str, CaseInfo] = {}
        for split in splits:
            for info in self._data.cases(task, split):
                motions.setdefault(_own_id(info), info)
        return list(motions.values())


def _own_id(info: CaseInfo) -> str:
    """The id that a motion's self case has, or would have."""
    if info.source == info.target:
        return info.id
    return f"{info.id.split('/')[0]}/{info.source}>{info.source}/{info.clip}"


def _spread(motions: Sequence[CaseInfo], most: int, cast: Mapping[str, Character]) -> Sequence[CaseInfo]:
    """At most so many (0: all), evenly over structures, bodies and clips, in their own order."""
    if not 0 < most < len(motions):
        return motions
    keys = [(cast[each.source].structure, each.source, each.clip) for each in motions]
    alike = sorted(range(len(motions)), key=keys.__getitem__)
    chosen = np.linspace(0, len(alike) - 1, most).round().astype(int)
    return [motions[number] for number in sorted({alike[at] for at in chosen.tolist()})]
