"""R2ET, its skeleton-aware part: copied rotations, changed as two skeletons ask; learned without pairs."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training import weights
from retarget_bench.training.authors import AuthorsWeights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from . import features, released
from .inference import retargeted
from .network import SkeletonAwareNetwork
from .training import R2ETTraining

DEFAULT = TrainingConfig(
    steps=12_000,
    batch=16,
    window=24,
    rate=1e-3,
    schedule="cosine",
    warm_up=100,
    validate=500,
    average=0.999,
)


@dataclass(frozen=True)
class R2etConfig:
    """Raises BenchError where a number is out of range."""

    size: features.Size = "hip_height"
    """whose ratio scales the path: hip_height, chain of bones, or published"""
    dropout: float = 0.0
    """share of numbers dropped in training (the paper: 0.2)"""
    facing: float = 20.0
    """frames of 1/30 s over which the direction that a body faces is averaged"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others, also to the authors' .pt"""

    def __post_init__(self) -> None:
        if self.facing < 0 or not 0 <= self.dropout < 1:
            raise BenchError("facing of r2et is not negative, and dropout a share from 0 to below 1")


class R2ET(LearnedMethod):
    """Skinned motion retargeting with residual perception of motion semantics and geometry (Zhang et al.,
    CVPR 2023): its skeleton-aware network.

    Rotations of 22 joints are copied and changed by a network that sees a frame's rotations and the bones
    of both bodies. It learns without pairs: a body's own motion stays as it is, and on another body the
    distances between all joints keep their shares of the sum of each joint's distances (the semantics
    matrix). The path is the source's, scaled. The paper's second part, which moves limbs out of the
    surface of the body, is missing: it needs a differentiable signed distance from a mesh.

    The paper's network knows one set of joints. Ours also answers for bodies that lack a spine joint, the
    neck, a collar bone or a toe: in its place it sees a joint of no length, which does not turn. Head, toes
    and hands turn as the source's, as where the authors write files.

    weights: also the authors' ``skeleton_aware_pre.pt``, see docs/methods.md.
    size: whose ratio scales the path: ``hip_height``, ours, keeps feet on the floor.
    dropout: the paper's takes a third of a training step, and short training does not overfit without it.
    facing: the authors average over so many frames at any rate, here they are of 1/30 s.
    """

    Config = R2etConfig
    config: R2etConfig
    over_roles = True
    answering = ("size",)
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        "paper": TrainingConfig(steps=30 * 1952 // 32, batch=32, window=60, rate=1e-3, schedule="cosine"),
        "default": DEFAULT,
    }
    """The paper's rate falls to a tenth after two thirds of its 30 epochs of 1952 clips, not smoothly."""

    card = MethodCard(
        name="r2et",
        title="R2ET",
        summary="Copied rotations changed by attention over joints and both skeletons; without the part "
        "that sees the body's surface",
        version="1",
        paper="Zhang, Weng, Kang, Zhao, Huang, Zhe, Bao, Shan, Wang, Tu: Skinned Motion Retargeting with "
        "Residual Perception of Motion Semantics & Geometry, CVPR 2023",
        authors_weights="skeleton_aware_pre.pt of github.com/Kebii/R2ET; weights=that file",
        published=({"dropout": 0.2, "size": "chain"}, {"dropout": 0.2, "size": "published"}),
        differs={"dropout": "no dropout", "size": "path scaled by hip heights"},
    )

    @property
    def root_rule(self) -> str:
        """The rule that paths follow, or whose size they are scaled by."""
        return "hip_height" if self.config.size == "hip_height" else f"size={self.config.size}"

    # -------------------------------------------------------------------------------------- training
    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:
        return released.at(path)

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        """``rotations`` ``(frames, 22, 4)`` and ``positions`` ``(frames, 22, 3)`` centimetres as the losses
        see them, ``hips`` ``(frames, 3)`` centimetres in the world, ``turn`` ``(frames, 2)`` where the body
        faces, the parts of a unit complex number."""
        return features.see(motion, self.config.facing)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> R2ETTraining:
        return R2ETTraining(
            training_data,
            config,
            SkeletonAwareNetwork(self.config.dropout),
            self.using,
        )

    # ----------------------------------------------------------------------------------- retargeting
    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("r2et needs a source with rotations, not positions only")
        return retargeted(
            self._network.to(context.device), source, target, self.config.facing, self.config.size
        )

    @cached_property
    def _network(self) -> SkeletonAwareNetwork:
        network = SkeletonAwareNetwork()
        weights.fill(network, self.tensors, f"{self._at or 'weights'}")
        return network.eval()


plugin = R2ET
