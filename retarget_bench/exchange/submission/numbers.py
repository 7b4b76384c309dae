"""Checks of a submission's numbers: possible, of values as their metrics declare them, none left out."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from retarget_bench.api import Case, CaseInfo, Dataset, OwnSets, Prediction, Value, optional
from retarget_bench.evaluation.predict import as_scored
from retarget_bench.evaluation.score import score
from retarget_bench.evaluation.set_metrics import files as set_files
from retarget_bench.motion.motion import Motion, Surface
from retarget_bench.plugins import bound, registry
from retarget_bench.results import case_metadata
from retarget_bench.results.header import DeclaredValue
from retarget_bench.results.paths import ARRAY_INDICES
from retarget_bench.results.store import CaseResult, Results

LARGEST = 1e12
"""Size from which a number is none that any motion gives."""
LOOKED_AT = 20
"""Cases of which the values are compared with those that any answer has."""
FACTS = ("unit", "better", "goal", "index", "with_self")
"""Of a value's declaration, what decides how its numbers are read."""


def checks(results: Results, data: Dataset) -> Iterator[str]:
    """Everything that is wrong with the numbers of one split, as sentences."""
    working = registry.working("metrics")[0]
    declared = {value.id: value for metric in working.values() for value in metric.card.computed}
    yield from _metrics(results, working)
    yield from _declarations({**results.header.values, **results.header.set_values}, declared)
    yield from _bounds(results, declared)
    infos = {info.id: info for info in data.cases(results.paths.task, results.paths.split)}
    answered = [entry for entry in results.entries if entry.status == "ok" and entry.case in infos]
    first = data.load(infos[answered[0].case]) if answered else None
    yield from _sets(results, declared, working, first)
    yield from _metadata(results, data)
    yield from _left_out(results, data, answered, infos)


def _metrics(results: Results, working: Mapping[str, Any]) -> Iterator[str]:
    """Metrics that take part in every run, and values of one, that the header lacks."""
    header = results.header
    task = results.paths.task
    for name, metric in working.items():
        asked = registry.find("metrics", name).origin == registry.BUILT_IN
        if name not in header.metrics:
            if asked and task in optional.metric_tasks(metric):
                yield f"there are no values of {name}; score all metrics"
            continue
        said = header.set_values if optional.is_set_metric(metric) else header.values
        same = header.metrics[name] == bound.metrics((name,)).versions[name]
        if same and (lacking := {value.id for value in metric.card.computed} - said.keys()):
            yield f"the header lacks {', '.join(sorted(lacking)[:3])} of {name}"


def _declarations(said: Mapping[str, DeclaredValue], declared: Mapping[str, Value]) -> Iterator[str]:
    for name in sorted(said.keys() & declared.keys()):
        if other := [fact for fact in FACTS if getattr(said[name], fact) != getattr(declared[name], fact)]:
            yield f"the header declares another {other[0]} of {name} than its metric"


def _bounds(results: Results, declared: Mapping[str, Value]) -> Iterator[str]:
    seen = set()
    for entry in results.entries:
        for name, number in entry.values.items():
            curve = number if isinstance(number, dict) else {"": number}
            if name in seen:
                continue
            if ("" not in curve) != bool(results.header.values[name].index):
                seen.add(name)
                yield f"{name} of {entry.case} is {'no' if '' in curve else 'a'} curve"
            elif beyond := [one for one in curve.values() if not _possible(declared.get(name), one)]:
                seen.add(name)
                yield f"{name} of {entry.case} is {beyond[0]:g}, which is not possible"


def _possible(value: Value | None, number: float) -> bool:
    return abs(number) < LARGEST and (value is None or value.allows(number))


