"""Real motion to compare answers with where their cases have no references."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import cast

from retarget_bench.api import CaseFeatures, CaseInfo, SetMetric
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.offers import OffersReal
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.plan import dataset, set_metrics
from retarget_bench.plugins.spec import Spec

NONE = "the data set has no real motion of bodies of structure {} in this part"


@dataclass(frozen=True, eq=False)
class RealSet:
    """Real motion of bodies of one structure: features and facts by case id.

    reason: why there is none, or "".
    """

    features: Mapping[str, CaseFeatures]
    infos: Mapping[str, CaseInfo]
    reason: str = ""


@lru_cache(maxsize=8)
def real_set(data: Spec, metrics: tuple[str, ...], name: str, task: str, structure: str) -> RealSet:
    """What a set metric sees of the real motion of bodies of a structure; kept for all methods that a
    process evaluates. Raises BenchError where the data set's real cases have no references."""
    (metric,) = (each for each in set_metrics(metrics) if each.card.name == name)
    found = cast(OffersReal, dataset(data)).real(task, structure)
    infos = {info.id: info for info in found}
    if not infos:
        return RealSet({}, {}, NONE.format(structure))
    return RealSet({each: _seen(metric, data, info) for each, info in infos.items()}, infos)


def _seen(metric: SetMetric, data: Spec, info: CaseInfo) -> CaseFeatures:
    case = dataset(data).load(info)
    if case.reference is None:
        raise BenchError(f"{info.id} is offered as real motion and has no reference")
    return metric.features(Comparison(case, case.reference))
