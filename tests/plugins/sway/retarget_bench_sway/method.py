"""Copies the pose and lets the hips sway from side to side."""

from types import SimpleNamespace

import numpy as np

from retarget_bench.motion import transfer


class Sway:
    """Nothing of the engine is inherited: the attributes and methods are the whole contract."""

    card = SimpleNamespace(
        name="sway",
        summary="The copied pose on hips that sway",
        version="4",
        accepts=("motion",),
        needs=(),
        stochastic=False,
        parameters={"width": "how far the hips go, in metres"},
    )

    def __init__(self, width=0.05):
        self.width = width

    def supports(self, source, target):
        return transfer.reason(source, target)

    def retarget(self, source, target, *, context):
        copied = transfer.carry(source, target, "hip_height")
        root = copied.root.copy()
        root[:, 0] += self.width * np.sin(np.arange(len(root)) / source.fps)
        return target.motion(copied.rotations, root, source.fps)


plugin = Sway
