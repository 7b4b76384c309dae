"""Parameters of NKN."""

from dataclasses import dataclass
from typing import Literal

from retarget_bench.errors import BenchError
from retarget_bench.training.layers.kinematic.retargeter import SightConfig

from .network.cells import Kind

Losses = Literal["autoencoder", "cycle", "adversarial"]


@dataclass(frozen=True)
class NknConfig(SightConfig):
    """Raises BenchError where a number is out of range."""

    cell: Kind = "tf"
    """the GRU: tf (one bias per gate, reset before the product) or torch"""
    hidden: int = 512
    """width of the GRU layers"""
    losses: Losses = "adversarial"
    """training terms: autoencoder, cycle or adversarial (all)"""
    same: float = 0.2
    """share of training rows whose target is the source itself"""
    drift: float = 0.05
    """weight of errors of movements summed up over time (the paper: 0)"""

    def __post_init__(self) -> None:
        if self.hidden < 1 or not 0.0 <= self.same <= 1.0 or min(self.facing, self.drift) < 0.0:
            raise BenchError(
                "hidden is at least 1, same between 0 and 1; facing and drift are not negative"
            )
