"""From the features of a cell's cases to its values: one per value id and target structure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from retarget_bench.api import CaseFeatures, CaseInfo, Sample, SetMetric
from retarget_bench.plan import Plan, set_metrics
from retarget_bench.records import Place
from retarget_bench.sets import files
from retarget_bench.sets.collect import PARTS
from retarget_bench.sets.draw import Draw, draw
from retarget_bench.sets.files import Arrays, SetValue
from retarget_bench.sets.jackknife import CLIPS, GROUPS, groups_of, interval
from retarget_bench.work import know


def evaluate(job: Mapping[str, Any]) -> list[SetValue]:
    """Gather the features of a finished cell and compute its values; what a worker process does.

    job: ``plan``, ``place``, ``infos`` of the cases that have features.
    """
    plan: Plan = job["plan"]
    place: Place = job["place"]
    know(plan.plugin_files)
    infos = {info.id: info for info in job["infos"]}
    arrays = files.gather(place, infos)
    found = []
    for metric in set_metrics(plan.metrics):
        for structure, cases in _by_structure(arrays, infos).items():
            found += _values(metric, structure, {case: infos[case] for case in cases}, arrays)
    return found


def _by_structure(arrays: Arrays, cases: Iterable[str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for case in cases:
        found.setdefault(str(arrays[f"{case}/structure"]), []).append(case)
    return {structure: found[structure] for structure in sorted(found)}


def _values(
    metric: SetMetric, structure: str, infos: Mapping[str, CaseInfo], arrays: Arrays
) -> list[SetValue]:
    """All values of a metric on one structure."""
    name, ids = metric.card.name, [value.id for value in metric.card.values]
    reasons = {str(arrays[key]) for case in infos if (key := f"{case}/{name}:reason") in arrays}
    if reasons:
        return [SetValue(value, structure, 0, 0, reason=min(reasons)) for value in ids]
    features = {case: CaseFeatures(*(arrays[f"{case}/{name}:{part}"] for part in PARTS)) for case in infos}
    network = str(arrays[f"{min(infos)}/{name}:network"])
    sets = draw(features, infos)
    return [_value(metric, value, structure, sets, network) for value in ids]


def _value(metric: SetMetric, value_id: str, structure: str, sets: Draw, network: str) -> SetValue:
    clips = len(sets.clips)
    bare = SetValue(value_id, structure, sets.n, clips, real=sets.hash, network=network)
    if sets.n < (least := metric.least(value_id)):
        return replace(bare, reason=f"{value_id} needs {least} windows in each set, here {sets.n}")

    def both(a: tuple[Sample, Sample], b: tuple[Sample, Sample]) -> float:
        return 0.5 * (metric.value(value_id, a[0], b[1]) + metric.value(value_id, a[1], b[0]))

    value, floor = both(sets.real, sets.generated), both(sets.real, sets.real)
    if not np.isfinite([value, floor]).all():
        return replace(bare, reason=f"{value_id} is undefined for {clips} clips")
    low, high = (_interval(value, both, sets) if clips >= CLIPS else None) or (None, None)
    return replace(bare, value=value, low=low, high=high, floor=floor)


Both = Callable[[tuple[Sample, Sample], tuple[Sample, Sample]], float]


def _interval(value: float, both: Both, sets: Draw) -> tuple[float, float] | None:
    """By leaving out a tenth of the clips at a time, of both halves."""
    group: dict[str, int] = {}
    for number, half in enumerate(sets.real):
        dealt = groups_of(Counter(half.clips.tolist()))
        group |= {clip: GROUPS - 1 - rank if number else rank for clip, rank in dealt.items()}

    def without(left_out: int) -> float:
        def kept(halves: tuple[Sample, Sample]) -> tuple[Sample, Sample]:
            one, other = (_without(half, group, left_out) for half in halves)
            return one, other

        return both(kept(sets.real), kept(sets.generated))

    return interval(value, without, GROUPS)


def _without(sample: Sample, group: Mapping[str, int], left_out: int) -> Sample:
    stays = np.array([group[clip] != left_out for clip in sample.clips.tolist()], dtype=bool)
    return Sample(sample.features[stays], sample.clips[stays])
