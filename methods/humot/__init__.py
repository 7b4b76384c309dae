"""HuMoT: one encoder and one decoder for every skeleton, which a neutral pose describes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import SkeletonError
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Positions
from retarget_bench.training.config import TrainingConfig, on_gpu
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from .features import body
from .settings import DESIGNS, DIFFERS, PUBLISHED, HumotConfig

if TYPE_CHECKING:
    from .network import Autoencoder
    from .training import HumotTraining


DEFAULT = TrainingConfig(
    steps=20_000,
    batch=16,
    window=30,
    rate=7e-4,
    schedule="cosine",
    warm_up=50,
    validate=1000,
    average=0.999,
)


class HuMoT(LearnedMethod):
    """Topology-agnostic transformer (Mourot, Hoyet, Le Clerc, Hellier, 2023).

    An encoder reads joint positions, each beside its position in the skeleton's template (a neutral pose),
    and codes the motion frame by frame; a decoder gives joint positions for any other template. It is
    trained to reconstruct some joints of a window from others, on any skeletons at once, and takes
    skeletons that it was never trained on. Answers are positions.

    facing, sized: answers come back from both. Not in the paper.
    varied: drawn apart for source and target (``augmentation.py``). Not in the paper.
    split: with ``chunk`` windows that are kept aside are validated on, as in the paper's split.
    root_rule: one of ``root_rules.SCALING_RULES``. The paper's is ``leg_length`` (A.6), with which bodies
        of other proportions float or sink.
    windows: those that overlap do so by half, are as long as those of training, and fade into each other.
    """

    Config = HumotConfig
    config: HumotConfig
    answering = ("root_rule", "windows")
    card = MethodCard(
        name="humot",
        title="HuMoT",
        summary="One autoencoder for all skeletons, also for those never trained on: positions",
        version="1",
        paper="Mourot, Hoyet, Le Clerc, Hellier: HuMoT: Human Motion Representation using "
        "Topology-Agnostic Transformers for Character Animation Retargeting, 2023",
        published=({**PUBLISHED, "variant": "text"}, {**PUBLISHED, "variant": "paper_count"}),
        differs=DIFFERS,
        accepts=("motion", "positions"),
    )
    presets: Mapping[str, TrainingConfig] = {
        "paper": TrainingConfig(
            steps=10_000_000,
            batch=32,
            window=30,
            rate=1e-4,
            schedule="triangular",
            lowest=1e-5,
            period=260_000,
            validate=10_000,
        ),
        "finetune": TrainingConfig(steps=20_000, batch=32, window=30, rate=5e-5),
        "default": DEFAULT,
        "gpu": on_gpu(DEFAULT, precision="bfloat16"),  # half as fast again, results/measurements.md
        "ablation": TrainingConfig(
            steps=5000, batch=4, window=30, rate=7e-4, schedule="cosine", warm_up=50, validate=2500
        ),
    }

    @property
    def root_rule(self) -> str:
        """The rule that paths follow."""
        return self.config.root_rule

    # ---------------------------------------------------------------------------------------- training
    def unfit(self, character: Character, read: bool = False) -> str:
        """read: whether it is enough that it can be read."""
        if character.four_legged:
            return f"{character.name} stands on four legs; HuMoT knows bodies on two"
        if not read and "hips" not in character.joint_of:
            return f"no joint of {character.name} is known as hips; name it in a roles file"
        try:
            major = body(character.whole or character).major
        except SkeletonError as error:
            return str(error)
        if not major.any():
            return f"{character.name} has none of the joints that clips are centred on (ankles to wrists)"
        return ""

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        own = body(motion.character)
        turns = {"turns": own.turns(motion)} if self.config.slanted else {}
        return {"places": own.see(motion), **turns}

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> HumotTraining:
        from .training import HumotTraining

        bodies = {name: body(training_data.characters[name]) for name in training_data.clips}
        return HumotTraining(
            training_data, config, bodies, DESIGNS[self.config.variant], self.config, self.using
        )

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if self.untrained:
            return self.untrained
        why = self.unfit(source, read=True) or self.unfit(target)
        return why or root_rules.reason(self.config.root_rule, source, target)

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Positions]:
        """The positions of the targets; windows of all go through the networks together."""
        from .inference import Question, retargeted

        if not sources:
            return []
        pairs = zip(sources, targets, strict=True)
        questions = [Question.of(*pair, self.config.root_rule, self.config.sized) for pair in pairs]
        return retargeted(
            self._network.to(contexts[0].device), questions, self.config.windows, self.config.facing
        )

    @cached_property
    def _network(self) -> Autoencoder:
        from .network import Autoencoder

        network = Autoencoder(DESIGNS[self.config.variant])
        network.load(self.tensors)
        return network.eval()


plugin = HuMoT
