"""Makes up joints that are not given by ridge regression on the data set's training poses."""

import numpy as np

from retarget_bench.api import Method, MethodCard
from retarget_bench.errors import BenchError
from retarget_bench.motion import completion

_NOTHING = 1e-12
"""Of a variance, lest joints that never move make the equations singular."""


class LinearJoints(completion.Completer, Method):
    """The best linear map from the joints that are given to the others, frame by frame.

    It is fitted for every body and set of joints, in a frame that moves and turns with the given joints, on
    poses of that very body: the training motion's rotations copied to it. Joints that are given stay.

    ridge: penalty, as a share of the mean variance of a coordinate; larger ones trust the mean pose more.
    poses: how many it is fitted on, evenly over the training clips.
    """

    def __init__(self, ridge: float = 1e-3, poses: int = 4000) -> None:
        if not 0.0 < ridge <= 1e6:
            raise BenchError(f"linear_joints: ridge is above 0 and at most 1e6; got {ridge:g}")
        if poses < 1:
            raise BenchError(f"linear_joints: poses is one or more; got {poses}")
        super().__init__(lambda examples: regression(examples, ridge), poses)
        self.card = MethodCard(
            name="linear_joints",
            summary="Missing joints by linear regression on the training poses, given joints kept",
            version="1",
            accepts=("motion", "positions"),
            uses=("training",),
            tasks=("joint-completion",),
            parameters={
                "ridge": "penalty of the regression, as a share of the mean variance of a coordinate",
                "poses": "how many training poses it is fitted on",
            },
        )


def regression(examples: completion.Examples, ridge: float) -> completion.Fitted:
    """The linear map, with a constant, of least squared error and a penalty on its weights (see above)."""
    inputs = examples.inputs.reshape(len(examples.inputs), -1)
    outputs = examples.outputs.reshape(len(examples.outputs), -1)
    middle, mean = inputs.mean(axis=0), outputs.mean(axis=0)
    centred = inputs - middle
    gram = centred.T @ centred
    penalty = ridge * max(float(np.trace(gram)) / len(gram), _NOTHING)
    weights = np.linalg.solve(gram + penalty * np.eye(len(gram)), centred.T @ (outputs - mean))

    def fitted(new: np.ndarray) -> np.ndarray:
        answers = (new.reshape(len(new), -1) - middle) @ weights + mean
        return answers.reshape(len(new), -1, 3)

    return fitted


plugin = LinearJoints
