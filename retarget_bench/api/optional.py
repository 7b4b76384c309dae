"""Optional methods and attributes of plug-ins beyond their contracts, with defaults.

Every function reads one of them, mostly of its own name. A plug-in offers it by having it; nothing is
declared, and no base class is needed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, Protocol, TypeGuard, TypeVar, cast

import numpy as np

from retarget_bench.api.cases import CaseInfo, TrainingPair
from retarget_bench.api.datasets import Cast, Dataset, Manifest, Unreadable
from retarget_bench.api.methods import BatchMethod, Context, Method, MethodCard
from retarget_bench.api.metrics import Metric, MetricCard, PairMetric, SetMetric
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Prediction

T = TypeVar("T")


def _offer(plugin: object, name: str, default: T, *arguments: object) -> T:
    """The result of an optional method; the default where a plug-in has none."""
    method = getattr(plugin, name, None)
    return default if method is None else cast(T, method(*arguments))


# ------------------------------------------------------------------------------------------ data sets
class TrainingPairs(Protocol):
    """Pairs by index, always the same under an index, each made or read when it is asked for.

    together: so many pairs in a row share their motions and are made together; ``bench train --prepare``,
    which makes all beforehand, asks for every ``together``-th.
    """

    @property
    def together(self) -> int: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> TrainingPair: ...


class FrameLabels(Protocol):
    """kind, phase: ``(frames,)``; touches: name -> ``(frames,)`` bool."""

    @property
    def kind(self) -> np.ndarray: ...
    @property
    def phase(self) -> np.ndarray: ...
    @property
    def touches(self) -> Mapping[str, np.ndarray]: ...


def training(data: object) -> Cast:
    """All clips to train on (``TrainingDataset``); empty where there are none."""
    return _offer(data, "training", {})


def validation(data: object) -> Dataset | None:
    """The validation part (``TrainingDataset``)."""
    return _offer(data, "validation", None)


def data_manifest(data: object) -> Manifest:
    """``training_manifest()`` of a ``TrainingDataset``; empty where there is none."""
    return _offer(data, "training_manifest", {})


def training_notes(data: object) -> tuple[str, ...]:
    """Sentences about the training part: what was left out and why, or why there is none."""
    return tuple(getattr(data, "training_notes", ()))


def unreadable(data: object) -> Unreadable | None:
    """The files of a data set that cannot be read; None where all can."""
    return cast(Unreadable | None, getattr(data, "unreadable", None))


def training_pairs(data: object) -> TrainingPairs | None:
    """The same performances by any two training bodies; none is in a case of any part. None: there are
    none with these parameters."""
    return _offer(data, "training_pairs", None)


def unseen(data: object, info: CaseInfo) -> Collection[str] | None:
    """Those of ``source``, ``target`` and ``kind`` of a case that the training part does not have; None
    where that is not known."""
    return _offer(data, "unseen", None, info)


def conditions(data: object, info: CaseInfo) -> Mapping[str, float]:
    """Conditions of a derived task's case, known without loading it: ``noise``, ``proportion``, ..."""
    return _offer(data, "conditions", {}, info)


def parts(data: Dataset) -> Mapping[str, Dataset]:
    """The parts that an export writes apart: ``train``, ``validation``, ``test``; all under "" where there
    are none."""
    return _offer(data, "parts", {"": data})


def labels(data: object, info: CaseInfo) -> FrameLabels | None:
    """Labels of every frame of a case, for exports."""
    return _offer(data, "labels", None, info)


# -------------------------------------------------------------------------------------------- methods
def stages(method: object) -> Mapping[str, Any]:
    """The methods that a method is composed of, each under the parameter that names its weights or is a
    path to them. Their code belongs to the keys of its results; its own ``weights_hash`` has their weights
    in it."""
    return getattr(method, "stages", {})


def stage_names(method: object) -> tuple[str, ...]:
    """The plug-ins that a method is composed of, and those that these are composed of."""
    each = stages(method).values()
    return tuple(name for one in each for name in (method_card(one).name, *stage_names(one)))


