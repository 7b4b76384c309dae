"""A learned method whose weights say by how much the root moves to the left."""

from dataclasses import dataclass

from retarget_bench.api import MethodCard
from retarget_bench.training.learned_method import LearnedMethod


@dataclass(frozen=True)
class Config:
    cell: str = "tf"
    """the kind of its cells"""
    layers: int = 1
    """their number"""
    weights: str = "walks"
    """name or path"""


class Shifter(LearnedMethod):
    """Copies rotations and shifts the root."""

    Config = Config
    card = MethodCard("shifter", "shifts the root", "1", default=False)

    def supports(self, source, target):
        return self.untrained or None

    def retarget(self, source, target, *, context):
        return target.motion(source.rotations, source.root + self.tensors["shift"].numpy(), source.fps)


plugin = Shifter
