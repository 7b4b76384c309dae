"""NPT, neural pose transfer: vertices of the target moved into the pose of unordered points."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.api import Context, MethodCard
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, PointSets, Surface
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skinned_body import moves
from retarget_bench.training.learned_method import LearnedMethod

from .inference import retargeted
from .network import Pooling, PoseTransfer
from .surfaces import on_mesh
from .training import NptTraining


@dataclass(frozen=True)
class NptConfig:
    """Raises BenchError for what cannot be."""

    pooling: Pooling = "max"
    """how features of points get to vertices: none (as published), or max"""
    width: int = 128
    """features of a point (as published 1024)"""
    points: int = 256
    """points of a body in a row of a training batch"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""

    def __post_init__(self) -> None:
        if self.pooling not in ("none", "max"):
            raise BenchError(f"npt: pooling is none or max, and not {self.pooling!r}")
        if self.width < 1 or self.points < 2:
            raise BenchError("npt needs a width of one or more, and at least two points")


class NPT(LearnedMethod):
    """Neural Pose Transfer (Wang et al., CVPR 2020), rewritten from its paper.

    Point-wise layers see the points of a posed body, in any order; a decoder of residual blocks turns their
    features into the vertices of the target in that pose. Its normalisations (SPAdaIN) are steered by the
    target's vertices at rest. Frames are independent of each other.

    pooling: ``none``, as published, needs as many points as the target has vertices, since feature k goes
        to vertex k; of other numbers of points so many are drawn. ``max`` is the variant of the authors'
        code for meshes of different size, in which all vertices get the largest feature.
    width: of the features. As published it is 1024 (6,054,941 parameters), too wide to train on a core.
    points: of each body in a row of a training batch (published: all 6,890).

    What the paper leaves out is ours: targets are brought to one stature, since puppets are 1 to 2.6 m
    tall; the network answers around the middle of the body, and the source's path is added to it, times the
    ratio of the bodies' sizes (``motion/scan_path.py``). The target at rest is in the T-pose.
    """

    Config = NptConfig
    config: NptConfig
    from_pairs = True
    card = MethodCard(
        name="npt",
        title="NPT",
        summary="Neural pose transfer: the target's vertices in the pose of unordered points",
        version="1",
        paper="Wang et al., Neural Pose Transfer by Spatially Adaptive Instance Normalization, CVPR 2020",
        published=({"pooling": "none", "width": 1024},),
        differs={"pooling": "features pooled over the points", "width": "128 features instead of 1024"},
        accepts=("points", "motion"),
        tasks=("points",),
        stochastic=True,
    )

    @property
    def presets(self) -> Mapping[str, TrainingConfig]:
        """Frames are single, so few a second are enough. ``paper``: as the published code, which takes
        4,000 pairs for an epoch, eight to a batch, and 1,000 epochs."""
        default = TrainingConfig(
            steps=20_000,
            batch=16,
            window=1,
            rate=2e-3,
            fps=10.0,
            schedule="cosine",
            warm_up=100,
            validate=1000,
            cases=3,
            average=0.999,
        )
        return {
            "paper": TrainingConfig(steps=500_000, batch=8, window=1, rate=5e-5, fps=10.0, validate=10_000),
            "default": default,
        }

    # -------------------------------------------------------------------------------------- training
    def unfit(self, character: Character) -> str:
        if character.skin is None:
            return f"npt moves the vertices of a mesh, and {character.name} has none"
        if character.four_legged:
            return f"npt learns people's poses, and {character.name} stands on four legs"
        return ""

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        if motion.character.skin is None:
            raise NotSupported(self.unfit(motion.character))
        return moves(motion, motion.root)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> NptTraining:
        del config
        network = PoseTransfer(self.config.width, self.config.pooling)
        return NptTraining(training_data, self.config.points, network, self.using)

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        return self.untrained or self.unfit(target) or None

    def retarget(self, source: Motion | PointSets, target: Character, *, context: Context) -> Surface:
        """The target's vertices in the poses of a sequence of points; those of a motion lie on its mesh."""
        numbers = np.random.default_rng(context.seed)
        network = self._network.to(context.device)
        return retargeted(network, self._points(source, numbers), target, numbers)

    @staticmethod
    def _points(source: Motion | PointSets, numbers: np.random.Generator) -> PointSets:
        if isinstance(source, PointSets):
            return source
        body = source.character
        if body.mesh is None:
            raise NotSupported(
                f"npt takes points on a surface, and {body.name} has no mesh to draw them on"
            )
        return on_mesh(numbers, source, body.mesh)

    @cached_property
    def _network(self) -> PoseTransfer:
        network = PoseTransfer(self.config.width, self.config.pooling)
        weights.fill(network, self.tensors)
        return network.eval()


plugin = NPT
