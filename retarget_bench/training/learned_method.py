"""Base class of learned methods: weights by name or by path, read when they are needed.

A method derives from ``LearnedMethod``, has its parameters as a dataclass ``Config`` and takes
``self.tensors`` where it retargets; docs/plugins.md has an example. Building one is cheap, whether or not
there are weights: training builds it too.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from retarget_bench.api import Ablation, Context, Method, MethodCard, TrainingShare
from retarget_bench.errors import BenchError
from retarget_bench.motion import body22
from retarget_bench.motion.character import Character
from retarget_bench.plugins import named, registry
from retarget_bench.plugins.parameters import documented
from retarget_bench.plugins.spec import Scalar, Spec
from retarget_bench.results.header import AUTHORS
from retarget_bench.training import variants
from retarget_bench.training import weights as bundles
from retarget_bench.training.authors import AuthorsWeights
from retarget_bench.training.record import Record
from retarget_bench.training.tensor_files import verify

if TYPE_CHECKING:
    from torch import Tensor


def of_weights(name: str, weights: str, **others: Scalar) -> Any:
    """A learned method with some weights, and with the parameters that these were trained with.

    weights: a name or a path. others: parameters that weights do not depend on. Raises BenchError where
    there are no such weights, unless they go by the default name: then the method is untrained.
    """
    factory: Any = registry.load("methods", name)
    there = weights != factory.Config.weights or weights in factory.shipped()
    facts = factory.card_of(weights).facts if there else {}
    return registry.create("methods", Spec(name, {**facts, "weights": weights, **others}))


@dataclass(frozen=True)
class WeightsConfig:
    """Of a method without other parameters."""

    weights: str = "none"
    """a path to weights, as of a folder of bench train"""


class LearnedMethod(Method):
    """A method with weights.

    Config: a frozen dataclass of the parameters; a docstring under each field says what it is, in
        ``bench info`` and in the card. It has ``weights``: the name of weights in the folder ``weights``
        beside the method's module, or a path: of a card, of a file of tensors, of a folder that
        ``bench train`` wrote, or to ``authors_weights``. Raises BenchError for what cannot be.
    over_roles: whether it sees bodies over the 22 roles of ``motion/body22.py``, in hip heights.
    answering: parameters that answers depend on and weights do not, beside ``weights``.
    """

    Config: ClassVar[type[Any]] = WeightsConfig
    config: Any
    over_roles: ClassVar[bool] = False
    answering: ClassVar[tuple[str, ...]] = ()
    card: MethodCard

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.__signature__ = inspect.signature(cls.Config)  # type: ignore[attr-defined]
        if isinstance(card := vars(cls).get("card"), MethodCard):
            cls.card = replace(card, parameters=documented(cls.Config))

    def __init__(self, **parameters: Scalar) -> None:
        self.config = self.Config(**parameters)

    def facts(self) -> Mapping[str, Scalar]:
        """The parameters that weights depend on: another value needs other weights."""
        free = {"weights", *self.answering}
        return {name: value for name, value in vars(self.config).items() if name not in free}

    @classmethod
    def authors_weights(cls, path: Path) -> AuthorsWeights | None:  # noqa: ARG003
        """The files of the paper's authors at a path; None where there are none.

        Raises FileError where some of them are missing."""
        return None

    # -------------------------------------------------------------------------------- what is known
    @property
    def weights_card(self) -> Record | None:
        """The card of the weights; None where none of the method's default name are shipped.

        Raises BenchError where they are another method's, another version's, or were trained with other
        parameters, and where a name or path that was asked for leads nowhere.
        """
        return self._card

    @property
    def weights_hash(self) -> str:
        """The hash of the weights in results; "" where there are none.

        Raises FileError where the tensors are not those that the card describes: results of others would
        be shown as theirs.
        """
        if not self._card:
            return ""
        if self._at is not None and self._authors is None:  # whose hash is of their bytes
            verify(self._at, self._card.hash)
        return self._card.hash

    @property
    def weights_label(self) -> str:
        """The name of shipped weights; else ``local-``, or ``authors-`` where they are those of the
        paper's authors, and the head of their hash."""
        if self._card is None or self._at in self.shipped().values():
            return str(self.config.weights)
        return f"{AUTHORS if self._authors else 'local-'}{self.weights_hash[:8]}"

    @property
    def training_manifest(self) -> Mapping[str, Sequence[str]] | None:
        """Training data of the weights; None where there are none, or no manifest."""
        return self._card.training_manifest if self._card else None

    @property
    def training_share(self) -> TrainingShare | None:
        """Of the preset ``paper``. None where there is no paper or no such preset, where there are no
        weights, and where their card does not say."""
        paper = getattr(self, "presets", {}).get("paper") if self.card.paper else None
        if paper is None or self._card is None or not self._card.frames:
            return None
        whole = paper.steps * paper.batch * paper.window
        return TrainingShare(self._card.frames / whole, self._card.uncounted)

    @property
    def untrained(self) -> str:
        """Reason why this method cannot retarget as it is, for ``supports``; "" where it can."""
        if "tensors" in self.__dict__ or self._card:
            return ""
        name, others = self.card.name, ", ".join(self.shipped())
        if others:
            return f"{name} has no weights {self.config.weights!r}; there are {others}"
        return f"{name} has no weights; bench train {named.written(Spec(name), places=False)} makes some"

    @property
    def usual_weights(self) -> str:
        """The name of the weights where none is given."""
        return str(self.Config.weights)

    @classmethod
    def shipped(cls) -> dict[str, Path]:
        """Name -> card of the weights that lie beside the method's module."""
        folder = cls._folder()
        cards = sorted((folder / "weights").glob("*.json")) if folder else []
        return {path.stem: path for path in cards}

    @classmethod
    def _folder(cls) -> Path | None:
        """Where the method's module is; None where it is in no file."""
        module = getattr(sys.modules.get(cls.__module__), "__file__", None)
        return Path(module).parent if module else None

    @cached_property
    def ablations(self) -> Mapping[str, Ablation]:
        """Those in ``ablations.toml`` beside the method's module."""
        folder = self._folder()
        path = folder / "ablations.toml" if folder else None
        return variants.read(path, Ablation) if path and path.exists() else {}

    @classmethod
    def card_of(cls, weights: str) -> Record:
        """The card of shipped weights, or of those at a path. Raises FileError."""
        if authors := cls.authors_weights(Path(weights).expanduser()):
            return authors.card(cls(weights=weights).card)
        return bundles.read_card(cls.shipped().get(weights) or bundles.locate(weights))

    def warm_up(self) -> None:
        """Load the weights and all that is made of them once (``cached_property``), where there are any."""
        if self.untrained:
            return
        for name in dir(self):
            if isinstance(inspect.getattr_static(type(self), name, None), cached_property):
                with suppress(BenchError):  # to be told where an answer needs it
                    getattr(self, name)

    # --------------------------------------------------------------------------------- retargeting
    def unfit(self, character: Character) -> str:
        """Reason why a body can be neither source nor target nor trained on; "" if it can."""
        return body22.unfit(character, self.card.name) if self.over_roles else ""

    def supports(self, source: Character, target: Character) -> str | None:
        """Reason why there is no answer; None where there is one."""
        return self.untrained or self.unfit(source) or self.unfit(target) or None

    def retarget(self, source: Any, target: Character, *, context: Context) -> Any:
        """An answer alone, of a method that answers batches (``retarget_batch``)."""
        batched: Any = self
        return batched.retarget_batch([source], [target], contexts=[context])[0]

    # ------------------------------------------------------------------------------------- tensors
    @cached_property
    def tensors(self) -> Mapping[str, Tensor]:
        """The weights, read and verified. Raises BenchError where there are none or they do not fit."""
        if self._at is None or self._card is None:
            raise BenchError(self.untrained)
        if self._authors is not None:
            return self._authors.read()
        return bundles.read(self._at).tensors

    def using(self, tensors: Mapping[str, Tensor]) -> Self:
        """A method of the same parameters with these tensors, whatever its weights are: for training."""
        other = type(self)(**vars(self.config))
        other.__dict__.update(tensors=tensors, _authors=None, _at=None, _card=None)
        return other

    @cached_property
    def _authors(self) -> AuthorsWeights | None:
        """The authors' weights where there are some at the path; they fit the parameters."""
        authors = self.authors_weights(Path(self.config.weights).expanduser())
        if authors is not None:
            authors.check(self.card.name, self.facts())
        return authors

    @cached_property
    def _at(self) -> Path | None:
        """The card, or the authors' files; None where there is none under the default name."""
        if self._authors is not None:
            return self._authors.path
        shipped = self.shipped()
        if self.config.weights in shipped:
            return shipped[self.config.weights]
        if self.config.weights == self.usual_weights:
            return None
        path = Path(self.config.weights).expanduser()
        if path.suffix in (".json", ".safetensors") or len(path.parts) > 1 or path.is_dir():
            return bundles.locate(path)
        raise BenchError(
            f"{self.card.name} has no shipped weights of the name {self.config.weights!r}; "
            f"{'there are ' + ', '.join(shipped) if shipped else 'there are none'}, and a path leads to "
            "others"
        )

    @cached_property
    def _card(self) -> Record | None:
        if self._at is None:
            return None
        if self._authors is not None:
            return self._authors.card(self.card)
        card = bundles.read_card(self._at)
        self.check_weights(self._at, card)
        return card

    def check_weights(self, path: str | Path, card: Record) -> None:
        """Raises BenchError where weights with this card are not this method's, as it is."""
        known, facts = self._completed(card.facts), self.facts()
        if newer := [name for name in facts.keys() - card.facts if facts[name] != known.get(name)]:
            raise BenchError(
                f"{path}: these weights are older than {self.card.name}'s parameter {newer[0]}; leave "
                f"it at its default {known.get(newer[0])}, train others, or, where answers alone depend on "
                "it, name it in the method's answering"
            )
        bundles.check(path, replace(card, facts=known), self.card.name, self.card.version, facts)

    def _completed(self, facts: Mapping[str, Any]) -> Mapping[str, Any]:
        """A card's facts with the defaults of parameters that are newer than it."""
        try:
            return {**type(self)(**facts).facts(), **facts}
        except (TypeError, BenchError):  # those of another method, or with fewer parameters now
            return facts
