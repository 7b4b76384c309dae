"""A learned method whose weights say by how much the root moves to the left."""

from retarget_bench.api import MethodCard
from retarget_bench.training.learned_method import LearnedMethod


class Shifter(LearnedMethod):
    """Copies rotations and shifts the root."""

    card = MethodCard("shifter", "shifts the root", "1", default=False)

    def __init__(self, cell: str = "tf", layers: int = 1, weights: str = "walks") -> None:
        super().__init__(weights)
        self.cell, self.layers = cell, layers

    def facts(self):
        return {"cell": self.cell, "layers": self.layers}

    def supports(self, source, target):
        return self.untrained or None

    def retarget(self, source, target, *, context):
        return target.motion(source.rotations, source.root + self.tensors["shift"].numpy(), source.fps)


plugin = Shifter
