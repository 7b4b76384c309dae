"""SKIN, the skinning predictor of correspondence-free online retargeting: weights around a skeleton."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
import torch

from retarget_bench.api import Context, MethodCard, Source, Surface
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.files import digest
from retarget_bench.motion import body22, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skinning_torch import skinned
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skinned_body import SkinnedBody, mesh_of, moves_about_hips
from retarget_bench.training.learned_method import LearnedMethod, of_weights

from .network import Inputs, SkinningPredictor
from .posing import transforms_of
from .training import SkinTraining

DEFAULT = TrainingConfig(
    steps=10_000,
    batch=16,
    window=1,
    fps=10.0,
    rate=1e-3,
    schedule="cosine",
    warm_up=200,
    validate=1000,
    cases=9,
    average=0.999,
)
DRAWS = 8
"""Estimates of each body's joints that are trained with in turn."""


@dataclass(frozen=True)
class SkinConfig:
    """Raises BenchError for what cannot be."""

    inputs: Inputs = "distances"
    """what is seen of a point: distances to joints, as the text has it, or vectors from them (Table 7)"""
    dropout: float = 0.0
    """share of numbers dropped in training (the paper: 0.2)"""
    joints: Literal["skr", "truth"] = "skr"
    """joints in T-pose, in training and answers: found by skr, or the truth"""
    skr: str = "puppets"
    """name of skr's weights, which find joints, or a path to others"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""

    def __post_init__(self) -> None:
        if self.inputs not in ("distances", "vectors"):
            raise BenchError(f"skin: inputs are distances or vectors, not {self.inputs}")
        if self.joints not in ("skr", "truth"):
            raise BenchError(f"skin: joints are of skr or the truth, not {self.joints}")
        if not 0 <= self.dropout < 1:
            raise BenchError("skin: dropout is a share from 0 to below 1")


class SKIN(LearnedMethod):
    """Skinning predictor of the correspondence-free pipeline (Marsot, Rekik et al., HAL v1, 2023).

    Three layers map where a point lies relative to 22 joints in T-pose to its skinning weights. They are
    trained through linear blend skinning: points of a body in T-pose have to get where they are in another
    frame, with true rotations and with joints that SKR finds.

    As a method it poses a target's mesh by the rotations of a source that is the same body, with weights
    and joints of its own: what is left of the error is the skin's.
    """

    Config = SkinConfig
    config: SkinConfig
    over_roles = True
    answering = ("skr",)
    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        "paper": TrainingConfig(
            steps=200 * 63_520 // 64, batch=16, window=1, fps=10.0, rate=1e-4, validate=5000, cases=9
        ),
        "default": DEFAULT,
    }
    """The paper says Adam at 1e-4 for 200 epochs of 63,520 frames, and no batch size; rows have four."""

    card = MethodCard(
        name="skin",
        title="SKIN",
        summary="A mesh posed with skinning weights predicted from distances to joints; same body only",
        version="1",
        paper="Marsot, Rekik et al., Correspondence-free online human motion retargeting, HAL v1, 2023",
        published=({"dropout": 0.2}, {"dropout": 0.2, "inputs": "vectors"}),
        differs={"dropout": "no dropout"},
        default=False,
        apart="poses the body that it sees",
    )

    # -------------------------------------------------------------------------------------- training
    def unfit(self, character: Character) -> str:
        if character.skin is None:
            return f"{character.name} has no mesh to pose"
        return super().unfit(character)

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return moves_about_hips(motion)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SkinTraining:
        return SkinTraining(
            training_data,
            self._skeletons,
            SkinningPredictor(self.config.inputs, self.config.dropout),
            self.using,
        )

    def _skeletons(self, body: SkinnedBody, draws: int = DRAWS) -> np.ndarray:
        """``(estimates, 22, 3)`` metres: the joints of a body in T-pose."""
        if self.config.joints == "truth":
            return body.resting[None]
        joints: np.ndarray = self._regressor.resting(body.vertices[:, :3], body.faces, draws)
        return joints

    @cached_property
    def _regressor(self) -> Any:
        return of_weights("skr", self.config.skr)

    # --------------------------------------------------------------------------------- what is known
    @property
    def stages(self) -> Mapping[str, Any]:
        """SKR, where it finds the joints."""
        return {"skr": self._regressor} if self.config.joints == "skr" else {}

    @property
    def weights_hash(self) -> str:
        """The hash of the weights, and of SKR's where it finds the joints."""
        each = [super().weights_hash, *(stage.weights_hash for stage in self.stages.values())]
        return (digest(" ".join(each)) if len(each) > 1 else each[0]) if all(each) else ""

    @property
    def untrained(self) -> str:
        return super().untrained or next((each.untrained for each in self.stages.values()), "")

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if source.name != target.name:
            return "skin poses the body that it sees and carries nothing to another one"
        return self.untrained or self.unfit(target) or None

    def retarget(self, source: Source, target: Character, *, context: Context) -> Surface:
        if not isinstance(source, Motion):
            raise NotSupported("skin needs a source with rotations")
        body, moves = SkinnedBody.of(target), moves_about_hips(source)
        joints = self._skeletons(body).mean(axis=0)
        mesh = mesh_of(target)
        shares = self.shares(mesh.vertices, joints)
        matrices = rotation.to_matrix(moves["turns"][:, list(body22.Body22.of(target).joints)])
        hips = source.positions[:, body22.Body22.of(source.character).joints[0]]
        hips = hips - np.einsum("fab,b->fa", matrices[:, 0], body.resting[0])
        shifts = transforms_of(joints, matrices, hips)
        tensors = (torch.from_numpy(each) for each in (mesh.vertices, shares, matrices, shifts))
        return target.surface(skinned(*tensors).numpy(), source.fps)

    def shares(self, points: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """``(V, 22)`` skinning weights of points ``(V, 3)`` about joints ``(22, 3)`` in T-pose, metres."""
        scaled, about = (
            torch.from_numpy(np.asarray(each - joints[0], np.float32))[None] for each in (points, joints)
        )
        with torch.inference_mode():
            return np.asarray(self._predictor(scaled, about)[0].numpy(), dtype=np.float64)

    @cached_property
    def _predictor(self) -> SkinningPredictor:
        predictor = SkinningPredictor(self.config.inputs, self.config.dropout)
        weights.fill(predictor, self.tensors)
        return predictor.eval()


plugin = SKIN
