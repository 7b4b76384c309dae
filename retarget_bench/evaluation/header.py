"""The header of a result file: what ran, on what, with which versions, and what went wrong."""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import retarget_bench
from retarget_bench.api import Dataset, Method, Metric, SetMetric
from retarget_bench.evaluation import score
from retarget_bench.evaluation.plan import (
    EvaluationUnit,
    method,
    metric_versions,
    metrics,
    set_metrics,
    value_facts,
    without_location,
)
from retarget_bench.evaluation.predict import declared
from retarget_bench.evaluation.set_metrics.real import offers
from retarget_bench.plugins import registry
from retarget_bench.results.store import SCHEMA, STATUSES, CaseResult

PACKAGES = ("numpy", "scipy", "torch")


def header_of(cell: EvaluationUnit, entries: Sequence[CaseResult]) -> dict[str, Any]:
    """The header for a finished cell; plain data, ready for JSON."""
    plan = cell.plan
    data = cell.data
    return _sets(cell) | {
        "schema": SCHEMA,
        "keys": cell.keys,
        "task": plan.task,
        "split": cell.split,
        "method": _method(cell),
        "dataset": {
            "name": cell.dataset.name,
            "parameters": without_location(cell.dataset),
            "label": data.label,
            "version": data.card.version,
            "content": data.content,
            "notes": list(data.notes),
        },
        "metrics": metric_versions(plan.metrics),
        "values": _values(metrics(plan.metrics)),
        "counts": {"asked": len(entries)}
        | {status: sum(entry.status == status for entry in entries) for status in STATUSES},
        "problems": _problems(entries),
        "seeds": [plan.seed],
        "device": "cpu",
        "threads": 1,
        "versions": versions(),
        "revision": revision(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _method(cell: EvaluationUnit) -> dict[str, Any]:
    common = {
        "name": cell.method.name,
        "label": str(cell.known_as),
        "summary": "" if cell.plan.external else str(getattr(method(cell.method).card, "summary", "")),
        "parameters": dict(cell.known_as.parameters),
        **_posts(cell),
    }
    if cell.plan.external:
        return common | {
            "origin": "predictions made elsewhere",
            "version": "",
            "code": cell.prediction_facts["code"],
            "privileged": [],
            "control": False,
            "stochastic": False,
        }
    card = method(cell.method).card
    return common | {
        "origin": registry.find("methods", cell.method.name).origin,
        "version": str(getattr(card, "version", "")),
        "code": cell.prediction_facts["code"],
        "privileged": list(declared(method(cell.method), "needs")),
        "control": bool(getattr(card, "control", False)),
        "stochastic": bool(getattr(card, "stochastic", False)),
        "trained_on": _manifest(method(cell.method)),
    }


def _posts(cell: EvaluationUnit) -> dict[str, Any]:
    """What was done to the method's answers, in order; nothing where nothing was."""
    found = []
    for post in cell.known_as.posts:
        facts: dict[str, Any] = {"name": post.name, "parameters": dict(post.parameters)}
        if not cell.plan.external:
            card = registry.create("posts", post).card
            origin = registry.find("posts", post.name).origin
            facts |= {"version": str(card.version), "origin": origin}
        found.append(facts)
    return {"posts": found} if found else {}


def _manifest(asked: Method) -> dict[str, list[str]] | None:
    """What a method's weights were trained on (characters, structures, kinds, clips); None: untrained."""
    manifest = getattr(asked, "training_manifest", None)
    return None if manifest is None else {key: list(map(str, names)) for key, names in manifest.items()}


def _values(asked: Sequence[Metric] | Sequence[SetMetric]) -> dict[str, Any]:
    """Value id -> what tables need to know of it, its metric included."""
    owner = {value.id: metric.card.name for metric in asked for value in metric.card.values}
    return {
        key: {**value_facts(value), "needs": list(value.needs), "metric": owner[key]}
        for key, value in score.declared_values(asked).items()
    }


def _sets(cell: EvaluationUnit) -> dict[str, Any]:
    """What is declared of values of whole sets and what makes their features; nothing without any."""
    asked = set_metrics(cell.plan.metrics)
    if not asked:
        return {}
    data = cell.data
    return {
        "set_values": _values(asked),
        "networks": cell.networks,
        # what tables need to know of structures that answers without references are of
        **({"four_legged": _four_legged(data)} if offers(data) else {}),
    }


def _four_legged(data: Dataset) -> list[str]:
    return sorted({body.structure for body in data.characters().values() if body.four_legged})


def _problems(entries: Sequence[CaseResult]) -> list[dict[str, Any]]:
    """Cases without values, those with the same status and message together."""
    grouped: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        if entry.status != "ok":
            grouped.setdefault((entry.status, entry.message), []).append(entry.case)
    return [
        {"status": status, "message": message, "cases": sorted(cases)}
        for (status, message), cases in sorted(grouped.items())
    ]


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of Python and of the packages that numbers depend on, without importing them."""
    found = {"retarget-bench": retarget_bench.__version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found | {"platform": f"{sys.platform}-{platform.machine()}"}


@lru_cache(maxsize=1)
def revision() -> str:
    """The git revision of the checkout, ``+`` where it has uncommitted changes; "" outside of one."""
    folder = Path(retarget_bench.__file__).parent.parent
    if not (folder / ".git").exists():
        return ""
    try:
        options = {"cwd": folder, "capture_output": True, "text": True, "timeout": 10, "check": True}
        head = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], **options)  # type: ignore[call-overload]
        dirty = subprocess.run(["git", "status", "--porcelain", "-uno"], **options)  # type: ignore[call-overload]
    except (OSError, subprocess.SubprocessError):
        return ""
    return str(head.stdout.strip()) + ("+" if dirty.stdout.strip() else "")
