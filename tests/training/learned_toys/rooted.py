"""A method that trains on root paths in millimetres, of anybody but those it is told not to take."""

import numpy as np

from retarget_bench.api import MethodCard


class Rooted:
    card = MethodCard("rooted", "toy", "1", default=False)

    def __init__(self, without: str = "") -> None:
        self.without = without

    def unfit(self, character):
        return "too shy" if character.name in self.without.split() else ""

    def prepare(self, motion):
        return {"root": np.round(1000 * motion.root), "legs": motion.root[:, 1:2]}

    def retarget(self, source, target, *, context): ...


plugin = Rooted
