"""SKR while it is trained: single frames of skinned bodies, resampled every time, and the loss of eq. 1."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.motion import rotation
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.training import weights
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody

from .network import SkeletonRegressor
from .stretching import StretchedBody

RESTING = 0.1
"""Share of rows that show the mesh in its own pose, as targets are seen."""


class SkrTraining:
    """A ``TrainingModule`` (see ``training/contract.py``).

    Every row is a body in a frame of its motion, turned about the vertical at random, of which new points
    are drawn from the surface. Their number is another one in every step, each doubling as likely. Some
    bodies have other proportions than they have anywhere else (``stretching``).
    """

    def __init__(
        self,
        training_data: TrainingData,
        points: tuple[int, int],
        network: SkeletonRegressor,
        stretched: float,
        trained: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        """points: the fewest and most of a row. stretched: the share of rows with other proportions.
        trained: makes the method from exported tensors."""
        self.training_data, self._points, self._trained = training_data, points, trained
        self._stretched = stretched
        self._bodies = {
            name: StretchedBody(SkinnedBody.of(training_data.characters[name]))
            for name in sorted(training_data.clips)
        }
        self.network = network
        self.modules = nn.ModuleDict({"network": network})
        self.phases: Sequence[Phase] = (Phase("network", ("network",), clip=1.0),)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """points: ``(rows, V, 3)`` and joints: ``(rows, 22, 3)`` metres."""
        fewest, most = np.log(self._points)
        count = round(float(np.exp(numbers.uniform(fewest, most))))
        names = self.training_data.cast(numbers, rows)
        frames = self.training_data.draw(numbers, names, 1).arrays
        points, joints = [], []
        for row, name in enumerate(names):
            stretchable = self._bodies[name]
            body = stretchable.body
            turns, shifts = rotation.identity(body.joints), np.zeros((body.joints, 3))
            if numbers.random() >= RESTING:
                turns, shifts = (frames[key][row, 0, : body.joints] for key in ("turns", "shifts"))
            other = numbers.random() < self._stretched
            stretch = stretchable.drawn(numbers) if other else stretchable.unchanged
            vertices, places = stretchable.posed(stretch, turns, shifts)
            drawn = sampled(vertices[None], body.faces, numbers.random((1, 3, count)))[0]
            turn = _yaw(numbers.uniform(0.0, 2.0 * np.pi))
            points.append(drawn @ turn)
            joints.append(places @ turn)
        return {"points": np.stack(points).astype("f4"), "joints": np.stack(joints).astype("f4")}

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        """Eq. 1: the mean squared error of joints, in units of the points (``network.Frame``)."""
        with torch.autocast(batch["points"].device.type, enabled=False):
            frame = self.network.frame(batch["points"])
            points, joints = frame.into(batch["points"]), frame.into(batch["joints"])
        return {"joints": (self.network.estimate(points) - joints).square().mean()}

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._trained(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        weights.fill(self.network, tensors)


def _yaw(angle: float) -> np.ndarray:
    """``(3, 3)``: rows of points times this are turned about the vertical."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
