"""The checks that a set metric must pass."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.api import Case, CaseFeatures, Dataset, Sample, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.set_metrics.collect import collect
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import Check, Checks, changed, resized, sample, snapshot
from retarget_bench.verification.contract.metrics import LENGTH, card_problem

GROUPS = 10


def check_set_metric(spec: Spec, data: Dataset) -> Iterator[Check]:
    """Every check of a set metric on a few cases of a data set; raises BenchError if it cannot be built."""
    trial = _Trial(spec, data)
    return iter(
        Checks(
            {
                "its card says what every value means": trial.card,
                "a body either has a network or a reason why not": trial.networks,
                "features of a prediction and of the reference are made alike": trial.alike,
                "a clip of one frame has no windows or some": trial.one_frame,
                "its input is not modified": trial.input_untouched,
                "same input, same features": trial.deterministic,
                "values do not depend on the order of the windows": trial.order,
            }
        )
    )


class _Trial:
    """A set metric and the cases it is tried on: those of bodies that it can be applied to."""

    def __init__(self, spec: Spec, data: Dataset) -> None:
        self.spec = spec
        self.metric: SetMetric = registry.create("metrics", spec)
        self.all = [case for case in sample(data, LENGTH) if case.reference is not None]
        self.cases = [case for case in self.all if not self._reason(case)]

    def _reason(self, case: Case) -> str:
        try:
            self.metric.network(case.target)
        except NotSupported as reason:
            return str(reason)
        return ""

    def card(self) -> str | None:
        return card_problem(self.metric, self.spec.name)

    def networks(self) -> str | None:
        for case in self.all:
            collect([self.metric], case, case.reference or case.source)
        return None if self.cases else "applies to no body of the data set it is tried on"

    def alike(self) -> str | None:
        for case in self.cases:
            found = self._features(case)
            if not np.array_equal(found.generated, found.real):
                return (
                    f"{case.info.id}: the reference as a prediction has other features than the reference"
                )
            if not len(found.real):
                return f"{case.info.id}: no window in {LENGTH} frames"
        return None

    def one_frame(self) -> str | None:
        for case in self.cases:
            short = resized(case, 1)
            collect([self.metric], short, short.reference or short.source)
        return None

    def input_untouched(self) -> str | None:
        for case in self.cases:
            before = snapshot(case=case)
            self._features(case)
            if problem := changed(before, case=case):
                return problem
        return None

    def deterministic(self) -> str | None:
        for case in self.cases:
            first, second = self._features(case), self._features(case)
            if not np.array_equal(first.generated, second.generated):
                return f"{case.info.id}: two calls gave different features"
        return None

    def order(self) -> str | None:
        width = self._features(self.cases[0]).real.shape[1]
        random = np.random.default_rng(7)
        count = max(GROUPS * 5, *(self.metric.least(value.id) for value in self.metric.card.values))
        clips = np.array([f"clip {number % GROUPS}" for number in range(count)])
        real, made = (Sample(random.normal(size=(count, width)), clips) for _ in range(2))
        mixed = random.permutation(count)
        for value in self.metric.card.values:
            straight = self.metric.value(value.id, real, made)
            turned = self.metric.value(value.id, real, Sample(made.features[mixed], clips[mixed]))
            if not abs(straight - turned) <= 1e-6 * max(abs(straight), 1e-3):
                return f"{value.id} was {straight}, and {turned} after the windows changed their order"
        return None

    def _features(self, case: Case) -> CaseFeatures:
        assert case.reference is not None
        return self.metric.features(Comparison(case, case.reference))
