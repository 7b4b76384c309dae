"""First stage: a method turns a case's source into a prediction file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from retarget_bench.api import Case, CaseInfo, Context, Dataset, Method, Prediction
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import NotSupported, one_line
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion, Positions, Surface, kind_of
from retarget_bench.plugins.post_processors import Composed
from retarget_bench.plugins.prediction_check import EMPTY, Invalid, verified

APART = 1e-3
"""Shares of the height by which the two answers may differ: networks round."""


@dataclass(frozen=True)
class Outcome:
    """The outcome of one case: a prediction, or a status with a message."""

    status: str
    message: str = ""
    prediction: Prediction | None = None


def predict(method: Method, case: Case, context: Context) -> Outcome:
    """Ask a method for one case. Whatever it does wrong becomes a status, never an exception."""
    try:
        if reason := refusal(method, case):
            return Outcome("unsupported", reason)
        # its own copy of the source: others are asked about the same case
        answer = method.retarget(case.source.copy(), case.target, context=context)
        return Outcome("ok", prediction=verified(answer, case))
    except NotSupported as error:
        return Outcome("unsupported", str(error))
    except Invalid as error:
        return Outcome("invalid", str(error))
    except (Exception, KeyboardInterrupt, SystemExit) as error:  # the method's own fault
        return Outcome("failed", one_line(error))


def predict_all(method: Method, cases: Sequence[Case], contexts: Sequence[Context]) -> list[Outcome]:
    """Ask a method for several cases, at once if it can (``retarget_batch``).

    What it refuses is not part of the batch. Where the batch fails or an answer is not valid, all are
    asked one by one, so that a fault costs its own row. An interrupt costs all of them.
    """
    pairs = list(zip(cases, contexts, strict=True))
    try:
        batch = method.retarget_batch is not None
        together = [number for number, case in enumerate(cases) if batch and _takes(method, case)]
        answers = _at_once(method, [pairs[number] for number in together])
    except KeyboardInterrupt as error:
        return [Outcome("failed", one_line(error)) for _ in pairs]
    outcomes = dict(zip(together, answers, strict=False))
    return [outcomes.get(number) or predict(method, *pair) for number, pair in enumerate(pairs)]


def _takes(method: Method, case: Case) -> bool:
    try:
        return not refusal(method, case)
    except Exception:  # to be told of that case alone
        return False


def _at_once(method: Method, pairs: Sequence[tuple[Case, Context]]) -> list[Outcome]:
    """The outcomes of a batch, all ok; none where there is no batch, or anything is wrong with it."""
    if method.retarget_batch is None or len(pairs) < 2:
        return []
    try:
        answers = ask_batch(method, pairs)
        each = zip(answers, pairs, strict=True)
        return [Outcome("ok", prediction=verified(answer, case)) for answer, (case, _) in each]
    except Exception:  # told of the case at fault, when it is asked alone
        return []


def ask_batch(method: Method, pairs: Sequence[tuple[Case, Context]]) -> Sequence[object]:
    """The unchecked answers of ``retarget_batch`` to cases that the method does not refuse."""
    sources = [case.source.copy() for case, _ in pairs]
    targets = [case.target for case, _ in pairs]
    assert method.retarget_batch is not None
    return method.retarget_batch(sources, targets, contexts=[context for _, context in pairs])


def refusal(method: Method, case: Case) -> str | None:
    """The reason why a method cannot be asked this case, or None."""
    if not case.source.frames:
        return EMPTY
    kind, card = kind_of(case.source), method.card
    source_motion = case.source_motion if "source_motion" in card.needs else None
    if kind not in card.accepts and source_motion is None:
        return f"takes {' or '.join(card.accepts)} as source, but this source is known by {kind} only"
    if "reference" in card.needs and case.reference is None:
        return "needs the reference, and this case has none"
    if "second_reference" in card.needs and case.alternative is None:
        return "needs a second right answer, and this data set knows of none"
    if "source_motion" in card.needs and source_motion is None and not isinstance(case.source, Motion):
        return "needs the motion that the source is made of, and this case does not have it"
    return method.supports((source_motion or case.source).character, case.target)


def differ(first: Prediction, second: Prediction, case: Case) -> bool:
    """Whether two answers to a case are not the same motion."""
    apart = [
        np.asarray(each.vertices if hasattr(each, "vertices") else each.positions)
        for each in (first, second)
    ]
    return apart[0].shape != apart[1].shape or float(np.abs(apart[0] - apart[1]).max(initial=0.0)) > (
        APART * case.target.height
    )


def as_scored(prediction: Prediction) -> Prediction:
    """The prediction as its file gives it back: single precision, then unit quaternions.

    Scored right away or read from its file, it is the same to the last bit.
    """
    if isinstance(prediction, Positions):
        return replace(prediction, positions=_single(prediction.positions))
    if isinstance(prediction, Surface):
        return replace(prediction, vertices=_single(prediction.vertices))
    rotations = rotation.normalise(_single(prediction.rotations))
    return replace(prediction, rotations=rotations, root=_single(prediction.root))


def _single(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(np.float64)


# --------------------------------------------------------------------------------------------- context
class LazyClips(Sequence[Prediction]):
    """Motions that are loaded by their numbers when they are indexed."""

    def __init__(self, load: Callable[[int], Prediction], numbers: range) -> None:
        self._load, self._numbers = load, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return LazyClips(self._load, self._numbers[index])
        return self._load(self._numbers[index])


def _references(dataset: Dataset, infos: Sequence[CaseInfo]) -> LazyClips:
    """The reference motions of cases."""

    def load(number: int) -> Prediction:
        reference = dataset.load(infos[number]).reference
        if reference is None:
            raise NotSupported("needs reference motions, and this data set has none")
        return reference.copy()

    return LazyClips(load, range(len(infos)))


@dataclass(frozen=True)
class Inputs:
    """The inputs beside source and target that a method is given: the needs and uses of its card, and the
    floor for post-processors."""

    needs: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    ground: bool = False

    @classmethod
    def of(cls, method: Method) -> Self:
        card = method.card
        return cls(tuple(card.needs), tuple(card.uses), isinstance(method, Composed))


def context_for(method: Method | Inputs, dataset: Dataset, case: Case, seed: int) -> Context:
    """The context of a case, with only those privileged inputs that the method's card declares."""
    inputs, arguments = (
        method if isinstance(method, Inputs) else Inputs.of(method),
        dict[str, Any](seed=seed),
    )
    if inputs.ground:
        arguments["ground"] = case.ground
    if "training" in inputs.uses:
        arguments["training"] = _training(dataset)
    if "reference" in inputs.needs:
        arguments["reference"] = case.reference and case.reference.copy()
    if "second_reference" in inputs.needs:
        arguments["second_reference"] = case.alternative and case.alternative.copy()
    if "source_motion" in inputs.needs:
        moved = case.source_motion or case.source
        arguments["source_motion"] = moved.copy() if isinstance(moved, Motion) else None
    if "other_clips" in inputs.needs or "target_motions" in inputs.needs:
        own = _clips_of_target(dataset, case.info, (case.info.split,))
        others = [info for info in own if info.clip != case.info.clip]
        if case.reference is None and (real := _real_clips(dataset, case)):
            own, others = real, [info for info in real if info.clip != case.info.clip]
        elif not others:
            anywhere = _clips_of_target(dataset, case.info, [*dataset.card.splits])
            others = [info for info in anywhere if info.clip != case.info.clip]
        clips = {"target_motions": own, "other_clips": others}
        arguments |= {
            kind: _references(dataset, each) for kind, each in clips.items() if kind in inputs.needs
        }
    return Context(**arguments)


_CASTS: dict[int, tuple[Dataset, Cast | None]] = {}


def _training(dataset: Dataset) -> Cast | None:
    """The training part of a data set; the same object as long as the process lives."""
    if id(dataset) not in _CASTS:
        # the data set is kept beside it, lest another one be given its id
        _CASTS[id(dataset)] = dataset, dataset.training() or None
    return _CASTS[id(dataset)][1]


def _clips_of_target(dataset: Dataset, info: CaseInfo, splits: Sequence[str]) -> list[CaseInfo]:
    """One case per clip that the target performs in these splits, by clip name."""
    by_clip: dict[str, CaseInfo] = {}
    for split in splits:
        for other in dataset.cases(info.task, split):
            if other.target == info.target:
                by_clip.setdefault(other.clip, other)
    return [by_clip[clip] for clip in sorted(by_clip)]


def _real_clips(dataset: Dataset, case: Case) -> list[CaseInfo]:
    """Likewise where cases have no references: the real motion that the data set has of the target."""
    if dataset.real is None:
        return []
    infos = dataset.real(case.info.task, case.target.structure)
    return sorted((info for info in infos if info.target == case.info.target), key=lambda info: info.clip)
