"""SMRM, the recurrent retargeter of correspondence-free online retargeting: two GRUs and kinematics."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from .ablations import ABLATIONS
from .features import Features, Normalisation, Root, Yaw, unfit
from .inference import retargeted
from .network import Generator
from .training import Reference, SmrmTraining, Weighting


class SMRM(LearnedMethod):
    """Skeletal motion retargeting of the correspondence-free pipeline (Marsot, Rekik et al., HAL v1, 2023).

    A two-layer GRU reads places of 22 joints and a move of the hips frame by frame; a second one reads its
    code and the target's T-pose, and answers with 22 rotations and a move. It is trained without pairs: a
    motion carried to another body and back has to be itself again. Joints beyond the 22 (fingers) rest.

    The paper leaves these open; they are parameters, and weights depend on all of them:

    normalisation: what the networks see. ``body``: lengths in hip heights of the body they belong to,
        without mean, in deviations over all clips; a copied move is then a scaled one. ``global``:
        likewise, in metres (as NKN). ``none``: metres as they are.
    root: the three numbers of the hips. ``height``: level displacement from the frame before, and height
        above the floor. ``displacement``: upwards too it is a displacement. ``position``: where they are,
        from the clip's first frame on; in long clips that is far from anything seen in training.
    yaw: ``removed``: seen from where the character faces in that frame, which is given back to the answer.
        ``kept``: directions are the world's, and training turns every window at random.
    adversarial: weight of the adversarial term. 1 is what eq. 2 says. With errors in squared metres it
        outweighs all else a hundred times, so the default is smaller; 0: no discriminator. It is NKN's
        (on 69 numbers of a frame, not 70: 280,285 parameters), with NKN's rule that it learns only
        while it is fooled more often than three times in ten.
    rotation_cycle: weight of the rotations' cycle loss; 0: without (Table 2). smooth: weight of the mean
        acceleration of the hips' path in the world.
    reference_rotation: what the rotations that come back are compared with. ``truth``: those of the clip.
        ``self``: those of the same clip carried to its own body.
    same: share of rows whose target is their own character, as in NKN; there the answer itself is compared
        with the clip too. 0: never.
    context: frames of a training window (Table 3). hidden: numbers of a GRU's state.

    The cycle loss on joints is the mean squared error of places relative to the hips plus that of the hips'
    path over the window, in units of the normalisation (metres, or hip heights). Adam is torch's, gradients
    of the generator are cut to a norm of 1.

    Raises BenchError for parameters that cannot be.
    """

    ablations = ABLATIONS

    def __init__(
        self,
        weights: str = "puppets",
        normalisation: Normalisation = "body",
        root: Root = "height",
        yaw: Yaw = "removed",
        adversarial: float = 0.0001,
        rotation_cycle: float = 0.01,
        smooth: float = 0.001,
        reference_rotation: Reference = "truth",
        same: float = 0.2,
        context: int = 30,
        hidden: int = 512,
    ) -> None:
        super().__init__(weights)
        if context < 2 or hidden < 1:
            raise BenchError("smrm needs a context of two frames or more, and at least one hidden number")
        if min(adversarial, rotation_cycle, smooth) < 0 or not 0 <= same <= 1:
            raise BenchError("weights of smrm's losses cannot be negative, and same is a share from 0 to 1")
        self.features = Features(normalisation, root, yaw)
        self.weighting = Weighting(adversarial, rotation_cycle, smooth, reference_rotation, same)
        self.context, self.hidden = context, hidden
        self.presets: Mapping[str, TrainingConfig] = _presets(context)
        self.card = MethodCard(
            name="smrm",
            summary="Recurrent retargeting learned without pairs: what is carried there comes back",
            version="1",
            paper="Marsot, Rekik et al., Correspondence-free online human motion retargeting, HAL v1, 2023",
            accepts=("motion", "positions"),
            parameters={
                "weights": "name of shipped weights, or a path to others",
                "normalisation": "lengths in hip heights (body) or metres (global), in deviations; or none",
                "root": "what is seen of the hips: height (and level steps), displacement, position",
                "yaw": "directions seen from where the character faces (removed) or the world's (kept)",
                "adversarial": "weight of the adversarial term (eq. 2: 1)",
                "rotation_cycle": "weight of the rotations' cycle loss (0: without)",
                "smooth": "weight of the mean acceleration of the hips",
                "reference_rotation": "what rotations are compared with: truth, self",
                "same": "share of training rows whose target is their own character",
                "context": "frames of a training window",
                "hidden": "numbers of a GRU's state",
            },
        )

    # -------------------------------------------------------------------------------------- training
    def facts(self) -> Mapping[str, str | int | float | bool]:
        """The parameters that weights depend on."""
        features, weighting = self.features, self.weighting
        return {
            "normalisation": features.normalisation,
            "root": features.root,
            "yaw": features.yaw,
            "adversarial": weighting.adversarial,
            "rotation_cycle": weighting.rotation_cycle,
            "smooth": weighting.smooth,
            "reference_rotation": weighting.reference,
            "same": weighting.same,
            "context": self.context,
            "hidden": self.hidden,
        }

    def unfit(self, character: Character) -> str:
        return unfit(character)

    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        return self.features.see(motion)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SmrmTraining:
        def trained(tensors: Mapping[str, Tensor]) -> Method:
            return type(self)(self.weights, **self.facts()).using(tensors)  # type: ignore[arg-type]

        return SmrmTraining(
            training_data, config, self.features, self.weighting, Generator(self.hidden), trained
        )

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        return self.untrained or unfit(source) or unfit(target) or None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        return self.retarget_batch([source], [target], contexts=[context])[0]

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Motion]:
        if not sources:
            return []
        device = torch.device(contexts[0].device)
        return retargeted(self._generator.to(device), self.features, sources, targets)

    @cached_property
    def _generator(self) -> Generator:
        generator = Generator(self.hidden)
        generator.take(self.tensors)
        return generator.eval()


def _presets(context: int) -> Mapping[str, TrainingConfig]:
    """How long and fast. The paper says Adam at 1e-4 for 1000 epochs of 2330 windows, and no batch size."""
    return {
        "paper": TrainingConfig(
            steps=1000 * 2330 // 16, batch=16, window=context, rate=1e-4, validate=2500
        ),
        "default": TrainingConfig(
            steps=8000, batch=32, window=context, rate=1e-3, schedule="cosine", warm_up=200, validate=200
        ),
        "quick": TrainingConfig(
            steps=60,
            batch=16,
            window=context,
            rate=1e-3,
            schedule="cosine",
            warm_up=10,
            validate=30,
            cases=4,
        ),
    }


plugin = SMRM
