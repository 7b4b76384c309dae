"""SAME: codes of poses that belong to no skeleton, by graph attention on any of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import torch

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training import weights as bundles
from retarget_bench.training.authors import AuthorsWeights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from . import released
from .bodies import RATIO, body
from .features import see
from .inference import retargeted
from .network import Autoencoder
from .training import SameTraining

VERSION = "1"
_DEFAULT = TrainingConfig(
    steps=12_000, batch=16, window=8, rate=3e-3, schedule="cosine", warm_up=100, validate=500, average=0.999
)
PRESETS = {
    "paper": TrainingConfig(
        steps=240_000, batch=256, window=8, rate=1e-2, schedule="cosine", validate=5000
    ),
    "default": _DEFAULT,
}
"""The released config has the batch, the window and the highest rate of ``paper``, for 240 epochs; how many
steps an epoch has is not said."""


@dataclass(frozen=True)
class SameConfig:
    """Parameters of SAME."""

    path: root_rules.PathKind = "relative"
    """integrated (moves summed up) or relative (the source's; what differs fades)"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others; also the authors' folder"""


class Same(LearnedMethod):
    """Skeleton-agnostic motion embedding (Lee, Kang, Park, Lee, Won: SIGGRAPH Asia 2023).

    Graph attention over the joints of any skeleton, whose bones are features of its joints, pools a pose
    into a code of 32 numbers; graph attention over another skeleton decodes it. Frames are coded one by
    one, with velocities among their features. It is trained on the same performances by two bodies, of
    either of which the end of a limb may be left out, to give the second body's motion, and codes that are
    alike.

    path: ``integrated`` sums up the decoder's moves and turns of the hips, as in the paper; its errors add
    up. ``relative``, our own, takes the source's path, scaled by hip heights, and where it faces; what the
    decoder's differ by is summed up and fades within ``root_rules.MEMORY``.
    weights: also a folder with the authors' ``last_model.pt`` and ``ms_dict.pt`` (CC BY-NC 4.0), which are
    not shipped.

    The decoder's contacts are not used.
    """

    from_pairs = True
    Config = SameConfig
    config: SameConfig
    answering = ("path",)
    presets: Mapping[str, TrainingConfig] = PRESETS
    card = MethodCard(
        name="same",
        title="SAME",
        summary="Codes of poses that any skeleton can decode, by graph attention, learned from pairs",
        version=VERSION,
        paper="Lee, Kang, Park, Lee, Won: SAME: Skeleton-Agnostic Motion Embedding for Character "
        "Animation, SIGGRAPH Asia 2023",
        authors_weights="result/ckpt0 of github.com/sunny-Codes/SAME (CC BY-NC 4.0); weights=the folder "
        "with last_model.pt and ms_dict.pt",
        published=({"path": "integrated"},),
        differs={"path": "path relative to the source's"},
        default=False,
        apart="training not finished",
    )

    @property
    def root_rule(self) -> str:
        """The rule that paths follow; "" where the decoder's moves are summed up."""
        return RATIO if self.config.path == "relative" else ""

    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:
        return released.at(path)

    # -------------------------------------------------------------------------------------- training
    def unfit(self, character: Character) -> str:
        try:
            body(character).skeleton  # noqa: B018 - raises where there is none
        except SkeletonError as error:
            return str(error)
        return root_rules.reason(RATIO, character, character) or ""

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return {"nodes": see(body(motion.character), motion)}

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SameTraining:
        return SameTraining(training_data, config, Autoencoder(), self.using)

    # ----------------------------------------------------------------------------------- retargeting
    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("same needs a source with rotations, not positions only")
        return retargeted(self._network.to(torch.device(context.device)), source, target, self.config.path)

    @cached_property
    def _network(self) -> Autoencoder:
        network = Autoencoder()
        bundles.fill(network, self.tensors, f"{self._at or 'weights'}")
        return network.eval()


plugin = Same
