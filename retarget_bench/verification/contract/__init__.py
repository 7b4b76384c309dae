"""The contract kit: does a plug-in do what ``api.py`` asks of it?

``bench test NAME`` prints the checks; a plug-in's own test suite has one line::

    assert_contract("methods", "my_method")
"""

from __future__ import annotations

from collections.abc import Iterator

from retarget_bench import defaults
from retarget_bench.api.offers import is_set_metric
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.contract.common import Check, Checks
from retarget_bench.verification.contract.datasets import check_dataset
from retarget_bench.verification.contract.methods import check_method
from retarget_bench.verification.contract.metrics import check_metric
from retarget_bench.verification.contract.posts import check_post
from retarget_bench.verification.contract.sets import check_set_metric

__all__ = ["Check", "Checks", "assert_contract", "check"]


def check(kind: registry.Kind, spec: Spec | str, data: Spec | str = defaults.DATASET) -> Iterator[Check]:
    """The checks of one plug-in, as they are made; ``data`` is the data set whose cases it is tried on.

    Raises BenchError where there is no such plug-in, or where it cannot be built at all.
    """
    spec = Spec.parse(spec)
    if kind == "datasets":
        yield from check_dataset(spec)
    elif kind == "metrics":
        sets = is_set_metric(registry.create("metrics", spec))
        look = check_set_metric if sets else check_metric
        yield from look(spec, registry.create("datasets", data))
    elif kind == "posts":
        yield from check_post(spec, registry.create("datasets", data))
    else:
        yield from check_method(spec, registry.create("datasets", data))


def assert_contract(kind: registry.Kind, spec: Spec | str, data: Spec | str = defaults.DATASET) -> None:
    """Raise AssertionError with every check that the plug-in fails."""
    failed = [str(each) for each in check(kind, spec, data) if not each.passed]
    if failed:
        raise AssertionError(f"{spec} breaks its contract:\n" + "\n".join(failed))