def _sets(
    results: Results, declared: Mapping[str, Value], working: Mapping[str, Any], first: Case | None
) -> Iterator[str]:
    """first: an answered case, whose set has to be there."""
    said = results.header.set_values
    sets: dict[str, set[tuple[str, str]]] = {name: set() for name in said}
    for one in set_files.read(results.paths):
        if one.value_id not in said:
            yield f"the header does not say what {one.value_id} is"
            return
        if (one.structure, one.kind) in sets[one.value_id]:
            yield f"{one.value_id} of {one.structure} stands twice"
        sets[one.value_id].add((one.structure, one.kind))
        shown = [each for each in (one.value, one.floor) if each is not None]
        if not all(_possible(declared.get(one.value_id), each) for each in shown):
            yield f"{one.value_id} of {one.structure} is {one.value}, floor {one.floor}: not possible"
    for name, value in said.items():
        metric = working.get(value.metric)
        alike = next(sets[other] for other in said if said[other].metric == value.metric)
        if sets[name] != alike or (metric and first and not _has(sets[name], metric, first)):
            yield f"values of {name} are left out"


def _has(sets: set[tuple[str, str]], metric: Any, case: Case) -> bool:
    """True where the set that a case belongs to is among these, or it belongs to none."""
    belongs = metric.set_of(case) if isinstance(metric, OwnSets) else case.target.structure
    return not belongs or (belongs, "") in sets


def _metadata(results: Results, data: Dataset) -> Iterator[str]:
    """What is known of the cases besides: whatever tables group rows by has to be the data set's own."""
    paths = results.paths
    with TemporaryDirectory() as folder:
        own = replace(paths, root=Path(folder))
        case_metadata.write(own, data, data.cases(paths.task, paths.split))
        for kind in case_metadata.FIELDS:
            theirs = paths.folder / f"cases.{kind}.csv"
            ours = own.folder / theirs.name
            if theirs.exists() and not (ours.exists() and ours.read_bytes() == theirs.read_bytes()):
                yield f"{theirs.name} is not what the data set says here"


# ------------------------------------------------------------------------------------------- left out
def _left_out(
    results: Results, data: Dataset, answered: list[CaseResult], infos: Mapping[str, CaseInfo]
) -> Iterator[str]:
    """Values that cases lack though any answer to them has these; a few cases of every kind are tried."""
    working = registry.working("metrics")[0]
    ours = bound.metrics(tuple(name for name in results.header.metrics if name in working)).of_cases
    turned = any("rotations" in results.header.values[name].needs for e in answered for name in e.values)
    wanted = {
        value.id
        for metric in ours
        for value in metric.card.computed
        if value.index not in ARRAY_INDICES and (turned or "rotations" not in value.needs)
    }
    for info, lacking in _suspects(answered, infos, wanted & results.header.values.keys()):
        always = _always(ours, data.load(info))
        if gone := sorted(lacking & always):
            yield f"{info.id} has no {', '.join(gone[:3])}, though every answer to it has"


def _suspects(
    answered: list[CaseResult], infos: Mapping[str, CaseInfo], wanted: set[str]
) -> list[tuple[CaseInfo, frozenset[str]]]:
    """Cases and what they lack: two of all that lack the same, of the fewest such first."""
    alike: dict[frozenset[str], list[str]] = {}
    for entry in answered:
        if lacking := frozenset(wanted - entry.values.keys()):
            alike.setdefault(lacking, []).append(entry.case)
    rare = sorted(alike.items(), key=lambda item: len(item[1]))
    return [(infos[case], lacking) for lacking, cases in rare for case in cases[:2]][:LOOKED_AT]


def _always(ours: tuple[Any, ...], case: Case) -> set[str]:
    """The values that the reference has and also an answer that stands still nowhere."""
    if case.reference is None:
        return set()
    tried = (case.reference, _jumping(case.reference, case.target.height))
    return set.intersection(*(set(score(ours, case, as_scored(each)).values) for each in tried))


def _jumping(right: Prediction, height: float) -> Prediction:
    """A motion that is somewhere else in every frame."""
    away = np.random.default_rng(0).normal(scale=height, size=(right.frames, 3))
    if isinstance(right, Motion):
        return replace(right, root=right.root + away)
    if isinstance(right, Surface):
        return replace(right, vertices=right.vertices + away[:, None])
    return replace(right, positions=right.positions + away[:, None])
