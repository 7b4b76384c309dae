"""Features that set metrics make: of finished cases, and of real motion to compare them with."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import cast

import numpy as np

from retarget_bench.api import Case, CaseFeatures, CaseInfo, Prediction, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.optional import OffersReal
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.evaluation.plan import dataset, set_metrics
from retarget_bench.evaluation.set_metrics.files import Arrays
from retarget_bench.plugins.spec import Spec

NO_REFERENCE = "needs reference motions, and this data set has none"
PARTS = ("generated", "real", "speed")


def collect(
    metrics: Sequence[SetMetric], case: Case, prediction: Prediction, elsewhere: bool = False
) -> Arrays:
    """Features of one case for the set metrics, as arrays ``<metric>:<name>``.

    elsewhere: whether the data set has real motion to compare answers without a reference with.
    Raises BenchError where a metric breaks its contract.
    """
    comparison = Comparison(case, prediction)
    arrays: Arrays = {"structure": np.array(case.target.structure)}
    for metric in metrics:
        name = metric.card.name
        try:
            if case.reference is None and not elsewhere:
                raise NotSupported(NO_REFERENCE)
            arrays[f"{name}:network"] = np.array(metric.network(case.target))
            found = _checked(name, case, metric.features(comparison))
        except NotSupported as reason:
            arrays[f"{name}:reason"] = np.array(str(reason))
            continue
        arrays |= {f"{name}:{part}": np.asarray(getattr(found, part), np.float32) for part in PARTS}
    return arrays


def _checked(name: str, case: Case, found: CaseFeatures) -> CaseFeatures:
    paired = [found.generated] if case.reference is None else [found.generated, found.real]
    shapes = {np.shape(each) for each in paired}
    if len(shapes) > 1 or len(found.speed) != len(found.generated) or np.ndim(found.generated) != 2:
        raise BenchError(
            f"metric {name!r} gave features {np.shape(found.generated)}, {np.shape(found.real)} and "
            f"{np.shape(found.speed)} for case {case.info.id}; the first two must be (windows, d)"
        )
    if not all(np.isfinite(getattr(found, part)).all() for part in PARTS):
        raise BenchError(f"metric {name!r} gave features that are no numbers for case {case.info.id}")
    return found


@lru_cache(maxsize=8)
def real_set(
    data: Spec, metrics: tuple[str, ...], name: str, task: str, structure: str
) -> tuple[Mapping[str, CaseFeatures], Mapping[str, CaseInfo]]:
    """Features and facts of the real motion of bodies of a structure, by case id.

    They are kept for all methods that a process evaluates. Raises BenchError where the data set's real
    cases have no references.
    """
    (metric,) = (each for each in set_metrics(metrics) if each.card.name == name)
    source = dataset(data)
    infos = {info.id: info for info in cast(OffersReal, source).real(task, structure)}
    features = {}
    for each, info in infos.items():
        case = source.load(info)
        if case.reference is None:
            raise BenchError(f"{each} is offered as real motion and has no reference")
        features[each] = metric.features(Comparison(case, case.reference))
    return features, infos
