"""SKIN while it is trained: points of bodies in T-pose and where they are in other frames."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.skinning_torch import skinned
from retarget_bench.training import weights
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody

from .network import SkinningPredictor, size
from .posing import transforms_of

FRAMES, POINTS = 4, 256
"""Of a row: frames that its points are seen in, and points."""

Skeletons = Callable[[SkinnedBody], np.ndarray]
"""A body -> ``(estimates, 22, 3)`` metres: its joints in T-pose as they are known."""


class SkinTraining:
    """A ``TrainingModule`` (see ``training/contract.py``).

    A row is a body with points on its surface, each by the corners of its triangle, which tells where the
    point is in T-pose and in each frame. The joints are the estimated ones, the rotations true.
    """

    def __init__(
        self,
        training_data: TrainingData,
        skeletons: Skeletons,
        network: SkinningPredictor,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """trained: makes the method from exported tensors."""
        self.training_data, self._trained = training_data, trained
        self._bodies: dict[str, SkinnedBody] = {}
        self._joints: dict[str, tuple[np.ndarray, list[int]]] = {}
        for name in sorted(training_data.clips):
            character = training_data.characters[name]
            body = SkinnedBody.of(character)
            self._bodies[name] = body
            self._joints[name] = skeletons(body), list(Body22.of(character).joints)
        self.network = network
        self.modules = nn.ModuleDict({"network": network})
        self.phases: Sequence[Phase] = (Phase("network", ("network",), clip=1.0),)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """points: ``(rows, P, 3)`` in T-pose, joints: ``(rows, 22, 3)`` likewise; of the frames moved:
        ``(rows, F, P, 3)``, matrices: ``(rows, F, 22, 3, 3)`` and shifts: ``(rows, F, 22, 3)``; metres."""
        names = self.training_data.cast(numbers, rows)
        every = [name for name in names for _ in range(FRAMES)]
        frames = self.training_data.draw(numbers, every, 1).arrays
        drawn = [
            self._row(numbers, name, {key: array[at : at + FRAMES, 0] for key, array in frames.items()})
            for name, at in zip(names, range(0, len(every), FRAMES), strict=True)
        ]
        return {key: np.stack([each[key] for each in drawn]).astype("f4") for key in drawn[0]}

    def _row(
        self, numbers: np.random.Generator, name: str, frames: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        body, (estimates, ranks) = self._bodies[name], self._joints[name]
        turns, shifts = (frames[key][:, : body.joints] for key in ("turns", "shifts"))
        places = [body.vertices[:, :3], *(body.posed(*each) for each in zip(turns, shifts, strict=True))]
        points = on_surface(np.stack(places), body.faces, numbers)
        joints = estimates[numbers.integers(len(estimates))]
        matrices = rotation.to_matrix(turns[:, ranks].astype(np.float64))
        # where the true hips go decides where the estimated ones go with them
        moved = transforms_of(joints, matrices, -np.einsum("fab,b->fa", matrices[:, 0], body.resting[0]))
        return {
            "points": points[0],
            "joints": joints,
            "moved": points[1:],
            "matrices": matrices,
            "shifts": moved,
        }

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        """The mean distance of points from where they should be, unsquared, in sizes of the skeleton."""
        shares = self.network(batch["points"], batch["joints"])
        moved = skinned(batch["points"], shares, batch["matrices"], batch["shifts"])
        apart = torch.linalg.vector_norm(moved - batch["moved"], dim=-1)
        return {"points": (apart / size(batch["joints"])[:, None, None]).mean()}

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.network, tensors)


def on_surface(places: np.ndarray, faces: np.ndarray, numbers: np.random.Generator) -> np.ndarray:
    """``(poses, P, 3)``: the same points of a surface in poses ``(poses, V, 3)``, uniform by area in the
    first."""
    a, b, c = (places[0][faces[:, corner]] for corner in range(3))
    total = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    chosen = np.searchsorted(total, numbers.random(POINTS) * total[-1], side="right")
    corners = faces[np.minimum(chosen, len(faces) - 1)]
    root, way = np.sqrt(numbers.random(POINTS)), numbers.random(POINTS)
    shares = np.stack([1.0 - root, root * (1.0 - way), root * way], -1)
    points: np.ndarray = np.einsum("npca,pc->npa", places[:, corners], shares)
    return points
