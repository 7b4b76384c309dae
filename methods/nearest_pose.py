"""Makes up joints that are not given from the training poses whose given joints lie nearest."""

import numpy as np

from retarget_bench.api import Method, MethodCard
from retarget_bench.errors import BenchError
from retarget_bench.motion import completion

_NEAR = 1e-3
"""Metres: neighbours nearer than this count alike."""
_ENOUGH = 200
"""Poses that decide which given joint a missing one is close to."""


class NearestPose(completion.Completer, Method):
    """The mean of the nearest training poses, frame by frame, the nearer the weightier.

    Poses are of that very body (the training motion's rotations copied to it) and are compared in a frame
    that moves and turns with the given joints. A missing joint is placed from the given joint that it is
    closest to on average, as far off as in the neighbours. Joints that are given stay.

    neighbours: how many poses are averaged. poses: how many there are, evenly over the training clips.
    """

    def __init__(self, neighbours: int = 16, poses: int = 4000) -> None:
        for name, number in (("neighbours", neighbours), ("poses", poses)):
            if number < 1:
                raise BenchError(f"nearest_pose: {name} is one or more; got {number}")
        self.neighbours = neighbours
        super().__init__(self._nearest, poses)
        self.card = MethodCard(
            name="nearest_pose",
            summary="Missing joints from the training poses that are nearest, given joints kept",
            version="1",
            accepts=("motion", "positions"),
            uses=("training",),
            tasks=("joint-completion",),
            parameters={
                "neighbours": "how many training poses are averaged",
                "poses": "how many training poses there are to choose from",
            },
        )

    def _nearest(self, examples: completion.Examples) -> completion.Fitted:
        from scipy.spatial import cKDTree  # type: ignore[import-untyped]

        tree = cKDTree(examples.inputs.reshape(len(examples.inputs), -1))
        count = min(self.neighbours, len(examples.inputs))
        few = slice(None, None, max(1, len(examples.inputs) // _ENOUGH))
        apart = examples.outputs[few, :, None] - examples.inputs[few, None]
        anchor = np.linalg.norm(apart, axis=-1).mean(axis=0).argmin(axis=1)  # per missing joint
        steps = examples.outputs - examples.inputs[:, anchor]

        def fitted(inputs: np.ndarray) -> np.ndarray:
            far, which = tree.query(inputs.reshape(len(inputs), -1), k=list(range(1, count + 1)))
            weights = 1.0 / np.maximum(far, _NEAR)
            weights /= weights.sum(axis=1, keepdims=True)
            return np.asarray(inputs[:, anchor] + np.einsum("fk,fkjc->fjc", weights, steps[which]))

        return fitted


plugin = NearestPose
