"""The header of a result file: what ran, on what, with which versions, and what went wrong."""

import platform
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import retarget_bench
from retarget_bench.api import AnyMetric
from retarget_bench.evaluation.plan import EvaluationUnit
from retarget_bench.evaluation.prediction import environments
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.header import (
    ELSEWHERE,
    Counts,
    DatasetInfo,
    DeclaredValue,
    MethodInfo,
    MetricFault,
    Problem,
    ResultHeader,
)
from retarget_bench.results.store import CaseResult

PACKAGES = ("numpy", "scipy", "torch")


def header_of(unit: EvaluationUnit, entries: Sequence[CaseResult]) -> ResultHeader:
    """The header of a finished unit."""
    plan = unit.plan
    data = unit.data
    of_sets = unit.metrics.of_sets
    four_legged = None
    if of_sets and data.real is not None:
        four_legged = tuple(sorted({b.structure for b in data.characters().values() if b.four_legged}))
    return ResultHeader(
        set_values=_values(of_sets),
        # what tables need to know of structures that answers without references are of
        four_legged=four_legged,
        keys=unit.keys,
        task=plan.task,
        split=unit.split,
        method=_method(unit),
        dataset=DatasetInfo(
            name=unit.dataset.spec.name,
            parameters=unit.dataset.parameters,
            label=data.label,
            version=data.card.version,
            content=data.content,
            splits=dict(data.card.splits),
            notes=tuple(data.notes),
            unreadable=data.unreadable,
        ),
        metrics=unit.metrics.versions,
        values=_values((*unit.metrics.of_cases, *unit.metrics.of_pairs)),
        counts=Counts.of(entry.status for entry in entries),
        problems=_problems(entry for entry in entries if entry.status != "ok"),
        doubts=_problems(
            replace(entry, status="doubted") for entry in entries if entry.status == "ok" and entry.message
        ),
        faults=_faults(entries),
        seeds=(plan.seed,),
        versions=versions(),
        revision=revision(),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
    )


def _method(unit: EvaluationUnit) -> MethodInfo:
    common: dict[str, Any] = {
        "name": unit.method.spec.name,
        "label": str(unit.known_as),
        "parameters": dict(unit.known_as.parameters),
        "posts": tuple(_post_facts(post, unit.plan.external is None) for post in unit.known_as.posts),
        "code": unit.prediction_facts["code"],
    }
    if unit.plan.external:
        return MethodInfo(**common, origin=ELSEWHERE, privileged=(), control=False)
    method = unit.method.built
    card, trained = method.card, method.training_manifest
    manifest = None if trained is None else {key: tuple(map(str, each)) for key, each in trained.items()}
    return MethodInfo(
        **common,
        summary=str(card.summary),
        origin=registry.find("methods", unit.method.spec.name).origin,
        version=str(card.version),
        privileged=tuple(card.needs),
        control=bool(card.control),
        stochastic=bool(card.stochastic),
        root_rule=str(method.root_rule),
        folders=unit.method.folders,
        trained_on=manifest,
        training_share=method.training_share,
        authors_weights=str(card.authors_weights),
        environment=environments.facts(unit.environment) if unit.environment else {},
    )


def _post_facts(post: Spec, run_here: bool) -> dict[str, Any]:
    facts: dict[str, Any] = {"name": post.name, "parameters": dict(post.parameters)}
    if run_here:
        facts["version"] = str(registry.create("posts", post).card.version)
        facts["origin"] = registry.find("posts", post.name).origin
    return facts


def _values(metrics: Sequence[AnyMetric]) -> dict[str, DeclaredValue]:
    """Value id -> its declaration for tables, with its metric."""
    return {
        value.id: DeclaredValue.of(value, metric.card.name)
        for metric in metrics
        for value in metric.card.computed
    }


def _problems(entries: Iterable[CaseResult]) -> tuple[Problem, ...]:
    """Cases with their status and message, those with the same ones together."""
    pairs = [((each.status, each.message), each.case) for each in entries]
    return tuple(
        Problem(status=status, message=message, cases=cases) for (status, message), cases in _grouped(pairs)
    )


def _faults(entries: Sequence[CaseResult]) -> tuple[MetricFault, ...]:
    """Cases that lack the values of a metric, those with the same fault together."""
    pairs = [(fault, each.case) for each in entries for fault in each.faults.items()]
    return tuple(
        MetricFault(metric=metric, message=message, cases=cases)
        for (metric, message), cases in _grouped(pairs)
    )


def _grouped(pairs: Iterable[tuple[tuple[str, str], str]]) -> list[tuple[tuple[str, str], tuple[str, ...]]]:
    """The cases of each of some reasons, both sorted."""
    cases: dict[tuple[str, str], list[str]] = {}
    for reason, case in pairs:
        cases.setdefault(reason, []).append(case)
    return [(reason, tuple(sorted(cases[reason]))) for reason in sorted(cases)]


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that numbers depend on, without importing them."""
    versions = {"retarget-bench": retarget_bench.__version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return versions | {"platform": f"{sys.platform}-{platform.machine()}"}


@lru_cache(maxsize=1)
def revision() -> str:
    """The git revision of the checkout, ``+`` where it has uncommitted changes; "" outside of one."""
    folder = Path(retarget_bench.__file__).parent.parent
    if not (folder / ".git").exists():
        return ""
    command = ["git", "describe", "--always", "--exclude=*", "--abbrev=12", "--dirty=+"]
    try:
        output = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return output.stdout.strip()
