"""The checks that methods and post-processors must pass."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from retarget_bench import defaults
from retarget_bench.api import TASKS, Case, Context, Dataset, Method, Prediction, Source
from retarget_bench.evaluation import predict
from retarget_bench.evaluation.tasks import points
from retarget_bench.evaluation.tasks.points import PointsTask
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.plugins import registry
from retarget_bench.plugins.bound import stages_fault
from retarget_bench.plugins.post_processors import RECONSTRUCTION, Composed, Post
from retarget_bench.plugins.prediction_check import verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import (
    Check,
    Problems,
    Trial,
    changed,
    demand,
    difference,
    sample,
    snapshot,
)
from retarget_bench.verification.rewriting import played, resized

KINDS_OF_SOURCE = ("motion", "positions", "points", "surface")
PRIVILEGED = ("reference", "second_reference", "target_motions", "other_clips", "source_motion")
POINTS_FRAMES = 6
"""Length of the cases of a method that takes points, of which every frame has thousands."""
BATCH_FRAMES = (40, 25, 1)
"""Lengths of the cases that are asked in one batch."""
BATCH_TOLERANCE = 1e-5
"""By how much of the height an answer may differ from that to the case alone."""


class MethodTrial(Trial[Method]):
    """Checks of a method on a few cases of a data set."""

    kind = "methods"

    def __init__(self, spec: Spec, data: Dataset) -> None:
        super().__init__(spec)
        self.data = data
        self.points = PointsTask(data)
        if points.NAME in self.plugin.card.accepts:
            self.cases = sample(data, POINTS_FRAMES) + sample(self.points, POINTS_FRAMES, points.NAME)
        else:
            self.cases = sample(data)

    @demand("its card says what it is and what it takes")
    def card(self) -> Problems:
        card = self.plugin.card
        if not (card.summary and card.version):
            yield "summary and version must not be empty"
        if fault := stages_fault(self.plugin):
            yield fault
        words = {"accepts": KINDS_OF_SOURCE, "needs": PRIVILEGED, "uses": ("training",), "tasks": TASKS}
        yield from self.card_fault(self.plugin.card, **words)

    @demand("supports() gives None or a reason")
    def supports(self) -> Problems:
        for case in self.cases:
            reason = self.plugin.supports(case.source.character, case.target)
            if reason is not None and not (isinstance(reason, str) and reason.strip()):
                yield f"{case.info.id}: returned {reason!r}"

    @demand("answers keep frames and rate, are finite, unit, of the target")
    def answers(self) -> Problems:
        outcomes = [self._ask(case) for case in self.cases]
        if not any(outcome.prediction for outcome in outcomes):
            self.over = True
            reasons = "; ".join(sorted({outcome.message for outcome in outcomes}))
            yield f"no case was answered, so the rest was not checked: {reasons}"
        yield from self._problems(self.cases)

    @demand("a clip of one frame is answered or refused")
    def one_frame(self) -> Problems:
        yield from self._problems([resized(case, 1) for case in self.cases])

    @demand("another frame rate is kept")
    def other_rate(self) -> Problems:
        yield from self._problems([played(case, 50.0) for case in self.cases])

    @demand("a source known by positions only is answered or refused")
    def positions(self) -> Problems:
        yield from self._problems([replace(c, source=_by_positions(c.source)) for c in self.cases])

    @demand("its input is not modified")
    def input_untouched(self) -> Problems:
        for case in self.cases:
            if predict.refusal(self.plugin, case) is not None:
                continue
            source = case.source.copy()  # the engine hands out copies: here the method's own is looked at
            before = snapshot(source=source, target=case.target)
            self.plugin.retarget(source, case.target, context=self._context(case))
            yield from changed(before, source=source, target=case.target)

    @demand("same case and seed, same answer, whatever ran before")
    def deterministic(self) -> Problems:
        first = self._answers(self.cases)
        # the generators that code forgets to seed are moved, so that reading one shows
        random.seed(random.random())
        np.random.seed(random.randrange(2**32))  # noqa: NPY002 - the legacy generator is the one meant here
        self.plugin = registry.create("methods", self.spec)
        yield from self._differences(first, self._answers(self.cases[::-1])[::-1])

    @demand("the seed matters only if the card says stochastic")
    def seed(self) -> Problems:
        if not self.plugin.card.stochastic:
            yield from self._differences(self._answers(self.cases, 1), self._answers(self.cases, 2))

    @demand("privileged inputs are used only if the card needs them")
    def privileged(self) -> Problems:
        declared = self.plugin.card.needs
        for case in self.cases:
            if case.reference is None or predict.refusal(self.plugin, case) is not None:
                continue
            honest = self._context(case)
            privileged: dict[str, Any] = {
                "reference": case.reference,
                "second_reference": case.alternative or case.reference,
                "target_motions": [case.reference],
                "other_clips": [case.reference],
                "source_motion": case.source_motion,
            }
            leaks = {name: value for name, value in privileged.items() if name not in declared}
            answers = [
                self.plugin.retarget(case.source, case.target, context=context)
                for context in (honest, replace(honest, **leaks))
            ]
            if difference(*answers) > 0:
                yield "the answer depends on an input of the context that the card's needs does not name"

    @demand("asked in a batch, if it takes any, it answers as alone")
    def batch(self) -> Problems:
        method = self.plugin
        if method.retarget_batch is None:
            return
        cases = [resized(case, frames) for frames in BATCH_FRAMES for case in self.cases]
        alone = [(case, self._ask(case)) for case in cases]
        answered = [(case, outcome.prediction) for case, outcome in alone if outcome.prediction]
        orders = answered, answered[::-1], answered[::2]
        for each in orders:
            yield from self._batch_problems(method, each)

    def _batch_problems(self, method: Method, alone: Sequence[tuple[Case, Prediction]]) -> Problems:
        """The faults of the answers to a batch, compared with those to its cases alone."""
        pairs = [(case, self._context(case)) for case, _ in alone]
        answers = predict.ask_batch(method, pairs)
        if len(answers) != len(pairs):
            yield f"gave {len(answers)} answers to {len(pairs)} cases"
        for (case, expected), answer in zip(alone, answers, strict=True):
            prediction = verified(answer, case)
            away = np.abs(prediction.positions - expected.positions).max(initial=0.0)
            off = float(away) / case.target.height
            if off > BATCH_TOLERANCE:
                off_by = f"joints are off by up to {off:.3g} heights"
                yield f"{case.info.id}: in a batch of {len(pairs)} {off_by}"

    def _ask(self, case: Case, seed: int = 0) -> predict.Outcome:
        return predict.predict(self.plugin, case, self._context(case, seed))

    def _context(self, case: Case, seed: int = 0) -> Context:
        data = self.points if case.info.task == points.NAME else self.data
        return predict.context_for(self.plugin, data, case, seed)

    def _answers(self, cases: Sequence[Case], seed: int = 0) -> list[Prediction | None]:
        return [self._ask(case, seed).prediction for case in cases]

    def _problems(self, cases: Sequence[Case]) -> Problems:
        """The answers that are neither valid nor a refusal."""
        for case in cases:
            if (outcome := self._ask(case)).status not in ("ok", "unsupported"):
                yield f"{case.info.id}: {outcome.status}: {outcome.message}"

    def _differences(
        self, first: Sequence[Prediction | None], second: Sequence[Prediction | None]
    ) -> Problems:
        for case, a, b in zip(self.cases, first, second, strict=True):
            if (a is None) != (b is None):
                yield f"{case.info.id}: answered once, and once not"
            if a is not None and b is not None and (off := difference(a, b)) > 0:
                yield f"{case.info.id}: answers differ by up to {off:.3g}"


def _by_positions(motion: Source) -> Positions:
    if isinstance(motion, Positions):
        return motion
    return motion.character.positions(motion.positions, motion.fps)


# ------------------------------------------------------------------------------------- post-processors
class PostTrial(Trial[Post]):
    """Checks of a post-processor, with those of the default method that it follows."""

    kind = "posts"

    def __init__(self, spec: Spec, data: Dataset) -> None:
        super().__init__(spec)
        self.data = data
        self.cases = sample(data)

    def __iter__(self) -> Iterator[Check]:
        yield from super().__iter__()
        method = Spec.parse(defaults.METHOD)
        for check in MethodTrial(replace(method, posts=(self.spec,)), self.data):
            yield Check(f"{method.name}+{self.spec.name}: {check.demand}", check.problem)

    @demand("its card says what it is and what it takes")
    def card(self) -> Problems:
        card = self.plugin.card
        if not (card.summary and card.version and card.accepts):
            yield "summary, version and accepts must not be empty"
        if strange := set(self.plugin.card.needs) - {RECONSTRUCTION}:
            yield f"needs {sorted(strange)}; known is {RECONSTRUCTION}"
        yield from self.card_fault(card, accepts=KINDS_OF_SOURCE)

    @demand("answers known by positions only are worked on, if the card accepts them")
    def positions(self) -> Problems:
        method = Composed(_PositionsOnly(), [self.plugin])
        allowed = {"ok", "unsupported"} if "positions" in self.plugin.card.accepts else {"unsupported"}
        for case in self.cases:
            outcome = predict.predict(method, case, Context(ground=case.ground))
            if outcome.status not in allowed:
                yield f"{case.info.id}: {outcome.status}: {outcome.message}"


class _PositionsOnly(Method):
    """The default method with answers that are positions only."""

    def __init__(self) -> None:
        self.method: Method = registry.create("methods", defaults.METHOD)
        self.card = self.method.card

    def supports(self, source: Character, target: Character) -> str | None:
        return self.method.supports(source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        return _by_positions(self.method.retarget(source, target, context=context))
