"""The task ``points``: the source is known by points on its surface, in no order, without a skeleton."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from retarget_bench.api import TASKS, Case, CaseInfo, Dataset
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.tasks.derived import TaskDataset
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.motion.surface_sampling import sampled, uniform
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import case_seed

NAME = "points"
COUNT = 2048
"""Points of every frame."""


class PointsTask(TaskDataset):
    """The cases of a data set whose bodies have meshes, with points in the place of the source.

    Source: ``COUNT`` points of every frame, drawn anew in each, uniform by area on the skin of the moving
    source. Target, reference, contacts, touches and floor are those of the data set's case; the target has
    its mesh. The motion that the points are of is privileged (``source_motion``).
    """

    version = "1"

    def __init__(self, data: Dataset) -> None:
        super().__init__(data, Spec(NAME))

    @property
    def notes(self) -> Sequence[str]:
        if self._total == (listed := sum(map(len, self._listed.values()))):
            return super().notes
        left = f"{self._total - listed} of {self._total} cases are of bodies without meshes and left out"
        return (*super().notes, left)

    def unseen(self, info: CaseInfo) -> Collection[str] | None:
        """That of the data set's case."""
        return self._data.unseen(replace(info, task=TASKS[0]))

    def cases(self, task: str, split: str) -> Sequence[CaseInfo]:
        """Raises NotSupported for another task or split."""
        if task != NAME or split not in self.card.splits:
            splits = ", ".join(self.card.splits)
            raise NotSupported(f"{self.label} has the task {NAME} and the splits {splits} alone")
        return list(self._listed[split].values())

    def load(self, info: CaseInfo) -> Case:
        """Raises BenchError for a case that is none of this task."""
        if info.id not in self._listed.get(info.split, {}):
            raise BenchError(f"{self.label} has no case {info.id}")
        case = self._data.load(replace(info, task=TASKS[0]))
        moved = case.source
        if not isinstance(moved, Motion) or moved.character.mesh is None:
            raise BenchError(f"{info.id}: points can be drawn where rotations and a mesh are known only")
        return replace(case, info=info, source=points_of(moved, info.id), source_motion=moved)

    @cached_property
    def _listed(self) -> Mapping[str, Mapping[str, CaseInfo]]:
        """Split -> case id -> case, of bodies with meshes."""
        skinned = {name for name, body in self.characters().items() if body.skin is not None}
        return {
            split: {
                each.id: replace(each, task=NAME)
                for each in self._data.cases(TASKS[0], split)
                if each.source in skinned and each.target in skinned
            }
            for split in self.card.splits
        }

    @cached_property
    def _total(self) -> int:
        return sum(len(self._data.cases(TASKS[0], split)) for split in self.card.splits)


def points_of(motion: Motion, case_id: str) -> PointSets:
    """Points on the skin of a moving body with a mesh, in single precision; the same for one case id."""
    mesh = motion.character.mesh
    assert mesh is not None
    numbers = uniform(case_seed(0, NAME, case_id), motion.frames * 3 * COUNT)
    drawn = sampled(mesh.skinned(motion), mesh.faces, numbers.reshape(motion.frames, 3, COUNT))
    body = unknown_body(motion.character.name)
    return PointSets(body, tuple(drawn.astype(np.float32)), motion.fps)
