"""Parameters of SMRM (Marsot, Rekik et al., Correspondence-free online human motion retargeting, 2023)."""

from dataclasses import dataclass
from typing import Literal

from retarget_bench.errors import BenchError
from retarget_bench.motion import root_rules
from retarget_bench.training import variants

from .features import Normalisation, Root, Yaw

Reference = Literal["truth", "self"]
Variant = Literal["own", "paper"]


@dataclass(frozen=True)
class Weighting:
    """adversarial: weight of that term. same: share of rows whose target is their own character."""

    adversarial: float
    same: float


VARIANTS = variants.beside(__file__, Weighting)


@dataclass(frozen=True)
class SmrmConfig:
    """Raises BenchError for what cannot be."""

    variant: Variant = "own"
    """weights of the losses and share of rows to their own body: own, or paper (eq. 2 as printed)"""
    path: root_rules.PathKind = "relative"
    """integrated (moves summed up) or relative (the source's, scaled; what differs fades)"""
    normalisation: Normalisation = "body"
    """deviations of lengths in hip heights (body) or metres (global) are seen; none: metres as they are"""
    root: Root = "height"
    """what is seen of the hips: height (and level steps), displacement, position"""
    yaw: Yaw = "removed"
    """directions seen from where the character faces (removed) or the world's (kept)"""
    context: int = 30
    """frames of a training window"""
    adversarial: float | None = None
    """weight of the adversarial term (eq. 2: 1); as the variant where it is not given"""
    rotation_cycle: float = 0.01
    """weight of the rotations' cycle loss (0: without)"""
    smooth: float = 0.001
    """weight of the mean acceleration of the hips"""
    reference_rotation: Reference = "truth"
    """rotations that come back are compared with the clip's (truth) or its answer on its own body (self)"""
    same: float | None = None
    """share of training rows whose target is their own character; as the variant where it is not given"""
    noise: float = 0.0
    """deviation of the source's joints in training from the true ones, in the unit of lengths (0: none)"""
    hidden: int = 512
    """numbers of a GRU's state"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""

    def __post_init__(self) -> None:
        if self.context < 2 or self.hidden < 1:
            raise BenchError("smrm needs a context of two frames or more, and at least one hidden number")
        weights = (self.adversarial or 0.0, self.rotation_cycle, self.smooth)
        if min(weights) < 0 or not 0 <= (self.same or 0.0) <= 1:
            raise BenchError("weights of smrm's losses cannot be negative, and same is a share from 0 to 1")
        if not 0.0 <= self.noise < 1.0:
            raise BenchError("smrm: noise is from 0 to below 1, in the unit of lengths")

    @property
    def adversarial_weight(self) -> float:
        """As it is given, or as the variant has it."""
        return VARIANTS[self.variant].adversarial if self.adversarial is None else self.adversarial

    @property
    def same_share(self) -> float:
        """As it is given, or as the variant has it."""
        return VARIANTS[self.variant].same if self.same is None else self.same
