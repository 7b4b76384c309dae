"""SKR, the skeleton regressor of correspondence-free online retargeting: points of a surface to joints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from retarget_bench.api import Context, MethodCard
from retarget_bench.errors import BenchError
from retarget_bench.motion import body22
from retarget_bench.motion.character import Character, Positions
from retarget_bench.motion.motion import Motion, Prediction
from retarget_bench.motion.point_sets import PointSets
from retarget_bench.motion.surface_sampling import sampled
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skinned_body import moves_about_hips
from retarget_bench.training.learned_method import LearnedMethod

from .inference import joints_of, placed, points_of
from .network import SkeletonRegressor
from .training import SkrTraining

DRAWS, SPOTS = 64, 2048
"""How often points are drawn from a surface at rest, and how many, so that its joints are exact."""
DEFAULT = TrainingConfig(
    steps=40_000,
    batch=32,
    window=1,
    fps=10.0,
    rate=1e-3,
    schedule="cosine",
    warm_up=500,
    validate=2000,
    cases=9,
    average=0.999,
)


@dataclass(frozen=True)
class SkrConfig:
    """Raises BenchError for what cannot be."""

    network: Literal["count", "table5"] = "count"
    """count (1.6 M parameters, as stated) or table5 (3.5 M, as printed)"""
    direction: Literal["principal", "world"] = "principal"
    """points are seen along their main level direction (principal) or the world's"""
    dropout: float = 0.0
    """share of numbers dropped in training (the paper: 0.3)"""
    stretched: float = 0.75
    """share of training rows in which bodies have other proportions, drawn at random"""
    fewest: int = 128
    """fewest points of a training row"""
    most: int = 1024
    """most points of a training row"""
    points: int = 1024
    """points drawn from the surface where the source is a motion"""
    views: int = 4
    """1, 2 or 4: points are shared out to be seen as they are, turned and mirrored"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""

    def __post_init__(self) -> None:
        if self.network not in ("count", "table5"):
            raise BenchError(f"skr: network is count or table5, not {self.network}")
        if self.direction not in ("principal", "world"):
            raise BenchError(f"skr: direction is principal or world, not {self.direction}")
        if not 0 <= self.dropout < 1:
            raise BenchError("skr: dropout is a share from 0 to below 1")
        if not 0 <= self.stretched <= 1:
            raise BenchError("skr: stretched is a share from 0 to 1")
        if self.views not in (1, 2, 4):
            raise BenchError(f"skr: views are 1, 2 or 4, not {self.views}")
        if not 1 <= self.fewest <= self.most or self.points < 1:
            raise BenchError("skr needs at least one point, and no more points fewest than most")


class SKR(LearnedMethod):
    """Skeleton regressor of the correspondence-free pipeline (Marsot, Rekik et al., HAL v1, 2023).

    A PointNet maps points on a body's surface, any number of them in any order, to the 22 joints of
    ``body22``. It is trained on single frames of people with meshes; new points are drawn from the surface
    in every step, and the body is turned about the vertical at random.

    It finds the joints of the body that it sees and carries nothing to another one, so it answers for a
    source and a target that are the same. Of a motion it sees no more than points drawn from the skin.

    The paper leaves these open: points are seen relative to their mean, in units of their root mean square
    distance from it, and a tenth of the training frames are the T-pose.

    network: ``count`` has the 1.6 M parameters that the paper states (1,612,875). ``table5`` is its
        Table 5, which transforms features too (3,466,251).
    direction: ``principal``, ours: points are seen along the level direction in which they spread most, so
        that the network need not learn how bodies look from everywhere. ``world``: as they are.
    dropout: before the last layer. The paper's 0.3 keeps short training from becoming exact.
    stretched: share of training rows in which a body has other proportions than any in the data, ours, for
        bodies that nobody has seen.
    fewest, most: points of a training row. points: drawn of a source that is known by a motion.
    views: 4, ours: points are shared out among four views, as they are, turned to the back, and both in a
        mirror, and the answers averaged. 2: the first two. 1: as they are.
    """

    Config = SkrConfig
    config: SkrConfig
    over_roles = True
    answering = ("points", "views")
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        "paper": TrainingConfig(
            steps=100 * 63_520 // 32, batch=32, window=1, fps=10.0, rate=1e-4, validate=5000, cases=9
        ),
        "default": DEFAULT,
    }
    """The paper says Adam at 1e-4 for 100 epochs of 63,520 frames, and no batch size."""

    card = MethodCard(
        name="skr",
        title="SKR",
        summary="22 joints from points on a body's surface by a PointNet; of the same body only",
        version="1",
        paper="Marsot, Rekik et al., Correspondence-free online human motion retargeting, HAL v1, 2023",
        published=(
            {"dropout": 0.3, "direction": "world", "stretched": 0.0, "views": 1},
            {"network": "table5", "dropout": 0.3, "direction": "world", "stretched": 0.0, "views": 1},
        ),
        differs={
            "dropout": "no dropout",
            "direction": "seen along the points' main level direction",
            "stretched": "trained on bodies stretched at random, too",
            "views": "the mean of four views that share the points",
        },
        accepts=("points", "motion"),
        stochastic=True,
        default=False,
        apart="finds joints of the body it sees",
    )

    # -------------------------------------------------------------------------------------- training
    def unfit(self, character: Character) -> str:
        if character.skin is None:
            return f"{character.name} has no mesh to draw points from"
        return super().unfit(character)

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return moves_about_hips(motion)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SkrTraining:
        return SkrTraining(
            training_data,
            (self.config.fewest, self.config.most),
            self._built(),
            self.config.stretched,
            self.using,
        )

    def _built(self) -> SkeletonRegressor:
        return SkeletonRegressor(
            self.config.network == "table5", self.config.dropout, self.config.direction == "principal"
        )

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if source.name != target.name:
            return "skr finds the joints of the body that it sees and carries nothing to another one"
        return self.untrained or body22.unfit(target, "skr") or None

    def retarget(self, source: Prediction | PointSets, target: Character, *, context: Context) -> Positions:
        self._regressor.to(context.device)
        joints = self.joints(points_of(source, self.config.points, context.seed))
        return target.positions(placed(target, joints), source.fps)

    def joints(self, points: Sequence[np.ndarray]) -> np.ndarray:
        """``(frames, 22, 3)`` metres: the joints under the points ``(V, 3)`` of each frame."""
        return joints_of(self._regressor, points, self.config.views)

    def resting(self, vertices: np.ndarray, faces: np.ndarray, draws: int = DRAWS) -> np.ndarray:
        """``(draws, 22, 3)`` metres: the joints of a surface in T-pose, vertices ``(V, 3)`` and faces
        ``(F, 3)``, each time of other points on it."""
        numbers = np.random.default_rng(0)
        drawn = sampled(np.repeat(vertices[None], draws, 0), faces, numbers.random((draws, 3, SPOTS)))
        return self.joints(list(drawn))

    @cached_property
    def _regressor(self) -> SkeletonRegressor:
        regressor = self._built()
        weights.fill(regressor, self.tensors)
        return regressor.eval()


plugin = SKR
