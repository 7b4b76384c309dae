"""PAN: pose-aware attention by body part, between any structures that have parts in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import BenchError, NotSupported, SkeletonError
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.authors import AuthorsWeights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal import released_files
from retarget_bench.training.layers.skeletal.body import FOUR, LayoutBody, tree_of
from retarget_bench.training.layers.skeletal.features import unfit
from retarget_bench.training.layers.skeletal.method import SkeletalMethod

from .assignment import Assignment, assign, in_layout
from .parts import layout_of, parts_of
from .settings import DIFFERS, VARIANTS, Design, PanConfig, Settings

if TYPE_CHECKING:
    from torch import Tensor

    from .structure import Structure
    from .training import PanTraining


OWN, BETWEEN = "puppets", "puppets_three"
"""Names of shipped weights: for people, and for people and dogs."""


class Pan(SkeletalMethod):
    """Pose-aware attention network (Hu, Zhang, Zhong, Jiang, Xia: TVCG 2023).

    Every structure has a motion encoder, a skeleton encoder and a decoder. The encoder pools edges of the
    skeleton (see ``Layout``) into tokens of body parts by attention and shortens time by convolutions; a
    code goes to the decoder of any structure, added to the code of the target's bones. Training needs no
    pairs: motions are reconstructed, carried to the other structure, where a discriminator sees them, and
    back.

    variant: ``paper`` is sections 3 to 5 as written; ``released`` what the authors' code does, mistakes
    included, with which their numbers were made; ``own`` the released networks without these and without
    dropout, on bodies in hip heights that face ahead, with more weight on joint positions. The variant
    decides what is not given:

    root, lengths, facing, path: the features of motions; see ``Features``. conv_mask, decoder: see
        ``Design``.
    target_stats: with ``own`` it leaks as the published numbers did (rows are marked privileged).
    parts: with ``three`` arms and tails are decoded and not encoded; it is for two legs and four.
    weights: with ``parts=three``, ``puppets`` means ``puppets_three``. With ``variant=released`` also the
        authors' folders ``pretrained_mixamo`` and ``pretrained_lafan1dog``, see docs/methods.md.

    A body of another structure goes through the known one that shares most roles with it; joints that it
    lacks are bones of no length (section 6.2.3).
    """

    Config = PanConfig
    config: PanConfig
    card = MethodCard(
        name="pan",
        title="PAN",
        summary="Attention by body part: codes that any structure with these parts can decode",
        version="1",
        paper="Hu, Zhang, Zhong, Jiang, Xia: Pose-aware Attention Network for Flexible Motion "
        "Retargeting by Body Part, TVCG 2023",
        authors_weights="run download_pretrained.sh of github.com/hlcdyy/pan-motion-retargeting; "
        "weights=its pretrained_mixamo, or with parts=three pretrained_lafan1dog (with "
        "variant=released)",
        published=(
            {"variant": "released"},
            {"variant": "released", "parts": "three"},
            {"variant": "paper"},
            {"variant": "paper", "parts": "three"},
        ),
    )
    presets: Mapping[str, TrainingConfig] = {
        "paper": TrainingConfig(steps=150_000, batch=256, window=64, rate=1e-3, validate=2000),
        "default": TrainingConfig(
            steps=20_000,
            batch=16,
            window=64,
            rate=3e-4,
            schedule="cosine",
            warm_up=100,
            validate=200,
            average=0.999,
        ),
        "ablation": TrainingConfig(
            steps=5000, batch=4, window=32, rate=3e-4, schedule="cosine", warm_up=100, validate=2500
        ),
    }

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.parts, self._part_map = parts_of(self.config.parts)
        three = self.parts == "three"
        if three and self.config.weights == OWN:
            self.config = replace(self.config, weights=BETWEEN)
        variant = VARIANTS[self.config.variant + "_three" * three]
        self.settings: Settings = variant.overridden(self.config)
        self.yaw = self.settings.yaw
        own = self.config.variant == "own"
        differs = DIFFERS["three" if three else "six"] if own else {}
        self.card = replace(type(self).card, differs=differs, needs=self._privileged())

    # ---------------------------------------------------------------------------------------- training
    def facts(self) -> Mapping[str, Scalar]:
        return {"variant": self.config.variant, "parts": self.parts, **self.settings.values()}

    @property
    def usual_weights(self) -> str:
        return BETWEEN if self.parts == "three" else OWN

    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:
        if (files := released_files.of_mixamo(path)) is not None:
            method = cls(variant="released", weights=str(path))
        elif (files := released_files.between_legs(path)) is not None:
            method = cls(variant="released", parts="three", weights=str(path))
        else:
            return None

        def read() -> Mapping[str, Tensor]:
            from . import released

            return released.read(files, method.parts, method.design)

        return AuthorsWeights(path, files.paths, read, released_files.NOTE, method.facts())

    @property
    def root_bone(self) -> bool:
        return super().root_bone and self.parts == "six"

    @property
    def design(self) -> Design:
        """The design of the networks that the weights are of."""
        return replace(self.settings.design, root_bone=self.root_bone)

    def unfit(self, character: Character) -> str:
        if character.four_legged and self.parts == "six":
            return (
                f"{character.name} stands on four legs; pan[parts=three] is for bodies of two and of four"
            )
        try:
            self.body(character)
        except SkeletonError as error:
            return str(error)
        except BenchError as error:
            return f"{character.name}: {error}"
        return unfit(character, self.settings.features)

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> PanTraining:
        """Raises NotSupported where bodies of one structure differ in joints, or there is one body only."""
        from .training import PanTraining

        if config.window % 4 or config.window < 16:
            raise NotSupported(
                f"windows of pan are a multiple of 4 and 16 or more, and not {config.window}"
            )

        return PanTraining(training_data, config, self.bodies(training_data), self.settings, self.using)

    def body(self, character: Character) -> LayoutBody:
        parents, joints = tree_of(character, self.settings.rerooted)
        roles = [character.roles[joint] for joint in joints]
        slots = self.settings.design.slots
        layout = layout_of(parents, roles, self._part_map, character.four_legged, slots)
        return LayoutBody(character, layout, joints)

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if self.untrained:
            return self.untrained
        for each in (source, target):
            if why := unfit(each, self.settings.features):
                return why
            try:
                self.assignment(each)
            except (NotSupported, SkeletonError) as error:
                return str(error)
        return None

    def assignment(self, character: Character) -> Assignment:
        """The structure that a character goes through; see ``assign``."""
        if character not in self._assignments:
            self._assignments[character] = assign(character, self.structures)
        return self._assignments[character]

    def assigned(self, character: Character) -> tuple[str, LayoutBody]:
        assignment = self.assignment(character)
        return assignment.structure, assignment.body

    def reconstruct_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Motion]:
        """The sources on their own bodies, decoded by the networks of each target's structure where it
        stands on as many legs: so the same is lost there as in the answer (``+residual``)."""
        bodies = []
        for source, target in zip(sources, targets, strict=True):
            actor, body = source.character, target
            if actor.four_legged != target.four_legged:
                body = actor
            structure, _ = self.assigned(body)
            bodies.append((structure, in_layout(actor, self.structures[structure].layout)))
        return self._retargeted(sources, bodies, contexts)

    @cached_property
    def _assignments(self) -> dict[Character, Assignment]:
        return {}

    @cached_property
    def structures(self) -> Mapping[str, Structure]:
        """The networks by structure. Raises BenchError where there are no weights."""
        from retarget_bench.training.layers.skeletal.structure import by_structure

        from .structure import rebuilt

        return {
            name: rebuilt(tensors, self._part_map, name.endswith(FOUR), self.design)
            for name, tensors in by_structure(self.tensors).items()
        }

    def attention(self, source: Motion) -> Mapping[str, Any]:
        """Attention of body parts to joints (``retarget_bench/evaluation/attention.py``)."""
        from .attention_weights import attended

        return attended(self, source)


plugin = Pan
