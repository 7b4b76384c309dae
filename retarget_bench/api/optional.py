"""Optional offers of plug-ins beyond their contract, and the functions by which the engine reads them.

Each protocol is one optional method or attribute. A plug-in offers it by having it; nothing is declared.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np

from retarget_bench.api.cases import CaseInfo, TrainingPair
from retarget_bench.api.datasets import (
    Cast,
    Dataset,
    Manifest,
    OffersTraining,
    OffersTrainingManifest,
    OffersValidation,
)
from retarget_bench.api.methods import BatchMethod, Context, Method, MethodCard
from retarget_bench.api.metrics import Metric, MetricCard, SetMetric
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Prediction


# ------------------------------------------------------------------------------------------ data sets
@runtime_checkable
class OffersTrainingNotes(Protocol):
    @property
    def training_notes(self) -> Sequence[str]:
        """Sentences about the training part: what was left out and why, or why there is none."""


class TrainingPairs(Protocol):
    """Pairs by index, always the same under an index, each made or read when it is asked for.

    together: so many pairs in a row share their motions and are made together: who draws at random loses
    nothing, who makes all beforehand (``bench train --prepare``) asks for every ``together``-th.
    """

    @property
    def together(self) -> int: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> TrainingPair: ...


@runtime_checkable
class OffersTrainingPairs(Protocol):
    def training_pairs(self) -> TrainingPairs | None:
        """The same performances by any two training bodies; none is in a case of any part. None: there are
        none with these parameters."""


@runtime_checkable
class OffersUnseen(Protocol):
    def unseen(self, info: CaseInfo) -> Collection[str]:
        """Those of ``source``, ``target`` and ``kind`` of a case that the training part does not have."""


@runtime_checkable
class OffersConditions(Protocol):
    def conditions(self, info: CaseInfo) -> Mapping[str, float]:
        """Conditions of a derived task's case, known without loading it: ``noise``, ``proportion``, ..."""


@runtime_checkable
class OffersParts(Protocol):
    def parts(self) -> Mapping[str, Dataset]:
        """The parts that an export writes apart: ``train``, ``validation``, ``test``."""


@runtime_checkable
class OffersLabels(Protocol):
    def labels(self, info: CaseInfo) -> FrameLabels:
        """Labels of every frame of a case, for exports."""


class FrameLabels(Protocol):
    """kind, phase: ``(frames,)``; touches: name -> ``(frames,)`` bool."""

    @property
    def kind(self) -> np.ndarray: ...
    @property
    def phase(self) -> np.ndarray: ...
    @property
    def touches(self) -> Mapping[str, np.ndarray]: ...


def training(data: object) -> Cast:
    """All that there is to train on; empty where there is nothing."""
    return data.training() if isinstance(data, OffersTraining) else {}


def validation(data: object) -> Dataset | None:
    return data.validation() if isinstance(data, OffersValidation) else None


def data_manifest(data: object) -> Manifest:
    """The manifest of a data set's training part; empty where it offers none."""
    return data.training_manifest() if isinstance(data, OffersTrainingManifest) else {}


def training_notes(data: object) -> tuple[str, ...]:
    return tuple(data.training_notes) if isinstance(data, OffersTrainingNotes) else ()


def training_pairs(data: object) -> TrainingPairs | None:
    """The pairs to train on; None where a data set offers none."""
    return data.training_pairs() if isinstance(data, OffersTrainingPairs) else None


def parts(data: Dataset) -> Mapping[str, Dataset]:
    """The parts of a data set; the whole under "" where it has none."""
    return data.parts() if isinstance(data, OffersParts) else {"": data}


# -------------------------------------------------------------------------------------------- methods
@runtime_checkable
class OffersWeights(Protocol):
    """A method with weights. Reading either attribute raises BenchError where they are missing."""

    @property
    def weights_hash(self) -> str:
        """Identifies the weights in keys of results; "" for none."""

    @property
    def weights_label(self) -> str:
        """The name in results of weights that are given by a path."""


@runtime_checkable
class OffersManifest(Protocol):
    @property
    def training_manifest(self) -> Manifest | None:
        """The training data of the weights; None: untrained."""


