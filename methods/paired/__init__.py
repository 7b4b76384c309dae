"""Paired: a network that corrects copied rotations, trained on exactly paired motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig, on_gpu
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from .features import RoleBody
from .inference import RootRule, path_rule, retargeted
from .network import Corrector
from .training import PairedTraining

_DEFAULT = TrainingConfig(
    steps=40_000,
    batch=16,
    window=64,
    rate=1e-3,
    schedule="cosine",
    warm_up=200,
    validate=1000,
    average=0.998,
)
PRESETS = {
    "paper": TrainingConfig(
        steps=200_000, batch=64, window=64, rate=1e-3, schedule="cosine", warm_up=500, average=0.998
    ),
    "default": _DEFAULT,
    "gpu": on_gpu(_DEFAULT, precision="bfloat16"),  # half as fast again, results/measurements.md
}
"""No paper prints any; ``paper`` is the longest that we know to pay."""


@dataclass(frozen=True)
class PairedConfig:
    """Parameters of Paired."""

    root_rule: RootRule = "hip_height"
    """what the path of the hips follows: learned, or a length whose ratio scales it"""
    weights: str = "puppets"
    """name of shipped weights, or a path to others"""


class Paired(LearnedMethod):
    """Copies rotations, then corrects them by what exact pairs teach; ours.

    1. The source's rotations are copied and its path is scaled by ``root_rule``.
    2. A temporal convolution network sees the source, the copy and both bodies over the 22 roles of
       ``body22``, and answers in every frame with a shift of the hips, where ankles and wrists go, and how
       limbs swivel; one number of both bodies alone scales the level path. Trunk, head, feet and hands stay
       as they were copied, arms too where their palms are clear of the body, of each other and of the floor
       (``features.near``). Hips take part with ``root_rule=learned`` only.
    3. Limbs bend towards their goals in closed form.
    4. Feet that the source holds still are held as ``ik`` holds them, which moves the hips where legs would
       not reach.

    With a rule, ``paired`` is ``ik`` whose hands have learned where to go. What pairs teach of hips, and
    would teach of trunks, is a convention of those who made the pairs.

    Frames 0.7 s before and after decide a frame. Joints outside of the 22 roles follow their parents as
    they do in the copy. Bodies may lack spine joints, neck, collar bones and toes.

    It is trained on the same performances by two bodies: the loss is the distance of all joints in the
    world and from the hips, of speeds, accelerations and turns, of feet that rest, and of vectors from the
    hands to near joints of the body (``losses.py``).
    """

    from_pairs = True
    Config = PairedConfig
    config: PairedConfig
    over_roles = True
    answering = ("root_rule",)
    presets: Mapping[str, TrainingConfig] = PRESETS
    card = MethodCard(
        name="paired",
        summary="Copied rotations corrected by a network that learned from exact pairs, with feet held",
        version="1",
        default=False,
        apart="trained on exact pairs, unlike the others",
    )

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        if self.config.root_rule != "learned":
            root_rules.check(self.config.root_rule, root_rules.SCALING_RULES)

    @property
    def root_rule(self) -> str:
        """The rule that paths follow."""
        return self.config.root_rule

    # -------------------------------------------------------------------------------------- training
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return RoleBody(motion.character).see(motion)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> PairedTraining:
        return PairedTraining(training_data, config, Corrector(), self.using)

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        why = super().supports(source, target)
        return why or root_rules.reason(path_rule(self.config.root_rule), source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        if not isinstance(source, Motion):
            raise NotSupported("paired needs a source with rotations, not positions only")
        return retargeted(self._network, source, target, self.config.root_rule)

    @cached_property
    def _network(self) -> Corrector:
        network = Corrector()
        network.take(self.tensors)
        return network.eval()


plugin = Paired