def weights_hash(method: object) -> str:
    """Identifies the weights in keys of results; "" for none. Raises BenchError where they are missing."""
    return str(getattr(method, "weights_hash", ""))


def weights_label(method: object) -> str:
    """The name in results of weights that are given by a path. Raises BenchError likewise."""
    return str(getattr(method, "weights_label", ""))


def method_manifest(method: object) -> Manifest | None:
    """``training_manifest``, else the card's ``trained_on``: the training data of a method's weights; None
    where it is untrained or does not say."""
    if hasattr(method, "training_manifest"):
        return cast(Manifest | None, method.training_manifest)
    return getattr(getattr(method, "card", None), "trained_on", None)


def training_share(method: object) -> float | None:
    """Frames that training of a method's weights has seen, over those of its paper's; None: not known."""
    return getattr(method, "training_share", None)


def warm_up(method: object) -> None:
    """Have a method load what all answers need, such as weights.

    Called once, before the first question, in the process that those that answer are forked from: what is
    loaded later is loaded anew for every batch."""
    _offer(method, "warm_up", None)


def reconstructed(
    method: Method, sources: Sequence[Any], targets: Sequence[Character], contexts: Sequence[Context]
) -> Sequence[Prediction]:
    """A method's answer to each source on the source's own body, where it is asked for a target.

    Most ask nothing of the target; one with networks for each kind of body takes the target's, and offers
    ``reconstruct_batch(sources, targets, contexts=contexts)``.
    """
    if hasattr(method, "reconstruct_batch"):
        return cast(Sequence[Prediction], method.reconstruct_batch(sources, targets, contexts=contexts))
    own = [source.character for source in sources]
    if takes_batches(method):
        return method.retarget_batch(sources, own, contexts=contexts)
    questions = zip(sources, own, contexts, strict=True)
    return [method.retarget(source, body, context=context) for source, body, context in questions]


def takes_batches(method: Method) -> TypeGuard[BatchMethod]:
    """True if a method takes several cases at once."""
    return callable(getattr(method, "retarget_batch", None))


def method_card(method: Any) -> MethodCard:
    """A method's card with every field: cards of a plug-in's own class may leave fields out, and one word
    may stand for a tuple of one."""
    stated: dict[str, Any] = {}
    for each in fields(MethodCard):
        value = getattr(method.card, each.name, MISSING)
        if value is not MISSING:
            one_word = isinstance(value, str) and each.name in ("accepts", "needs", "uses", "tasks")
            stated[each.name] = (value,) if one_word else value
    for name in ("accepts", "tasks"):
        if not stated.get(name):
            stated.pop(name, None)
    return MethodCard(**{"name": "", "summary": "", "version": "", **stated})


def root_rule(method: Any) -> str:
    """What a method or post-processor scales the root's path by, as its ``root_rule`` says; "": unknown."""
    return str(getattr(method, "root_rule", ""))


# -------------------------------------------------------------------------------------------- metrics
AnyMetric = Metric | PairMetric | SetMetric


def metric_tasks(metric: AnyMetric) -> tuple[str, ...]:
    """The tasks whose plain runs a metric takes part in."""
    return tuple(getattr(metric.card, "tasks", MetricCard.tasks))


def is_set_metric(metric: AnyMetric) -> TypeGuard[SetMetric]:
    """True if a metric compares sets: by its card, or, where that says nothing, by its methods."""
    kind = getattr(metric.card, "kind", "")
    return kind == "set" if kind else hasattr(metric, "features") and not is_pair_metric(metric)


def is_pair_metric(metric: AnyMetric) -> TypeGuard[PairMetric]:
    """True if a metric needs all clips of a pair of bodies: by its card, or else by its methods."""
    kind = getattr(metric.card, "kind", "")
    return kind == "pair" if kind else hasattr(metric, "extract") and not hasattr(metric, "compute")
