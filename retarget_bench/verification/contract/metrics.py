"""The checks that a metric must pass."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import get_args

import numpy as np

from retarget_bench.api import Case, Dataset, Direction, Metric, Prediction, SetMetric, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.evaluation import score
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Positions
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import Values
from retarget_bench.verification.contract.common import Check, Checks, changed, resized, sample, snapshot

LENGTH = 150
"""Frames of the clips that a metric is tried on: some protocols leave shorter clips out."""
SLACK = 1e-9
"""By how much a wrong prediction may seem better than the right one: rounding."""


def check_metric(spec: Spec, data: Dataset) -> Iterator[Check]:
    """Every check of a metric on a few cases of a data set; raises BenchError if it cannot be built."""
    trial = _Trial(spec, data)
    return iter(
        Checks(
            {
                "its card says what every value means": trial.card,
                "values are finite, declared, and curves where an index is declared": trial.values,
                "the right answer is never worse than a wrong one": trial.perfect,
                "a clip of one frame is measured or left out": trial.one_frame,
                "a prediction known by positions only is measured or left out": trial.positions,
                "its input is not modified": trial.input_untouched,
                "same input, same numbers": trial.deterministic,
            }
        )
    )


class _Trial:
    """A metric and the cases it is tried on."""

    def __init__(self, spec: Spec, data: Dataset) -> None:
        self.spec = spec
        self.metric: Metric = registry.create("metrics", spec)
        self.cases = [case for case in sample(data, LENGTH) if case.reference is not None]

    def card(self) -> str | None:
        return card_problem(self.metric, self.spec.name)

    def values(self) -> str | None:
        declared = {value.id: value for value in self.metric.card.values}
        for case in self.cases:
            wrong = _disturbed(case)
            found = self._score(case, wrong)
            if not found and any(not score.missing(v, case, wrong) for v in self.metric.card.values):
                return f"{case.info.id}: no value at all"
            for name, number in found.items():
                if isinstance(number, Mapping) != bool(declared[name].index):
                    return (
                        f"{name} declares index {declared[name].index!r} but gave {type(number).__name__}"
                    )
            if unknown := set(self._compute(case, _disturbed(case))) - set(declared):
                return f"gave undeclared values: {', '.join(sorted(unknown))}"
        return None

    def perfect(self) -> str | None:
        for case in self.cases:
            assert case.reference is not None
            right, wrong = self._score(case, case.reference), self._score(case, _disturbed(case))
            for value in self.metric.card.values:
                pair = right.get(value.id), wrong.get(value.id)
                if "reference" in value.needs and _worse(value, *pair):
                    return (
                        f"{value.id}: {pair[0]:.6g} for the reference itself, {pair[1]:.6g} for a wrong one"
                    )
        return None

    def one_frame(self) -> str | None:
        for case in self.cases:
            short = resized(case, 1)
            self._score(short, _disturbed(short))
        return None

    def positions(self) -> str | None:
        for case in self.cases:
            wrong = _disturbed(case)
            self._score(case, Positions(case.target, _places(wrong), wrong.fps))
        return None

    def input_untouched(self) -> str | None:
        for case in self.cases:
            wrong = _disturbed(case)
            before = snapshot(case=case, prediction=wrong)
            self._score(case, wrong)
            if problem := changed(before, case=case, prediction=wrong):
                return problem
        return None

    def deterministic(self) -> str | None:
        for case in self.cases:
            first, second = (self._score(case, _disturbed(case)) for _ in range(2))
            if moved := [name for name in first if first[name] != second.get(name)]:
                return f"{case.info.id}: {moved[0]} was {first[moved[0]]}, then {second.get(moved[0])}"
        return None

    def _score(self, case: Case, prediction: Prediction) -> Values:
        return score.score([self.metric], case, prediction)

    def _compute(self, case: Case, prediction: Prediction) -> list[str]:
        return list(self.metric.compute(Comparison(case, prediction)))


def card_problem(metric: Metric | SetMetric, name: str) -> str | None:
    """What a metric's card lacks or says wrongly; None where it is right."""
    card = metric.card
    if card.name != name:
        return f"card.name is {card.name!r}, but the plug-in is called {name!r}"
    if not (card.summary and card.version and card.values):
        return "summary, version and values must not be empty"
    for value in card.values:
        texts = ("id", "label", "meaning", "unit", "formula", "source")
        if empty := [name for name in texts if not getattr(value, name).strip()]:
            return f"{value.id or 'a value'} has no {', '.join(empty)}"
        if value.better not in get_args(Direction):
            return f"{value.id}: better is {value.better!r}; known are {', '.join(get_args(Direction))}"
        if not value.tolerance > 0:
            return f"{value.id}: the tolerance must be positive"
    score.declared_values([metric])
    return None


def _worse(value: Value, right: object, wrong: object) -> bool:
    """Whether the right answer's number is worse than the wrong one's. Curves are not compared."""
    if not isinstance(right, float) or not isinstance(wrong, float):
        return False
    slack = SLACK * (1 + abs(right))
    if value.better == "lower":
        return right > wrong + slack
    if value.better == "higher":
        return right < wrong - slack
    if value.better == "target" and min(right, wrong, value.goal) > 0:
        return abs(math.log(right / value.goal)) > abs(math.log(wrong / value.goal)) + slack
    return False


def _disturbed(case: Case) -> Prediction:
    """A wrong answer: the reference with joints turned and the root moved, the same every time."""
    assert case.reference is not None
    random = np.random.default_rng(7)
    if isinstance(case.reference, Positions):
        noise = random.normal(scale=0.03, size=case.reference.positions.shape)
        return replace(case.reference, positions=case.reference.positions + noise)
    turn = rotation.from_rotation_vector(
        random.normal(scale=0.2, size=(*case.reference.rotations.shape[:2], 3))
    )
    moved = case.reference.root + random.normal(scale=0.02, size=case.reference.root.shape)
    return replace(case.reference, rotations=rotation.multiply(case.reference.rotations, turn), root=moved)


def _places(prediction: Prediction) -> np.ndarray:
    return np.array(prediction.positions)
