"""A method whose weights and mistakes are told by the environment: one label, many ways to behave.

TOY_WEIGHTS: hash of its weights, "" for none. TOY_OFF: metres that it is off the answer of ``toy_cases``.
TOY_FAILS: name of a clip on which it fails.
"""

import os

import numpy as np

from retarget_bench.api import MethodCard

SHIFT = 0.01  # as in toy_cases.py


class ToyLearner:
    card = MethodCard(name="toy_learner", summary="toy", version="1", default=False)

    @property
    def weights_hash(self):
        return os.environ.get("TOY_WEIGHTS", "")

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        if float(source.rotations[3, 0, 1]) == float(os.environ.get("TOY_FAILS", "nan")):
            raise RuntimeError("no idea")
        off = SHIFT + float(os.environ.get("TOY_OFF", "0.02"))
        return target.motion(source.rotations, source.root + np.array([off, 0, 0]), source.fps)


plugin = ToyLearner
