"""Methods with networks of their own for every structure that they were trained on."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any
from zlib import crc32

import numpy as np

from retarget_bench.api.comparison import body_joints
from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import SIDES
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.kinematic import features
from retarget_bench.training.layers.kinematic.ends import Ends
from retarget_bench.training.layers.kinematic.features import SIGNATURE, Signature
from retarget_bench.training.layers.kinematic.retargeter import SightConfig, SightRetargeter, common_reasons
from retarget_bench.training.layers.trained_structures import TWO_LEGGED, not_among, unknown

ENDS = ("head", *(f"{side}_{part}" for side in SIDES for part in ("forearm", "hand", "leg", "foot")))
"""Roles of the joints that the loss ``ends`` watches."""


@dataclass(frozen=True)
class StructuresConfig(SightConfig):
    """Parameters of methods with networks for every structure."""

    structures: str = TWO_LEGGED
    """trained on: two_legged, all, or names joined by +"""
    ends: float = 30.0
    """weight of where hands, feet, head, elbows and knees are on others (published: 0)"""


class ManyStructures(SightRetargeter):
    """All joints that position errors count are seen, below the hips and in file order.

    structures: what is trained on: ``two_legged``, ``all``, or names of structures joined by ``+``.
    ends: weight of a term of our own on rows that go to another structure; see ``NknCross``.
    """

    config: StructuresConfig

    # ------------------------------------------------------------------------------------------ bodies
    def unfit(self, character: Character) -> str:
        if why := not_among(character, self.config.structures, self.card.name):
            return why
        try:
            self.body(character)
        except SkeletonError as error:
            return str(error)
        return common_reasons(character)

    def body(self, character: Character) -> Aligned:
        return _body(character)

    def roles(self, character: Character) -> tuple[str | None, ...]:
        return self.body(character).roles

    def structure(self, character: Character) -> str:
        return character.structure.replace(".", "_")

    def supports(self, source: Character, target: Character) -> str | None:
        if why := super().supports(source, target):
            return why
        for each in (source, target):
            signature = _signature(self.body(each))
            if why := unknown(each, self._signatures, self.structure(each), signature):
                return why
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
    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> Any:
        """Raises NotSupported where bodies of one structure have different joints."""
        signatures: dict[str, tuple[str, Signature]] = {}
        for name in sorted(training_data.clips):
            body = self.body(training_data.characters[name])
            first, joints = signatures.setdefault(self.structure(body.character), (name, _signature(body)))
            if joints != _signature(body):
                raise NotSupported(
                    f"{first} and {name} are both of structure {body.character.structure} and have "
                    "different joints; give one of them another structure"
                )
        module = super().training_module(training_data, config)  # type: ignore[safe-super]
        if self.config.ends:
            bodies = {name: training_data.characters[name] for name in sorted(training_data.clips)}
            reaches = {name: self._reaches(body) for name, body in bodies.items()}
            module.ends = Ends(self.config.ends, reaches)
        module.signatures = {name: joints for name, (_, joints) in signatures.items()}
        return module

    def _reaches(self, character: Character) -> dict[str, tuple[int, float]]:
        """Role -> its joint among those that the networks see, and the length of its chain."""
        body, unit = self.body(character), features.unit(character, self.config.lengths)
        parents = body.skeleton.parents
        lengths = np.linalg.norm(body.skeleton.offsets, axis=-1) / unit
        reaches = {}
        for joint, role in enumerate(body.roles):
            if role in ENDS:
                chain, at = 0.0, joint
                while at > 0:
                    chain, at = chain + float(lengths[at]), int(parents[at])
                reaches[role] = joint, chain
        return reaches


@lru_cache(maxsize=1024)
def _body(character: Character) -> Aligned:
    """The joints that position errors count, those at and below the hips."""
    return Aligned(character, body_joints(character))


def _signature(body: Aligned) -> Signature:
    parents = body.skeleton.parents.tolist()
    return [
        [parent, crc32((role or "").encode())] for parent, role in zip(parents, body.roles, strict=True)
    ]
