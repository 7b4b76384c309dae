"""SAN: skeleton-aware networks, an auto-encoder for each structure around codes of pooled skeletons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.api import MethodCard
from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion.character import Character
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.authors import AuthorsWeights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal import released_files
from retarget_bench.training.layers.skeletal.body import FOUR, LayoutBody, structure_key, tree_of
from retarget_bench.training.layers.skeletal.features import unfit
from retarget_bench.training.layers.skeletal.method import SkeletalMethod
from retarget_bench.training.layers.trained_structures import not_among, unknown

from .settings import DIFFERS, VARIANTS, SanConfig, Settings
from .skeleton import layout_of

if TYPE_CHECKING:
    from torch import Tensor

    from .structure import Structure
    from .training import SanTraining

SHORTEST = 32
"""Frames of a training window that discriminators have a patch of."""


class San(SkeletalMethod):
    """Skeleton-aware networks (Aberman, Li, Lischinski, Sorkine-Hornung, Cohen-Or, Chen: SIGGRAPH 2020).

    Every structure has an auto-encoder of skeletal convolutions and poolings, which collapse the skeleton
    to its chains, and an encoder of bones whose codes go into every layer. A code goes to the decoder of
    any structure. Training needs no pairs: motions are reconstructed and carried to the other structure,
    where a discriminator sees them; there they are to have the same code, and end effectors are to move
    alike.

    variant: ``released`` is what the authors' code does, with which their numbers were made; ``own`` the
    same networks, the root's slot mended, on bodies in hip heights that face ahead, with more weight on
    joint positions. The variant decides what is not given:

    neighbours: see ``Edges.neighbours``. root, lengths, path: see ``Features``. heights: see
        ``losses.Heights``. positions, cycle, ends, adversarial: see ``Weights``.
    target_stats: with ``own`` it leaks as the published numbers did (rows are marked privileged).
    structures: weights know the structures that they were trained on, with any bodies of these.
    weights: with ``variant=released`` also the authors' folder ``pretrained``, see docs/methods.md.
    """

    Config = SanConfig
    config: SanConfig
    card = MethodCard(
        name="san",
        title="SAN",
        summary="Skeletal convolutions and poolings: auto-encoders of structures around one code",
        version="1",
        paper="Aberman, Li, Lischinski, Sorkine-Hornung, Cohen-Or, Chen: Skeleton-Aware Networks for "
        "Deep Motion Retargeting, SIGGRAPH 2020",
        authors_weights="retargeting/pretrained of github.com/DeepMotionEditing/deep-motion-editing; "
        "weights=that folder (with variant=released)",
        published=({"variant": "released"},),
        default=False,
        apart="for the structures in the training data alone",
    )
    presets: Mapping[str, TrainingConfig] = {
        "paper": TrainingConfig(steps=150_000, batch=512, window=64, rate=2e-4, validate=2000),
        "default": TrainingConfig(
            steps=20_000,
            batch=16,
            window=64,
            rate=1e-3,
            schedule="cosine",
            warm_up=100,
            validate=200,
            average=0.999,
        ),
    }

    def __init__(self, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.settings: Settings = VARIANTS[self.config.variant].overridden(self.config)
        differs = DIFFERS if self.config.variant == "own" else {}
        self.card = replace(type(self).card, differs=differs, needs=self._privileged())

    # ------------------------------------------------------------------------------------------ bodies
    def unfit(self, character: Character) -> str:
        return not_among(character, self.config.structures, self.card.name) or self._unseen(character)

    def _unseen(self, character: Character) -> str:
        """Reason why a body has no features; "" where it has."""
        try:
            self.body(character)
        except SkeletonError as error:
            return str(error)
        return unfit(character, self.settings.features)

    def body(self, character: Character) -> LayoutBody:
        return _body(character, self.settings.rerooted)

    def assigned(self, character: Character) -> tuple[str, LayoutBody]:
        return structure_key(character), self.body(character)

    # ---------------------------------------------------------------------------------------- training
    def facts(self) -> Mapping[str, Scalar]:
        return {
            "variant": self.config.variant,
            "structures": self.config.structures,
            **self.settings.values(),
        }

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SanTraining:
        """Raises NotSupported where bodies of one structure differ in joints, or there is one body only."""
        from .training import SanTraining

        if config.window % 4 or config.window < SHORTEST:
            raise NotSupported(
                f"windows of san are a multiple of 4 and {SHORTEST} or more, and not {config.window}"
            )

        return SanTraining(training_data, config, self.bodies(training_data), self.settings, self.using)

    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:
        if (files := released_files.of_mixamo(path)) is None:
            return None

        def read() -> Mapping[str, Tensor]:
            from . import released

            return released.read(files)

        return AuthorsWeights(path, files.paths, read, released_files.NOTE, cls(variant="released").facts())

    # ----------------------------------------------------------------------------------- retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        if self.untrained:
            return self.untrained
        layouts = {name: networks.layout for name, networks in self.structures.items()}
        names = [name.removesuffix(f"_{FOUR}") for name in layouts]
        for each in (source, target):
            if why := self._unseen(each):
                return why
            key, body = self.assigned(each)
            if why := unknown(each, layouts, key, body.layout, names):
                return why
        return None

    @cached_property
    def structures(self) -> Mapping[str, Structure]:
        """The networks by structure. Raises BenchError where there are no weights."""
        from retarget_bench.training.layers.skeletal.structure import by_structure

        from .structure import rebuilt

        by_name = by_structure(self.tensors)
        return {name: rebuilt(tensors, self.settings.design) for name, tensors in by_name.items()}


@lru_cache(maxsize=1024)
def _body(character: Character, turned: bool) -> LayoutBody:
    """The joints that position errors count, those at and below the hips, in a layout of their own."""
    parents, joints = tree_of(character, turned)
    return LayoutBody(character, layout_of(parents, [character.roles[joint] for joint in joints]), joints)


plugin = San