@runtime_checkable
class OffersAttention(Protocol):
    def attention(self, source: Motion) -> Mapping[str, Any]:
        """The fields of ``evaluation.attention.Attention``; ``note`` may be left out. Raises NotSupported
        where there is no attention to show. A run never calls it."""


@runtime_checkable
class OffersStages(Protocol):
    """A method that is composed of others. Their code belongs to the keys of its results; its own
    ``weights_hash`` has their weights in it."""

    @property
    def stages(self) -> Mapping[str, Any]:
        """The others, each under the parameter that names its weights or is a path to them."""


def stages(method: object) -> Mapping[str, Any]:
    """The methods that a method is composed of; none of most."""
    return method.stages if isinstance(method, OffersStages) else {}


def stage_names(method: object) -> tuple[str, ...]:
    """The plug-ins that a method is composed of, and those that these are composed of."""
    each = stages(method).values()
    return tuple(name for one in each for name in (method_card(one).name, *stage_names(one)))


def weights_hash(method: object) -> str:
    return str(getattr(method, "weights_hash", ""))


def weights_label(method: object) -> str:
    return str(getattr(method, "weights_label", ""))


def method_manifest(method: object) -> Manifest | None:
    """The training data of a method's weights; None where it is untrained or does not say."""
    if isinstance(method, OffersManifest):
        return method.training_manifest
    return getattr(getattr(method, "card", None), "trained_on", None)


def training_share(method: object) -> float | None:
    """Frames that training of a method's weights has seen, over those of its paper's; None: not known."""
    return getattr(method, "training_share", None)


@runtime_checkable
class OffersWarmUp(Protocol):
    def warm_up(self) -> None:
        """Load what all answers need, such as weights. Called once, before the first question, in the
        process that those that answer are forked from: what is loaded later is loaded anew for every
        batch."""


def warm_up(method: object) -> None:
    """Have a method load what it needs, where it offers that."""
    if isinstance(method, OffersWarmUp):
        method.warm_up()


@runtime_checkable
class OffersReconstruction(Protocol):
    def reconstruct_batch(
        self, sources: Sequence[Any], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> Sequence[Prediction]:
        """The sources on their own bodies, by the networks that answer for each target."""


def reconstructed(
    method: Method, sources: Sequence[Any], targets: Sequence[Character], contexts: Sequence[Context]
) -> Sequence[Prediction]:
    """What a method makes of each source on the source's own body, where it is asked for a target.

    Most ask nothing of the target; one with networks for each kind of body takes the target's.
    """
    if isinstance(method, OffersReconstruction):
        return method.reconstruct_batch(sources, targets, contexts=contexts)
    own = [source.character for source in sources]
    if takes_batches(method):
        return method.retarget_batch(sources, own, contexts=contexts)
    asked = zip(sources, own, contexts, strict=True)
    return [method.retarget(source, body, context=context) for source, body, context in asked]


def takes_batches(method: Method) -> TypeGuard[BatchMethod]:
    """True if a method takes several cases at once."""
    return callable(getattr(method, "retarget_batch", None))


def method_card(method: Any) -> MethodCard:
    """A method's card with every field: cards of a plug-in's own class may leave fields out, and one word
    may stand for a tuple of one."""
    said: dict[str, Any] = {}
    for each in fields(MethodCard):
        value = getattr(method.card, each.name, MISSING)
        if value is not MISSING:
            one_word = isinstance(value, str) and each.name in ("accepts", "needs", "uses", "tasks")
            said[each.name] = (value,) if one_word else value
    for name in ("accepts", "tasks"):
        if not said.get(name):
            said.pop(name, None)
    return MethodCard(**{"name": "", "summary": "", "version": "", **said})


# -------------------------------------------------------------------------------------------- metrics
def metric_tasks(metric: Metric | SetMetric) -> tuple[str, ...]:
    """The tasks whose plain runs a metric takes part in."""
    return tuple(getattr(metric.card, "tasks", MetricCard.tasks))


def is_set_metric(metric: Metric | SetMetric) -> TypeGuard[SetMetric]:
    """True if a metric compares sets: by its card, or, where that says nothing, by its methods."""
    kind = getattr(metric.card, "kind", "")
    return kind == "set" if kind else hasattr(metric, "features")
