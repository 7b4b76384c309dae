"""NKN between any structures: an encoder and a decoder for each of them, around codes of one size."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar
from zlib import crc32

import numpy as np

from retarget_bench.api import MethodCard
from retarget_bench.api.comparison import body_joints
from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import SIDES
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData

from ..nkn import DIFFERS, PARAMETERS, Nkn, features
from ..nkn.ends import Ends
from ..nkn.features import SIGNATURE, Signature
from ..nkn.inference import Retargeter
from ..nkn.retargeter import common_reasons
from ..nkn.training import NknTraining

ENDS = ("head", *(f"{side}_{part}" for side in SIDES for part in ("forearm", "hand", "leg", "foot")))
"""Roles of the joints that the loss ``ends`` watches."""
TWO_LEGGED, ALL = "two_legged", "all"


@dataclass(eq=False)
class NknCross(Retargeter):
    """NKN* of the PAN paper (Hu et al., TVCG 2023): NKN made to cross structures.

    Every structure has an encoder, a decoder and a discriminator of its own; codes are of one size, so that
    any encoder goes with any decoder. Half of the training rows stay within a structure, of which some are
    a body's own; the others go to another structure and back. Apart from that it is ``nkn``, whose
    parameters it has. All joints that position errors count are seen, below the hips and in file order, so
    four-legged bodies and those without collar bones can be learned too.

    structures: what is trained on: ``two_legged``, ``all``, or names of structures joined by ``+``. Weights
    know the structures that they were trained on, with any bodies of these.
    hidden: narrower than NKN's, since there are as many networks as structures.
    ends: weight of a term of our own (PAN's NKN*: 0): on another structure, hands, feet, head, elbows and
    knees are to be where the source's are, in lengths of the chains from the hips to them, and the body is
    to move as far. Without it, going there and back does not tell what lies in between.
    """

    presets: ClassVar[Mapping[str, TrainingConfig]] = {
        **Nkn.presets,
        "default": TrainingConfig(
            steps=6_000, batch=32, window=60, rate=5e-4, schedule="cosine", warm_up=200, validate=200
        ),
    }

    hidden: int = 256
    structures: str = TWO_LEGGED
    ends: float = 30.0
    card = MethodCard(
        name="nkn_cross",
        title="NKN*",
        summary="NKN with an encoder and a decoder for each structure",
        version="1",
        paper="Hu, Zhang, Zhong, Jiang, Wang, Zhang: Pose-Aware Attention Network for Flexible Motion "
        "Retargeting by Body Part, TVCG 2023 (NKN*)",
        published=(
            {"variant": "released", "drift": 0.0, "ends": 0.0, "lengths": "world", "path": "integrated"},
        ),
        differs={**DIFFERS, "ends": "loss on ends of limbs"},
        accepts=("motion", "positions"),
        default=False,
        parameters={
            **PARAMETERS,
            "ends": "weight of where hands, feet, head, elbows and knees are on others (published: 0)",
            "structures": "trained on: two_legged, all, or names joined by +",
        },
    )

    # ------------------------------------------------------------------------------------------ bodies
    def unfit(self, character: Character) -> str:
        if self.structures == TWO_LEGGED:
            if character.four_legged:
                return f"{character.name} stands on four legs, and this nkn_cross is for bodies of two"
        elif self.structures != ALL and character.structure not in self.structures.split("+"):
            return f"{character.name} is of structure {character.structure}, not of {self.structures}"
        try:
            self.body(character)
        except SkeletonError as error:
            return str(error)
        return common_reasons(character)

    def body(self, character: Character) -> Aligned:
        return _body(character)

    def structure(self, character: Character) -> str:
        return character.structure.replace(".", "_")

    def supports(self, source: Character, target: Character) -> str | None:
        if why := super().supports(source, target):
            return why
        for each in (source, target):
            known = self._signatures.get(self.structure(each))
            if known is None:
                names = ", ".join(self._signatures)
                return f"{each.name} is of structure {each.structure}, and these weights know {names}"
            if known != _signature(self.body(each)):
                return f"{each.name} has other joints than the {each.structure} that these weights know"
        return None

    @cached_property
    def _signatures(self) -> dict[str, Signature]:
        """Structure of the weights -> its joints."""
        return {
            name.removesuffix(SIGNATURE): tensor.tolist()
            for name, tensor in self.tensors.items()
            if name.endswith(SIGNATURE)
        }

    # ---------------------------------------------------------------------------------------- training
    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> NknTraining:
        """Raises NotSupported where bodies of one structure have different joints."""
        known: dict[str, tuple[str, Signature]] = {}
        for name in sorted(training_data.clips):
            body = self.body(training_data.characters[name])
            first, joints = known.setdefault(self.structure(body.character), (name, _signature(body)))
            if joints != _signature(body):
                raise NotSupported(
                    f"{first} and {name} are both of structure {body.character.structure} and have "
                    "different joints; give one of them another structure"
                )
        module = super().training_module(training_data, config)
        if self.ends:
            bodies = {name: training_data.characters[name] for name in sorted(training_data.clips)}
            reaches = {name: self._reaches(body) for name, body in bodies.items()}
            module.ends = Ends(self.ends, reaches)
        module.signatures = {name: joints for name, (_, joints) in known.items()}
        return module

    def _reaches(self, character: Character) -> dict[str, tuple[int, float]]:
        """Role -> its joint among those that the networks see, and the length of its chain."""
        body, unit = self.body(character), features.unit(character, self.lengths)
        parents = body.skeleton.parents
        lengths = np.linalg.norm(body.skeleton.offsets, axis=-1) / unit
        found = {}
        for joint, role in enumerate(body.roles):
            if role in ENDS:
                chain, at = 0.0, joint
                while at > 0:
                    chain, at = chain + float(lengths[at]), int(parents[at])
                found[role] = joint, chain
        return found


@lru_cache(maxsize=1024)
def _body(character: Character) -> Aligned:
    """The joints that position errors count, those at and below the hips."""
    return Aligned(character, body_joints(character))


def _signature(body: Aligned) -> Signature:
    parents = body.skeleton.parents.tolist()
    return [
        [parent, crc32((role or "").encode())] for parent, role in zip(parents, body.roles, strict=True)
    ]


plugin = NknCross
