"""SAN: skeleton-aware networks, an auto-encoder for each structure around codes of pooled skeletons."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from retarget_bench.api import Method, MethodCard
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

from .settings import DIFFERS, PARAMETERS, SETTINGS, Overrides, Settings, Variant
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
    joint positions. Where a parameter is empty or negative, the variant decides:

    neighbours: of the root's slot, see ``Edges.neighbours``. root, lengths, path: the features of motions,
        see ``Features``.
    statistics: mean and deviation by ``structure`` or, as released, by ``character``. target_stats: by
        character, the statistics that an answer gets: ``transferred`` those of training; ``own`` those of
        the target's reference motions, which is the leak of the published numbers (rows are marked
        privileged).
    heights: that the movement of end effectors is compared in; see ``losses.Heights``.
    positions, cycle, ends, adversarial: weights, see ``Weights``.
    structures: what is trained on: ``two_legged``, ``all``, or names of structures joined by ``+``. Weights
        know the structures that they were trained on, with any bodies of these.
    tips: ends of chains, which no edge turns: ``copied`` relative to their parents, or ``rest``.
    weights: with ``variant=released`` also the authors' folder ``pretrained``, see docs/methods.md.
    """

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
        "quick": TrainingConfig(
            steps=20, batch=8, window=32, rate=1e-3, validate=20, cases=2, average=0.999
        ),
    }

    def __init__(
        self, variant: Variant = "own", weights: str = "puppets", **overrides: Annotated[Any, Overrides]
    ) -> None:
        super().__init__(weights)
        options = asdict(Overrides(**overrides))
        self.variant, self.target_stats, self.tips = variant, options["target_stats"], options["tips"]
        self.allowed = options["structures"]
        self.settings: Settings = SETTINGS[variant].overridden(options)
        self.card = MethodCard(
            name="san",
            title="SAN",
            summary="Skeletal convolutions and poolings: auto-encoders of structures around one code",
            version="1",
            paper="Aberman, Li, Lischinski, Sorkine-Hornung, Cohen-Or, Chen: Skeleton-Aware Networks for "
            "Deep Motion Retargeting, SIGGRAPH 2020",
            published=({"variant": "released"},),
            differs=DIFFERS if variant == "own" else {},
            needs=self._privileged(),
            default=False,
            apart="for the structures in the training data alone",
            parameters=PARAMETERS,
        )

    # ------------------------------------------------------------------------------------------ bodies
    def unfit(self, character: Character) -> str:
        return not_among(character, self.allowed, self.card.name) or self._unseen(character)

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
        return {"variant": self.variant, "structures": self.allowed, **self.settings.values()}

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> SanTraining:
        """Raises NotSupported where bodies of one structure differ in joints, or there is one body only."""
        from .training import SanTraining

        if config.window % 4 or config.window < SHORTEST:
            raise NotSupported(
                f"windows of san are a multiple of 4 and {SHORTEST} or more, and not {config.window}"
            )

        def trained(tensors: Mapping[str, Tensor]) -> Method:
            same = {"path": self.settings.features.path, "tips": self.tips}
            return San(**{**self.facts(), **same}, target_stats=self.target_stats).using(tensors)

        return SanTraining(training_data, config, self.bodies(training_data), self.settings, trained)

    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:
        if (files := released_files.of_mixamo(path)) is None:
            return None

        def read() -> Mapping[str, Tensor]:
            from . import released

            return released.read(files)

        return AuthorsWeights(path, files.paths, read, released_files.NOTE, cls("released").facts())

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
__all__ = ["PARAMETERS", "San", "plugin"]
