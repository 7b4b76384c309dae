"""The checks that methods and post-processors must pass."""

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from retarget_bench import defaults
from retarget_bench.api import TASKS, BatchMethod, Case, Context, Dataset, Method, Prediction, Source
from retarget_bench.api.optional import method_card, takes_batches
from retarget_bench.evaluation import predict
from retarget_bench.evaluation.tasks import points
from retarget_bench.evaluation.tasks.points import PointsTask
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.plugins import registry
from retarget_bench.plugins.post_processors import RECONSTRUCTION, Composed, Post, needs
from retarget_bench.plugins.prediction_check import verified
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import (
    Check,
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
        if points.NAME in method_card(self.plugin).accepts:
            self.cases = sample(data, POINTS_FRAMES) + sample(self.points, POINTS_FRAMES, points.NAME)
        else:
            self.cases = sample(data)

    @demand("its card says what it is and what it takes")
    def card(self) -> str | None:
        card = self.plugin.card
        if not (card.summary and card.version):
            return "summary and version must not be empty"
        words = {"accepts": KINDS_OF_SOURCE, "needs": PRIVILEGED, "uses": ("training",), "tasks": TASKS}
        return self.card_fault(method_card(self.plugin), **words)

    @demand("supports() gives None or a reason")
    def supports(self) -> str | None:
        for case in self.cases:
            reason = self.plugin.supports(case.source.character, case.target)
            if reason is not None and not (isinstance(reason, str) and reason.strip()):
                return f"{case.info.id}: returned {reason!r}"
        return None

    @demand("answers keep frames and rate, are finite, unit, of the target")
    def answers(self) -> str | None:
        outcomes = [self._ask(case) for case in self.cases]
        if not any(outcome.prediction for outcome in outcomes):
            return f"no case was answered: {'; '.join(sorted({outcome.message for outcome in outcomes}))}"
        return self._first_problem(self.cases)

    @demand("a clip of one frame is answered or refused")
    def one_frame(self) -> str | None:
        return self._first_problem([resized(case, 1) for case in self.cases])

    @demand("another frame rate is kept")
    def other_rate(self) -> str | None:
        return self._first_problem([played(case, 50.0) for case in self.cases])

    @demand("a source known by positions only is answered or refused")
    def positions(self) -> str | None:
        return self._first_problem([replace(c, source=_by_positions(c.source)) for c in self.cases])

    @demand("its input is not modified")
    def input_untouched(self) -> str | None:
        for case in self.cases:
            if predict.refusal(self.plugin, case) is not None:
                continue
            given = case.source.copy()  # the engine hands out copies: here the method's own is looked at
            before = snapshot(source=given, target=case.target)
            self.plugin.retarget(given, case.target, context=self._context(case))
            if problem := changed(before, source=given, target=case.target):
                return problem
        return None

    @demand("same case and seed, same answer, whatever ran before")
    def deterministic(self) -> str | None:
        first = self._answers(self.cases)
        # the generators that code forgets to seed are moved, so that reading one shows
        random.seed(random.random())
        np.random.seed(random.randrange(2**32))  # noqa: NPY002 - the legacy generator is the one meant here
        self.plugin = registry.create("methods", self.spec)
        return self._first_difference(first, self._answers(self.cases[::-1])[::-1])

    @demand("the seed matters only if the card says stochastic")
    def seed(self) -> str | None:
        if self.plugin.card.stochastic:
            return None
        return self._first_difference(self._answers(self.cases, 1), self._answers(self.cases, 2))

    @demand("privileged inputs are used only if the card needs them")
    def privileged(self) -> str | None:
        declared = self.plugin.card.needs
        for case in self.cases:
            if case.reference is None or predict.refusal(self.plugin, case) is not None:
                continue
            honest = self._context(case)
            motions = [case.reference]
            inputs = (
                case.reference,
                case.alternative or case.reference,
                motions,
                motions,
                case.source_motion,
            )
            named: dict[str, Any] = dict(zip(PRIVILEGED, inputs, strict=True))
            leaks = {name: value for name, value in named.items() if name not in declared}
            answers = [
                self.plugin.retarget(case.source, case.target, context=context)
                for context in (honest, replace(honest, **leaks))
            ]
            if difference(*answers) > 0:
                return "the answer depends on an input of the context that the card's needs does not name"
        return None

    @demand("asked in a batch, if it takes any, it answers as alone")
    def batch(self) -> str | None:
        method = self.plugin
        if not takes_batches(method):
            return None
        cases = [resized(case, frames) for frames in BATCH_FRAMES for case in self.cases]
        alone = [(case, self._ask(case)) for case in cases]
        known = [(case, outcome.prediction) for case, outcome in alone if outcome.prediction]
        orders = known, known[::-1], known[::2]
        return next(filter(None, (self._batch_problem(method, each) for each in orders)), None)

    def _batch_problem(self, method: BatchMethod, known: Sequence[tuple[Case, Prediction]]) -> str | None:
        """The first fault of the answers to a batch, compared with those to its cases alone."""
        pairs = [(case, self._context(case)) for case, _ in known]
        answers = predict.ask_batch(method, pairs)
        if len(answers) != len(pairs):
            return f"gave {len(answers)} answers to {len(pairs)} cases"
        for (case, wanted), answer in zip(known, answers, strict=True):
            given = verified(answer, case)
            off = float(np.abs(given.positions - wanted.positions).max(initial=0.0)) / case.target.height
            if off > BATCH_TOLERANCE:
                off_by = f"joints are off by up to {off:.3g} heights"
                return f"{case.info.id}: in a batch of {len(pairs)} {off_by}"
        return None

    def _ask(self, case: Case, seed: int = 0) -> predict.Outcome:
        return predict.predict(self.plugin, case, self._context(case, seed))

    def _context(self, case: Case, seed: int = 0) -> Context:
        data = self.points if case.info.task == points.NAME else self.data
        return predict.context_for(self.plugin, data, case, seed)

    def _answers(self, cases: Sequence[Case], seed: int = 0) -> list[Prediction | None]:
        return [self._ask(case, seed).prediction for case in cases]

    def _first_problem(self, cases: Sequence[Case]) -> str | None:
        """The first answer that is neither valid nor a refusal."""
        bad = ((c, o) for c in cases if (o := self._ask(c)).status not in ("ok", "unsupported"))
        return next((f"{c.info.id}: {o.status}: {o.message}" for c, o in bad), None)

    def _first_difference(
        self, first: Sequence[Prediction | None], second: Sequence[Prediction | None]
    ) -> str | None:
        for case, a, b in zip(self.cases, first, second, strict=True):
            if (a is None) != (b is None):
                return f"{case.info.id}: answered once, and once not"
            if a is not None and b is not None and (off := difference(a, b)) > 0:
                return f"{case.info.id}: answers differ by up to {off:.3g}"
        return None


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
    def card(self) -> str | None:
        card = self.plugin.card
        if not (card.summary and card.version and card.accepts):
            return "summary, version and accepts must not be empty"
        if strange := set(needs(self.plugin)) - {RECONSTRUCTION}:
            return f"needs {sorted(strange)}; known is {RECONSTRUCTION}"
        return self.card_fault(card, accepts=KINDS_OF_SOURCE)

    @demand("answers known by positions only are worked on, if the card accepts them")
    def positions(self) -> str | None:
        method = Composed(_PositionsOnly(), [self.plugin])
        wanted = {"ok", "unsupported"} if "positions" in self.plugin.card.accepts else {"unsupported"}
        for case in self.cases:
            outcome = predict.predict(method, case, Context(ground=case.ground))
            if outcome.status not in wanted:
                return f"{case.info.id}: {outcome.status}: {outcome.message}"
        return None


class _PositionsOnly:
    """The default method with answers that are positions only."""

    def __init__(self) -> None:
        self.method: Method = registry.create("methods", defaults.METHOD)
        self.card = self.method.card
        self.supports = self.method.supports

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        return _by_positions(self.method.retarget(source, target, context=context))
