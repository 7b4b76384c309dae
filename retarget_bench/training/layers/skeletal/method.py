"""Base class of methods that have networks for every structure, around features of edges."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal.body import LayoutBody, structure_key
from retarget_bench.training.layers.skeletal.features import RULE, Yaw
from retarget_bench.training.learned_method import LearnedMethod

if TYPE_CHECKING:
    from retarget_bench.training.layers.skeletal.structure import StructureNetworks


class SkeletalMethod(LearnedMethod):
    """A method whose networks read and write ``Features`` of edges, one set of them for each structure.

    settings: with ``features``, ``statistics`` (by ``structure`` or by ``character``) and
    ``least_deviation``. target_stats: by character, the statistics that an answer gets: ``transferred``
    those of training, ``own`` those of the target's reference motions. tips: ends of chains, which no edge
    turns: ``copied`` relative to their parents, or ``rest``. yaw: see ``Features.motion``.
    """

    settings: Any
    yaw: Yaw = "source"

    def _privileged(self) -> tuple[str, ...]:
        """The inputs that the card has to name. Raises BenchError for parameters that contradict."""
        if self.config.target_stats != "own":
            return ()
        if self.settings.statistics != "character":
            raise BenchError(
                "target_stats=own needs statistics=character: of a structure there is nothing to leak"
            )
        return ("target_motions",)

    # ------------------------------------------------------------------------------------------ bodies
    @abstractmethod
    def body(self, character: Character) -> LayoutBody:
        """A character in its own structure's layout."""

    @abstractmethod
    def assigned(self, character: Character) -> tuple[str, LayoutBody]:
        """The key of the structure whose networks a supported character goes through, and it in that
        structure's layout."""

    @property
    @abstractmethod
    def structures(self) -> Mapping[str, StructureNetworks]:
        """The networks by structure. Raises BenchError where there are no weights."""

    @property
    def root_rule(self) -> str:
        """The rule that paths follow; "" where they are decoded."""
        return RULE if self.settings.features.path != "decoded" else ""

    @property
    def root_bone(self) -> bool:
        """True if networks read the root's OFFSET as a bone: those of the authors, of people."""
        return self._authors is not None

    # ---------------------------------------------------------------------------------------- training
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        arrays: Mapping[str, np.ndarray] = self.settings.features.see(motion, self.body(motion.character))
        return arrays

    def bodies(self, training_data: TrainingData) -> dict[str, dict[str, LayoutBody]]:
        """Structure -> character -> its body.

        Raises NotSupported where bodies of one structure differ in joints, or there is one body only."""
        if len(training_data.clips) < 2:
            raise NotSupported(f"{self.card.name} learns from at least two characters, and there is one")
        bodies: dict[str, dict[str, LayoutBody]] = {}
        for name in sorted(training_data.clips):
            body = self.body(training_data.characters[name])
            members = bodies.setdefault(structure_key(body.character), {})
            members[name] = body
            first = next(iter(members.values()))
            if first.layout != body.layout:
                raise NotSupported(
                    f"{first.character.name} and {name} are both of structure {body.character.structure} "
                    "and have different joints; give one of them another structure"
                )
        return bodies

    # ----------------------------------------------------------------------------------- retargeting
    @abstractmethod
    def supports(self, source: Character, target: Character) -> str | None:
        """Reason why there is no answer; None where there is one."""

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Motion]:
        """The motions of the targets; those of one length and one pair of structures together."""
        for source, target in zip(sources, targets, strict=True):
            if why := self.supports(source.character, target):
                raise NotSupported(why)
        return self._retargeted(sources, [self.assigned(target) for target in targets], contexts)

    def _retargeted(
        self,
        sources: Sequence[Prediction],
        bodies: Sequence[tuple[str, LayoutBody]],
        contexts: Sequence[Context],
    ) -> list[Motion]:
        from retarget_bench.training.layers.skeletal.inference import retargeted

        motions = [source for source in sources if isinstance(source, Motion)]
        if len(motions) < len(sources):
            raise NotSupported(
                f"{self.card.name} reads rotations, and this source is known by positions only"
            )
        return retargeted(self, motions, bodies, contexts)
