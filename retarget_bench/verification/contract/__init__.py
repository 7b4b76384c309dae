"""Checks of a plug-in against its contract in ``api/``.

``bench test NAME`` prints the checks; a plug-in's own test suite has one line::

    assert_contract("methods", "my_method")
"""

from collections.abc import Iterator

from retarget_bench import defaults
from retarget_bench.api import Dataset, PairMetric, SetMetric
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import Check
from retarget_bench.verification.contract.datasets import DatasetTrial
from retarget_bench.verification.contract.methods import MethodTrial, PostTrial
from retarget_bench.verification.contract.metrics import MetricTrial, PairMetricTrial, SetMetricTrial

__all__ = ["Check", "assert_contract", "check"]


def check(kind: registry.Kind, spec: Spec | str, data: Spec | str = defaults.DATASET) -> Iterator[Check]:
    """The checks of one plug-in, as they are made; ``data`` is the data set whose cases it is tried on.

    Raises BenchError where there is no such plug-in, or where it cannot be built at all.
    """
    spec = Spec.parse(spec)
    if kind == "datasets":
        yield from DatasetTrial(spec)
        return
    cases: Dataset = registry.create("datasets", data)
    if kind == "methods":
        yield from MethodTrial(spec, cases)
    elif kind == "posts":
        yield from PostTrial(spec, cases)
    elif isinstance(metric := registry.create("metrics", spec), SetMetric):
        yield from SetMetricTrial(spec, cases)
    else:
        yield from (PairMetricTrial if isinstance(metric, PairMetric) else MetricTrial)(spec, cases)


def assert_contract(kind: registry.Kind, spec: Spec | str, data: Spec | str = defaults.DATASET) -> None:
    """Raise AssertionError with every check that the plug-in fails."""
    failed = [str(each) for each in check(kind, spec, data) if not each.passed]
    if failed:
        raise AssertionError(f"{spec} breaks its contract:\n" + "\n".join(failed))
