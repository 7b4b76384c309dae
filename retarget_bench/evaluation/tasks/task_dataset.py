"""What the data sets of all tasks take over from the data set that they are made from."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

from retarget_bench.api import Dataset, optional
from retarget_bench.api.datasets import Cast
from retarget_bench.motion.character import Character
from retarget_bench.plugins.spec import Spec


class TaskDataset:
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

    def characters(self) -> Mapping[str, Character]:
        return self._data.characters()

    def training(self) -> Cast:
        """The training part of the data set."""
        return optional.training(self._data)

    def training_manifest(self) -> Mapping[str, Sequence[str]]:
        return optional.data_manifest(self._data)
