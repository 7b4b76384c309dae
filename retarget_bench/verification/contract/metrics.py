"""The checks that metrics of single cases, and metrics of sets of cases, must pass."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar, get_args

import numpy as np

from retarget_bench.analysis.statistics import losses
from retarget_bench.api import (
    Case,
    CaseFeatures,
    Dataset,
    Direction,
    Metric,
    PairMetric,
    Prediction,
    Sample,
    SetMetric,
    Value,
)
from retarget_bench.api.comparison import Comparison, vertices
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation import pairs, score
from retarget_bench.evaluation.pairs import of_case
from retarget_bench.evaluation.set_metrics.files import collect
from retarget_bench.evaluation.tasks.points import points_of
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion, PointSets, Positions, Surface
from retarget_bench.plugins.bound import declared_values
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import Values
from retarget_bench.verification.contract.common import Problems, Trial, demand, sample
from retarget_bench.verification.rewriting import resized

M = TypeVar("M", Metric | PairMetric, SetMetric)
LENGTH = 150
"""Frames of the clips that a metric is tried on: some protocols leave shorter clips out."""
GROUPS = 10
"""Clips of the windows that a set metric is tried on."""
SLACK = 1e-9
"""By how much a wrong prediction may seem better than the right one: rounding."""


class _Scored(Trial[M]):
    """Checks of every metric on cases with references."""

    kind = "metrics"

    def __init__(self, spec: Spec, data: Dataset) -> None:
        super().__init__(spec)
        self.cases = [case for case in sample(data, LENGTH) if case.reference is not None]

    @demand("its card says what every value means")
    def card(self) -> Problems:
        card = self.plugin.card
        yield from self.card_fault(card)
        if not (card.summary and card.version and card.values):
            yield "summary, version and values must not be empty"
        for value in card.values:
            texts = ("id", "label", "meaning", "unit", "formula", "source")
            if empty := [name for name in texts if not getattr(value, name).strip()]:
                yield f"{value.id or 'a value'} has no {', '.join(empty)}"
            if value.better not in get_args(Direction):
                yield f"{value.id}: better is {value.better!r}; known are {', '.join(get_args(Direction))}"
            if not value.tolerance > 0:
                yield f"{value.id}: the tolerance must be positive"
            if value.bounds[0] > value.bounds[1]:
                yield f"{value.id}: least {value.bounds[0]:g} is more than most {value.bounds[1]:g}"
        declared_values([self.plugin])

    def measured(self, case: Case, prediction: Prediction) -> Mapping[str, Any]:
        """All that the metric makes of a prediction, by name."""
        raise NotImplementedError

    @demand("a clip of one frame is measured or left out")
    def one_frame(self) -> None:
        for case in self.cases:
            short = resized(case, 1)
            self.measured(short, _disturbed(short))

    @demand("its input is not modified")
    def input_untouched(self) -> None:
        for case in self.cases:
            self.measured(case, _disturbed(case))  # which cannot be written to

    @demand("same input, same numbers")
    def deterministic(self) -> Problems:
        for case in self.cases:
            first, second = (self.measured(case, _disturbed(case)) for _ in range(2))
            for name, number in first.items():
                if not np.array_equal(number, second.get(name)):  # type: ignore[arg-type]
                    yield f"{case.info.id}: {name} was {number}, then {second.get(name)}"


class MetricTrial(_Scored[Metric | PairMetric]):
    """Checks of a metric of single cases, and of one of pairs, each case being all clips of its pair."""

    @demand("values are finite, declared, within their bounds, and curves where an index is declared")
    def values(self) -> Problems:
        declared = {value.id: value for value in self.plugin.card.computed}
        for case in self.cases:
            wrong = _disturbed(case)
            values = self.measured(case, wrong)
            if not values and any(not score.missing(v, case, wrong) for v in self.plugin.card.computed):
                yield f"{case.info.id}: no value at all"
            for name, number in values.items():
                each = number.values() if isinstance(number, Mapping) else [number]
                if beyond := [one for one in each if not declared[name].allows(one)]:
                    least, most = declared[name].bounds
                    yield f"{name} gave {beyond[0]:g}, outside {least:g} to {most:g}; say least and most"

    @demand("the right answer is never worse than a wrong one")
    def perfect(self) -> Problems:
        for case in self.cases:
            assert case.reference is not None
            right, wrong = (self.measured(case, each) for each in (case.reference, _disturbed(case)))
            for value in self.plugin.card.values:
                pair = right.get(value.id), wrong.get(value.id)
                if "reference" in value.needs and _worse(value, *pair):
                    yield (
                        f"{value.id}: {pair[0]:.6g} for the reference itself, {pair[1]:.6g} for a wrong one"
                    )

    @demand("a source known by points and an answer known by vertices are measured or left out")
    def skins(self) -> None:
        for case in self.cases:
            motion, wrong = case.source, _disturbed(case)
            if not isinstance(motion, Motion) or motion.character.mesh is None:
                continue
            of_points = replace(case, source=points_of(motion, case.info.id), source_motion=motion)
            self.measured(of_points, wrong)
            if (skin := vertices(wrong, case.target)) is not None:
                self.measured(of_points, case.target.surface(skin, wrong.fps))

    @demand("a prediction known by positions only is measured or left out")
    def positions(self) -> None:
        for case in self.cases:
            wrong = _disturbed(case)
            self.measured(case, case.target.positions(np.array(wrong.positions), wrong.fps))

    def measured(self, case: Case, prediction: Prediction) -> Values:
        return score.score([of_case(self.plugin)], case, prediction).sound()


class PairMetricTrial(MetricTrial):
    """Checks of a metric of pairs of bodies."""

    plugin: PairMetric

    @demand("values do not depend on the order of the clips, which may be of different lengths")
    def order(self) -> Problems:
        count = self.plugin.least + 1
        for case in self.cases:
            clips = [resized(case, LENGTH - number * LENGTH // (2 * count)) for number in range(count)]
            collected = [pairs.collect([self.plugin], clip, _disturbed(clip))[0] for clip in clips]
            extracts = [extract.arrays[0] for each in collected for extract in each.values()]
            if len(extracts) < count:
                continue  # it does not apply
            straight, turned = (pairs.values_of(self.plugin, some) for some in (extracts, extracts[::-1]))
            for one, other in zip(straight, turned[::-1], strict=True):
                for name, number in one.items():
                    if not _close(number, other.get(name)):
                        yield f"{name} was {number}, and {other.get(name)} with the clips in another order"


class SetMetricTrial(_Scored[SetMetric]):
    """Checks of a metric of sets of cases, on bodies that it can be applied to."""

    def __init__(self, spec: Spec, data: Dataset) -> None:
        super().__init__(spec, data)
        self.all, self.cases = self.cases, [case for case in self.cases if self._has_features(case)]

    def _has_features(self, case: Case) -> bool:
        try:
            self._features(case)
        except NotSupported:
            return False
        return True

    @demand("a body either has features or a reason why not")
    def reasons(self) -> Problems:
        for case in self.all:
            motion = case.reference or case.source
            assert not isinstance(motion, PointSets)
            self.measured(case, motion)
        if not self.cases:
            yield "applies to no body of the data set it is tried on"

    def measured(self, case: Case, prediction: Prediction) -> dict[str, Any]:
        members, faults = collect([self.plugin], case, prediction)
        score.Scored(faults=faults).sound()
        facts = {name: (each.name, each.reason) for name, each in members.items()}
        return facts | {
            f"{name}:{part}": array
            for name, each in members.items()
            if each.features
            for part, array in vars(each.features).items()
        }

    @demand("features of a prediction and of the reference are made alike")
    def alike(self) -> Problems:
        for case in self.cases:
            features = self._features(case)
            if not np.array_equal(features.generated, features.real):
                yield (
                    f"{case.info.id}: the reference as a prediction has other features than the reference"
                )
            if not len(features.real):
                yield f"{case.info.id}: no window in {LENGTH} frames"

    @demand("distances are values of the card, 0 between equal sets and more between others")
    def distances(self) -> Problems:
        real, generated = self._two_sets()
        declared = {value.id for value in self.plugin.card.values}
        for name in sorted({*self.plugin.distances, *self.plugin.unbiased} - declared):
            yield f"{name} is named among distances or unbiased values, and is no value of its card"
        for name in sorted(declared.intersection(self.plugin.distances)):
            own, other = self.plugin.value(name, real, real), self.plugin.value(name, real, generated)
            if not abs(own) <= 1e-6 * abs(other) or not other > 0.0:
                yield f"{name} is {own} between equal sets, and {other} between others"

    @demand("values do not depend on the order of the windows")
    def order(self) -> Problems:
        real, generated = self._two_sets()
        mixed = np.random.default_rng(8).permutation(len(generated.clips))
        turned_round = Sample(generated.features[mixed], generated.clips[mixed])
        for value in self.plugin.card.values:
            straight = self.plugin.value(value.id, real, generated)
            turned = self.plugin.value(value.id, real, turned_round)
            if not abs(straight - turned) <= 1e-6 * max(abs(straight), 1e-3):
                yield f"{value.id} was {straight}, and {turned} after the windows changed their order"

    def _two_sets(self) -> tuple[Sample, Sample]:
        """Two sets of random windows, as many as every value needs."""
        width = self._features(self.cases[0]).real.shape[1]
        random = np.random.default_rng(7)
        count = max(GROUPS * 5, *(self.plugin.least(value.id) for value in self.plugin.card.values))
        clips = np.array([f"clip {number % GROUPS}" for number in range(count)])
        real, generated = (Sample(random.normal(size=(count, width)), clips) for _ in range(2))
        return real, generated

    def _features(self, case: Case) -> CaseFeatures:
        assert case.reference is not None
        return self.plugin.features(Comparison(case, case.reference))


def _close(one: Any, other: Any) -> bool:
    """Whether numbers, or curves, are equal but for the rounding of sums in another order."""
    if isinstance(one, Mapping):
        return isinstance(other, Mapping) and all(_close(one[at], other.get(at)) for at in one)
    return isinstance(other, float) and abs(one - other) <= 1e-6 * max(abs(one), 1e-3)


def _worse(value: Value, right: object, wrong: object) -> bool:
    """The right answer's number is worse than the wrong one's. Curves are not compared."""
    if value.better == "none" or not isinstance(right, float) or not isinstance(wrong, float):
        return False
    loss_right, loss_wrong = losses(np.array([right, wrong]), value.better, value.goal)
    return bool(loss_right > loss_wrong + SLACK * (1 + abs(right)))


def _disturbed(case: Case) -> Prediction:
    """A wrong answer: the reference with joints turned and the root moved, the same every time."""
    assert case.reference is not None
    random = np.random.default_rng(7)
    if isinstance(case.reference, Positions):
        noise = random.normal(scale=0.03, size=case.reference.positions.shape)
        return replace(case.reference, positions=case.reference.positions + noise)
    if isinstance(case.reference, Surface):
        noise = random.normal(scale=0.03, size=case.reference.vertices.shape)
        return replace(case.reference, vertices=case.reference.vertices + noise)
    turn = rotation.from_rotation_vector(
        random.normal(scale=0.2, size=(*case.reference.rotations.shape[:2], 3))
    )
    moved = case.reference.root + random.normal(scale=0.02, size=case.reference.root.shape)
    return replace(case.reference, rotations=rotation.multiply(case.reference.rotations, turn), root=moved)
