"""From the features of a cell's cases to its values: one per value id and target structure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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

Halves = tuple[Sample, Sample]


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
    bare = SetValue("", structure, sets.n, len(sets.clips), real=sets.hash, network=network)
    found = [_value(metric, replace(bare, value_id=each), sets) for each in ids]
    if bare.clips < CLIPS:
        return found
    defined = [each.value_id for each in found if each.value is not None]
    without = _without(metric, defined, sets)
    return [_bounded(each, without[each.value_id]) if each.value_id in without else each for each in found]


def _value(metric: SetMetric, bare: SetValue, sets: Draw) -> SetValue:
    """A value and its floor."""
    name = bare.value_id
    if sets.n < (least := metric.least(name)):
        return replace(bare, reason=f"{name} needs {least} windows in each set, here {sets.n}")
    value, floor = _both(metric, name, sets.real, sets.generated), _both(metric, name, sets.real, sets.real)
    if not np.isfinite([value, floor]).all():
        return replace(bare, reason=f"{name} is undefined for {bare.clips} clips")
    return replace(bare, value=value, floor=floor)


def _both(metric: SetMetric, value_id: str, a: Halves, b: Halves) -> float:
    """The real windows of either half against the other ones of the other half."""
    return 0.5 * (metric.value(value_id, a[0], b[1]) + metric.value(value_id, a[1], b[0]))


def _without(metric: SetMetric, ids: Sequence[str], sets: Draw) -> dict[str, list[float]]:
    """Value id -> the values without a tenth of the clips at a time, of both halves.

    All values of one tenth before the next one: what they have in common is computed once.
    """
    group = _groups(sets)
    found: dict[str, list[float]] = {value_id: [] for value_id in ids}
    for left_out in range(GROUPS if ids else 0):
        real, generated = (
            (_kept(halves[0], group, left_out), _kept(halves[1], group, left_out))
            for halves in (sets.real, sets.generated)
        )
        for value_id in ids:
            found[value_id].append(_both(metric, value_id, real, generated))
    return found


def _groups(sets: Draw) -> dict[str, int]:
    """Clip -> which tenth it belongs to; where one half has the larger ones, the other has the smaller."""
    group: dict[str, int] = {}
    for number, half in enumerate(sets.real):
        dealt = groups_of(Counter(half.clips.tolist()))
        group |= {clip: GROUPS - 1 - rank if number else rank for clip, rank in dealt.items()}
    return group


def _kept(sample: Sample, group: Mapping[str, int], left_out: int) -> Sample:
    return sample.part(np.flatnonzero([group[clip] != left_out for clip in sample.clips.tolist()]))


def _bounded(found: SetValue, without: Sequence[float]) -> SetValue:
    assert found.value is not None
    low, high = interval(found.value, without) or (None, None)
    return replace(found, low=low, high=high)
