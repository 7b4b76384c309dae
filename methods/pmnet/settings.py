"""Parameters of PMnet."""

from dataclasses import dataclass

from retarget_bench.errors import BenchError
from retarget_bench.training.layers.kinematic.retargeter import SightConfig


@dataclass(frozen=True)
class PmnetConfig(SightConfig):
    """Raises BenchError where a number is out of range."""

    hidden: int = 512
    """width of the networks of poses"""
    same: float = 0.5
    """share of training rows whose target is the source itself"""

    def __post_init__(self) -> None:
        if self.hidden < 1 or not 0.0 <= self.same <= 1.0 or self.facing < 0.0:
            raise BenchError("hidden is at least 1, same between 0 and 1; facing is not negative")
