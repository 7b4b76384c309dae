"""SMRM, the recurrent retargeter of correspondence-free online retargeting: two GRUs and kinematics."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import torch

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from .features import Features
from .inference import retargeted
from .network import Generator
from .settings import SmrmConfig
from .training import SmrmTraining


class SMRM(LearnedMethod):
    """Skeletal motion retargeting of the correspondence-free pipeline (Marsot, Rekik et al., HAL v1, 2023).

    A two-layer GRU reads places of 22 joints and a move of the hips frame by frame; a second one reads its
    code and the target's T-pose, and answers with 22 rotations and a move. It is trained without pairs: a
    motion carried to another body and back has to be itself again. Joints beyond the 22 (fingers) rest.

    The paper's networks know one set of joints. Ours also answer for bodies that lack a spine joint, the
    neck, a collar bone or a toe: in its place they see a joint of no length, which does not turn. Shipped
    weights have not been trained on such bodies.

    path: ``integrated`` is the decoder's, as in the paper; its errors add up. ``relative``, our own, takes
    the source's path, scaled by hip heights; what the decoder's steps differ by is summed up and fades
    within ``root_rules.MEMORY``.

    variant: weights of the losses. ``paper`` is eq. 2 as printed: the adversarial term counts 1, and no row
    goes to its own body. With errors in squared metres or hip heights this term outweighs all others a
    hundred times, so ``own`` gives it 0.0001; and a fifth of the rows goes to their own body, as in NKN.

    The paper leaves these open; they are parameters, and weights depend on all of them:

    normalisation: what the networks see. ``body``: lengths in hip heights of the body they belong to,
        without mean, in deviations over all clips; a copied move is then a scaled one. ``global``:
        likewise, in metres (as NKN). ``none``: metres as they are.
    root: the three numbers of the hips. ``height``: level displacement from the frame before, and height
        above the floor. ``displacement``: upwards too it is a displacement. ``position``: where they are,
        from the clip's first frame on; in long clips that is far from anything seen in training.
    yaw: ``removed``: seen from where the character faces in that frame, which is given back to the answer.
        ``kept``: directions are the world's, and training turns every window at random.
    adversarial: weight of the adversarial term. 0: no discriminator. It is NKN's (on 69 numbers of a frame,
        not 70: 280,285 parameters), with NKN's rule that it learns only while it is fooled more often than
        three times in ten.
    rotation_cycle: 0 in a row of Table 2. smooth: of the hips' path in the world.
    reference_rotation: what the rotations that come back are compared with. ``truth``: those of the clip.
        ``self``: those of the same clip carried to its own body.
    same: share of rows that go to their own body, as in NKN; in these rows the answer itself is compared
        with the clip too. context: see Table 3.
    noise: ours, of training: deviation of every coordinate of the source's joints from the true one, in
        every frame anew, in the unit of lengths. For sources whose joints are found by ``skr``.

    The cycle loss on joints is the mean squared error of places relative to the hips plus that of the hips'
    path over the window, in units of the normalisation (metres, or hip heights). Adam is torch's, gradients
    of the generator are cut to a norm of 1.

    """

    Config = SmrmConfig
    config: SmrmConfig
    over_roles = True
    answering = ("path", "variant")
    card = MethodCard(
        name="smrm",
        title="SMRM",
        summary="Recurrent retargeting learned without pairs: what is carried there comes back; ours: "
        "bodies that lack some of the 22 joints",
        version="1",
        paper="Marsot, Rekik et al., Correspondence-free online human motion retargeting, HAL v1, 2023",
        published=({"variant": "paper", "path": "integrated"},),
        differs={"variant": "adversarial weight 0.0001", "path": "path relative to the source's"},
        accepts=("motion", "positions"),
    )

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.features = Features(self.config.normalisation, self.config.root, self.config.yaw)

    @property
    def presets(self) -> Mapping[str, TrainingConfig]:
        """The paper says Adam at 1e-4 for 1000 epochs of 2330 windows, and no batch size."""
        default = TrainingConfig(
            steps=8000,
            batch=32,
            window=self.config.context,
            rate=1e-3,
            schedule="cosine",
            warm_up=200,
            validate=200,
            average=0.999,
        )
        return {
            "paper": TrainingConfig(
                steps=1000 * 2330 // 16, batch=16, window=self.config.context, rate=1e-4, validate=2500
            ),
            "default": default,
        }

    @property
    def root_rule(self) -> str:
        """The rule that paths follow; "" where the network's moves are summed up."""
        return "hip_height" if self.config.path == "relative" else ""

    # -------------------------------------------------------------------------------------- training
    def facts(self) -> Mapping[str, Scalar]:
        """The parameters that weights depend on; of the variant, what it decides."""
        config = self.config
        return {**super().facts(), "adversarial": config.adversarial_weight, "same": config.same_share}

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return self.features.see(motion)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SmrmTraining:
        return SmrmTraining(
            training_data,
            config,
            self.features,
            self.config,
            Generator(self.config.hidden),
            self.using,
        )

    # ----------------------------------------------------------------------------------- retargeting
    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Motion]:
        if not sources:
            return []
        device = torch.device(contexts[0].device)
        return retargeted(self.generator.to(device), self.features, sources, targets, path=self.config.path)

    @cached_property
    def generator(self) -> Generator:
        """The networks, in evaluation mode."""
        generator = Generator(self.config.hidden)
        weights.fill(generator, self.tensors)
        return generator.eval()


plugin = SMRM
