"""Snapshots: measured numbers with the facts that they depend on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from retarget_bench.api import Metric, SetMetric
from retarget_bench.api.optional import is_set_metric, metric_tasks
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.score import declared_values
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification.gate import frozen, method_rows
from retarget_bench.verification.gate.table import Table

Progress = Callable[[int, int], None]
VALUE_FACTS = ("unit", "better", "goal", "tolerance", "index", "with_self")


@dataclass
class Snapshot:
    """Golden rows, or what is measured now.

    complete: frozen motions are part of it, and every built-in method that runs by default.
    dataset:  ``spec`` as it was asked for, ``name``, ``parameters`` that are no defaults, ``content``, and
              of each split the number of its cases and a hash of their ids (``lists``).
    smoke:    split -> the ids of its cases that methods are asked.
    metrics:  metric -> version. values: value id -> ``VALUE_FACTS`` and its metric.
    methods:  label -> version and hash of its weights.
    motions:  frozen file -> hash.
    frozen:   ``<file>/<prediction>`` -> column -> number.
    rows:     method -> ``<split> <case>`` (and ``<split> mean``, as tables have it) -> column -> number.
    problems: method -> ``<split> <case>`` -> why there is no answer.
    failures: of frozen motions, ``<row> <metric>`` -> the error of a metric.
    missing:  sentences: what could not be measured at all. Never written to a file.
    """

    complete: bool
    dataset: dict[str, Any]
    smoke: dict[str, list[str]]
    metrics: dict[str, str]
    values: dict[str, dict[str, Any]]
    methods: dict[str, dict[str, str]] = field(default_factory=dict)
    motions: dict[str, str] = field(default_factory=dict)
    frozen: Table = field(default_factory=dict)
    rows: dict[str, Table] = field(default_factory=dict)
    problems: dict[str, dict[str, str]] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class GateRequest:
    """A request for a snapshot.

    methods: labels, in the order of the report. metrics: names. wanted: split -> case ids, or None: those
    that ``method_rows.choose`` takes. folder: where the frozen motions lie, or None: none are measured.
    """

    methods: tuple[str, ...]
    metrics: tuple[str, ...]
    dataset: Spec
    wanted: Mapping[str, Sequence[str]] | None
    folder: Path | None


def measure(request: GateRequest, progress: Progress) -> Snapshot:
    """Everything asked for. What cannot be measured is named in ``missing``; the rest goes on."""
    missing: list[str] = []
    metrics = _metrics(request.metrics, missing)
    names = tuple(metric.card.name for metric in metrics if not is_set_metric(metric))
    found = Snapshot(
        complete=request.folder is not None,
        dataset={},
        smoke={},
        metrics={metric.card.name: str(metric.card.version) for metric in metrics},
        values=_value_facts(metrics),
        missing=missing,
    )
    if request.folder is not None:
        found.motions = frozen.hashes(request.folder)
        try:
            measured = frozen.measure(request.folder, metrics, progress)
            found.frozen, found.failures = measured.table, measured.failures
            found.values |= _feature_facts(metrics, measured.networks)
        except BenchError as error:
            missing.append(str(error))
        if not found.motions:
            missing.append(f"{request.folder / frozen.FOLDER} has no frozen motion")
    _measure_methods(request, names, found, progress)
    return found


def _measure_methods(
    request: GateRequest, names: tuple[str, ...], found: Snapshot, progress: Progress
) -> None:
    asked = method_rows.prepare(request.dataset, request.wanted, found.missing)
    found.dataset, found.smoke = asked.facts, {split: [i.id for i in infos] for split, infos in asked}
    if not any(found.smoke.values()):
        found.missing.append(f"{request.dataset} has no case to ask methods")
        return
    methods = method_rows.methods(request.methods, found.missing)
    found.methods = {label: method_rows.method_facts(spec) for label, spec in methods.items()}
    answers = method_rows.measure(asked, methods, names, found.missing, progress)
    found.rows = {label: answer.table for label, answer in answers.items()}
    found.problems = {label: answer.problems for label, answer in answers.items() if answer.problems}


def _metrics(names: Sequence[str], missing: list[str]) -> tuple[Metric | SetMetric, ...]:
    """The metrics that can be built; the others are missing."""
    kept: list[Metric | SetMetric] = []
    for name in names:
        try:
            metric = registry.create("metrics", name)
            declared_values([*kept, metric])
        except BenchError as error:
            missing.append(str(error))
            continue
        kept.append(metric)
    return tuple(kept)


def _value_facts(metrics: Sequence[Metric | SetMetric]) -> dict[str, dict[str, Any]]:
    return {
        value.id: {"metric": metric.card.name} | {name: getattr(value, name) for name in VALUE_FACTS}
        for metric in metrics
        for value in metric.card.values
    }


def _feature_facts(
    metrics: Sequence[Metric | SetMetric], networks: Mapping[str, Mapping[str, str]]
) -> dict[str, dict[str, Any]]:
    """Of set metrics: their features, as if these were a value, with the networks that make them."""
    plain = {"unit": "1", "better": "none", "goal": 1.0, "index": "sum", "with_self": False}
    return {
        frozen.feature_value(metric): {"metric": metric.card.name, **plain, "tolerance": frozen.TOLERANCE}
        | {"networks": dict(networks[metric.card.name])}
        for metric in metrics
        if is_set_metric(metric) and metric.card.name in networks
    }


def own_metrics() -> tuple[str, ...]:
    """The built-in metrics and those of ``--plugin`` files; what else is installed does not matter, nor do
    those of derived tasks, which no case here is of."""
    files = registry.files()
    return tuple(
        entry.name
        for entry in registry.names("metrics")
        if (entry.origin == registry.BUILT_IN or entry.origin in files) and _retargets(entry.name)
    )


def _retargets(name: str) -> bool:
    """Whether a metric is one of retargeting; one that cannot be built counts, so that it is reported."""
    try:
        return "retarget" in metric_tasks(registry.create("metrics", Spec(name)))
    except BenchError:
        return True
