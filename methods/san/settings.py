"""SAN's parameters, and the features, networks and losses that its variants (``variants.toml``) choose."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training import variants
from retarget_bench.training.layers.skeletal.features import Features, Lengths, Path, Root
from retarget_bench.training.layers.trained_structures import TWO_LEGGED

from .network import Design
from .skeleton import Neighbours

Variant = Literal["own", "released"]
Statistics = Literal["structure", "character"]
Heights = Literal["given", "learnt"]


@dataclass(frozen=True)
class SanConfig:
    """Parameters of SAN; the variant decides those that are None."""

    variant: Variant = "own"
    """own, or released (as the authors' code)"""
    structures: str = TWO_LEGGED
    """trained on: two_legged, all, or names joined by +"""
    path: Path | None = None
    """of the root: decoded, relative (to the source's; what differs fades) or carried (the source's plus
    what is decoded)"""
    tips: Literal["copied", "rest"] = "copied"
    """ends of chains: copied or rest"""
    target_stats: Literal["transferred", "own"] = "transferred"
    """by character: transferred, or own (of the target's reference motions: privileged)"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others, also to the authors' folder"""
    neighbours: Neighbours | None = None
    """of the root's slot: fixed, or released (with its known mistake)"""
    root: Root | None = None
    """the root's channels: velocity, height (velocity, but height), position"""
    lengths: Lengths | None = None
    """world (centimetres) or body (hip heights)"""
    statistics: Statistics | None = None
    """mean and deviation by structure or by character"""
    heights: Heights = "given"
    """that end effectors are compared in: given, or learnt"""
    positions: float | None = None
    """weight of joint positions in the reconstruction"""
    cycle: float | None = None
    """weight of the distance of codes"""
    ends: float | None = None
    """weight of end effectors' movement"""
    adversarial: float | None = None
    """weight of the adversarial loss"""


DIFFERS = {
    "neighbours": "root's slot mended",
    "lengths": "in hip heights",
    "root": "height as a feature",
    "path": "the source's path and direction",
    "statistics": "statistics by structure",
    "positions": "positions weigh more",
}
"""Parameter -> how ``own`` differs from what is published."""

FIELDS: Mapping[str, tuple[str, ...]] = {
    "features": ("root", "lengths", "path"),
    "design": ("neighbours",),
    "weights": ("positions", "cycle", "ends", "adversarial"),
    "": ("statistics", "heights"),
}
"""The parameters that are fields of each part of ``Settings`` ("": of the settings themselves)."""


@dataclass(frozen=True)
class Weights:
    """Weights of the loss terms. Terms are means over everything, added up over structures and pairs.

    reconstruction: squared error of normalised channels, and in it root: of the root's place, and
    positions: of joints relative to it, both in heights. cycle: absolute difference of the codes of source
    and answer (latent consistency). ends: difference of how end effectors move. adversarial: least squares.
    """

    reconstruction: float = 5.0
    root: float = 250.0
    positions: float = 100.0
    cycle: float = 2.5
    ends: float = 50.0
    adversarial: float = 1.0


@dataclass(frozen=True)
class Settings:
    """All settings of a variant.

    statistics: whether mean and deviation are by structure or by character; deviations are
    ``least_deviation`` or more. rerooted: trees begin where the legs do (``skeletal/tree.py``). heights:
    that the movement of end effectors is compared in: of the bodies, or numbers that start there and are
    learnt.
    shared: structures have the same initial weights for what they have in common.
    """

    features: Features
    statistics: Statistics
    design: Design = field(default_factory=Design)
    weights: Weights = Weights()
    rerooted: bool = False
    heights: Heights = "given"
    least_deviation: float = 0.0
    shared: bool = False

    def overridden(self, config: SanConfig) -> Self:
        """With the parameters that are given. Raises BenchError where a number is out of range."""
        values = {name: getattr(config, name) for names in FIELDS.values() for name in names}
        chosen = {name: value for name, value in values.items() if value is not None}
        if not all(0.0 <= chosen.get(name, 0.0) < math.inf for name in FIELDS["weights"]):
            raise BenchError("weights of san's losses are finite numbers, zero or more")
        parts = {part: {k: chosen[k] for k in names if k in chosen} for part, names in FIELDS.items()}
        features = replace(self.features, **parts["features"])
        return replace(
            self,
            features=features,
            design=replace(self.design, **parts["design"], padded=features.root == "position"),
            weights=replace(self.weights, **parts["weights"]),
            **parts[""],
        )

    def values(self) -> dict[str, Scalar]:
        """The parameters that weights depend on, by their names."""
        values = {
            name: getattr(getattr(self, part) if part else self, name)
            for part, names in FIELDS.items()
            for name in names
        }
        if values["path"] == "relative":  # networks learn the same
            values["path"] = "decoded"
        return values


VARIANTS = variants.beside(__file__, Settings)
