"""From the features of a unit's cases to its values: one per value id and set (a target structure)."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from retarget_bench.api import CaseFeatures, CaseInfo, Sample, SetMetric
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.attempt import attempt, sentence
from retarget_bench.evaluation.cases import LISTING, loaded
from retarget_bench.evaluation.plan import Plan
from retarget_bench.evaluation.score import Before, as_number, ask_metric, compared, nothing, seconds
from retarget_bench.evaluation.set_metrics import files
from retarget_bench.evaluation.set_metrics.draw import Draw, draw, draw_apart
from retarget_bench.evaluation.set_metrics.files import Members, SetMember
from retarget_bench.evaluation.set_metrics.values import SetValue
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.store import ResultPaths

Halves = tuple[Sample, Sample]
"""Two samples: the halves of a set, or real and other windows."""
Pair = tuple[float, float]
"""A value and its floor."""
NO_REAL = "the data set has no real motion of bodies of structure {} in this part"


def evaluate(
    plan: Plan,
    data: Spec,
    paths: ResultPaths,
    infos: Sequence[CaseInfo],
    before: Before = nothing,
) -> list[SetValue]:
    """Gather the features of a unit, whose cases are all answered, and compute its values.

    infos: of the cases that have features.
    """
    by_id = {info.id: info for info in infos}
    metrics = bound.metrics(plan.metrics).of_sets
    gathered = files.gather(metrics, paths, by_id if metrics else ())
    values = []
    for metric in metrics:
        name = metric.card.name
        sets: dict[str, dict[str, SetMember]] = {}
        for case, member in _of_one_width(name, gathered).items():
            sets.setdefault(member.name, {})[case] = member
        for structure, members in sorted(sets.items()):
            try:
                before(name)
                values += _values(plan, data, metric, structure, members, by_id)
            except Exception as error:
                reason = files.failed(name, sentence(error))
                values += [SetValue(each.id, structure, 0, 0, reason=reason) for each in metric.card.values]
    return values


def _of_one_width(metric: str, gathered: Mapping[str, Members]) -> dict[str, SetMember]:
    """Case -> its features for a metric; a reason in their place where they do not fit together."""
    members = {case: each[metric] for case, each in gathered.items() if metric in each}
    arrays = [
        array
        for each in members.values()
        if each.features
        for array in (each.features.generated, each.features.real)
    ]
    widths = sorted({array.shape[1] for array in arrays if len(array)})
    if len(widths) < 2:
        return members
    reason = files.failed(metric, f"gave features of {' and '.join(map(str, widths))} numbers")
    return {
        case: replace(each, features=None, reason=reason) if each.features else each
        for case, each in members.items()
    }


def _values(
    plan: Plan,
    data: Spec,
    metric: SetMetric,
    structure: str,
    members: Mapping[str, SetMember],
    infos: Mapping[str, CaseInfo],
) -> list[SetValue]:
    """All values of a metric on one structure, or on one of its own sets. Raises BenchError where the
    metric, or the data set, fails."""
    name, ids = metric.card.name, [value.id for value in metric.card.values]
    if reasons := {each.reason for each in members.values() if each.reason}:
        return [SetValue(value, structure, 0, 0, reason=min(reasons)) for value in ids]
    features = {case: each.features for case, each in members.items() if each.features}
    bare = SetValue("", structure, 0, 0)
    if all(len(each.real) == len(each.generated) for each in features.values()):
        return _drawn(metric, bare, draw(features, infos, metric.stretches))
    # cases without references: their answers against other real motion, also of the same kind alone
    real, real_infos = real_set(data, plan.metrics, name, plan.task, structure)
    values = []
    for kind in ("", *sorted({infos[case].kind for case in features} - {""})):
        answers = {case: each for case, each in features.items() if kind in ("", infos[case].kind)}
        others = {case: each for case, each in real.items() if kind in ("", real_infos[case].kind)}
        if others:
            values += _drawn(
                metric, replace(bare, kind=kind), draw_apart(answers, infos, others, real_infos)
            )
        else:
            reason = f"there is no real motion of kind {kind}" if real else NO_REAL.format(structure)
            values += [replace(bare, kind=kind, value_id=value, reason=reason) for value in ids]
    return values


@lru_cache(maxsize=8)
def real_set(
    data: Spec, metrics: tuple[str, ...], name: str, task: str, structure: str
) -> tuple[Mapping[str, CaseFeatures], Mapping[str, CaseInfo]]:
    """Features and facts of the real motion of bodies of a structure, by case id.

    They are kept for all methods that a process evaluates. Raises BenchError where the data set's real
    cases have no references.
    """
    (metric,) = (each for each in bound.metrics(metrics).of_sets if each.card.name == name)
    source = bound.dataset(data).built
    called = f"data set {source.card.name}, real"
    real = source.real
    assert real is not None
    listing = attempt(lambda: real(task, structure), LISTING, called)
    infos = {info.id: info for info in listing}
    features = {}
    for each, info in infos.items():
        case = loaded(source, info)
        if case.reference is None:
            raise BenchError(f"{each} is offered as real motion and has no reference")
        comparison = compared(case, case.reference)
        features[each] = ask_metric(metric, partial(metric.features, comparison), comparison, nothing)
    return features, infos


def _drawn(metric: SetMetric, bare: SetValue, sets: Draw) -> list[SetValue]:
    """All values of the sets that were drawn, with intervals where there are clips enough."""
    bare = replace(bare, n=sets.n, clips=len(sets.clips), real=sets.hash)
    values = [_value(metric, replace(bare, value_id=each.id), sets) for each in metric.card.values]
    parts = _without(metric, [each.value_id for each in values if each.value is not None], sets)
    values = [_with_interval(each, parts.get(each.value_id, ())) for each in values]
    return [
        _withheld(each, parts.get(each.value_id, ())) if each.value_id in metric.unbiased else each
        for each in values
    ]


def _with_interval(value: SetValue, parts: Sequence[Pair]) -> SetValue:
    """A value with the interval of what lies beyond its floor: which clips there are moves both alike."""
    if value.value is None or value.floor is None or not parts:
        return value
    beyond = interval(value.value - value.floor, [part - floor for part, floor in parts])
    if beyond is None:
        return value
    low, high = (value.floor + end for end in beyond)
    return replace(value, low=low, high=high, without=tuple(part for part, _ in parts))


def _withheld(value: SetValue, parts: Sequence[Pair]) -> SetValue:
    """A value that is 0 on average for real motion, or the reason why that cannot be said of this one."""
    if value.value is None or value.floor is None:
        return value
    if not parts:
        reason = (
            f"{value.value_id} needs {CLIPS} clips to tell whether real motion scores 0, here {value.clips}"
        )
    elif (ends := interval(value.floor, [floor for _, floor in parts])) and ends[0] <= 0.0 <= ends[1]:
        return value
    else:
        reason = f"{value.value_id} of real motion is {value.floor:.2g} here, where it should be about 0"
    return replace(value, value=None, low=None, high=None, floor=None, without=(), reason=reason)


def _value(metric: SetMetric, bare: SetValue, sets: Draw) -> SetValue:
    """A value and its floor."""
    name = bare.value_id
    if sets.n < (least := metric.least(name)):
        return replace(bare, reason=f"{name} needs {least} windows in each set, here {sets.n}")
    value, floor = _measured(metric, name, sets, sets.real, sets.generated, sets.whole)
    if not np.isfinite([value, floor]).all():
        return replace(bare, reason=f"{name} is undefined for {bare.clips} clips")
    return replace(bare, value=value, floor=floor)


def _measured(
    metric: SetMetric, value_id: str, sets: Draw, real: Halves, generated: Halves, whole: Halves
) -> Pair:
    """A value and its floor of the halves of a draw, or of parts of them."""
    floor = _mean(metric, value_id, (real[0], real[1]), (real[1], real[0]))
    if value_id in metric.distances and not sets.apart:
        return floor + _mean(metric, value_id, whole), floor
    return _mean(metric, value_id, (real[0], generated[1]), (real[1], generated[0])), floor


def _mean(metric: SetMetric, value_id: str, *pairs: Halves) -> float:
    """A value of real windows and others, on average over pairs of sets; nan where that is undefined.
    Raises BenchError where the metric fails."""

    def ask() -> float:
        mean = sum(metric.value(value_id, *pair) for pair in pairs) / len(pairs)
        undefined = isinstance(mean, float | np.floating) and not np.isfinite(mean)
        return float("nan") if undefined else as_number(value_id, mean)

    windows = sum(len(one.clips) for one in pairs[0])
    return attempt(ask, seconds(windows), f"metric {metric.card.name}, sets")


def _without(metric: SetMetric, ids: Sequence[str], sets: Draw) -> dict[str, list[Pair]]:
    """Value id -> values and floors without a tenth of the clips at a time, of both halves; none where
    there are too few clips.

    All values of one tenth before the next one: what they have in common is computed once.
    """
    group = _groups(sets)
    values: dict[str, list[Pair]] = {value_id: [] for value_id in ids}
    for left_out in range(GROUPS if ids and len(sets.clips) >= CLIPS else 0):
        parts = {
            id(some): some.part(np.flatnonzero([group[clip] != left_out for clip in some.clips.tolist()]))
            for some in (*sets.real, *sets.generated, *sets.whole)
        }
        real, generated, whole = (
            (parts[id(two[0])], parts[id(two[1])]) for two in (sets.real, sets.generated, sets.whole)
        )
        for value_id in ids:
            values[value_id].append(_measured(metric, value_id, sets, real, generated, whole))
    return values


def _groups(sets: Draw) -> dict[str, int]:
    """Clip -> which tenth it belongs to; where one half has the larger ones, the other has the smaller.

    Sets of different clips each have tenths: the errors of both add up in what leaving out one of either
    does.
    """
    group: dict[str, int] = {}
    samples = (*sets.real, sets.generated[0]) if sets.apart else sets.real
    clips = [half.clips.tolist() for half in samples]
    if not sets.apart and not set(clips[0]).isdisjoint(clips[1]):  # stretches of the same clips
        clips = [clips[0] + clips[1]]
    for number, names in enumerate(clips):
        dealt = groups_of(Counter(names))
        group |= {clip: GROUPS - 1 - rank if number == 1 else rank for clip, rank in dealt.items()}
    return group


GROUPS = 10
CLIPS = 10
"""Below so many clips no interval is given."""
LEVEL = 0.95


def groups_of(clips: Mapping[str, int]) -> dict[str, int]:
    """Clip -> group of a delete-a-group jackknife. ``clips``: clip -> windows.

    Clips are dealt out by size there and back, so that the groups are about equally large.
    """
    ordered = sorted(clips, key=lambda clip: (-clips[clip], clip))
    there_and_back = [*range(GROUPS), *reversed(range(GROUPS))]
    return {clip: there_and_back[rank % len(there_and_back)] for rank, clip in enumerate(ordered)}


def deviation(without: Sequence[float]) -> float:
    """The standard error from the values without each group: sqrt((G - 1) / G sum (v_g - mean v)^2)."""
    values = np.asarray(without, dtype=float)
    return float(np.sqrt((len(values) - 1) / len(values) * ((values - values.mean()) ** 2).sum()))


def interval(value: float, without: Sequence[float]) -> Pair | None:
    """Value -+ t(G - 1) times the jackknife's standard error; None where a value is undefined.

    without: the values without each of the G groups.
    """
    from scipy.special import stdtrit  # type: ignore[import-untyped]

    if not np.isfinite(without).all():
        return None
    reach = float(stdtrit(len(without) - 1, 0.5 + LEVEL / 2)) * deviation(without)
    return value - reach, value + reach
