"""Lists of methods, metrics and data sets, and the packages of plug-ins that can be called for them."""

from __future__ import annotations

from typing import Any

from retarget_bench.plugins import registry
from retarget_bench.python.views import ListFrame


def methods() -> ListFrame:
    """A row per method that can be run: ``name``, ``summary``, ``origin``. None is imported."""
    return _entries("methods")


def datasets() -> ListFrame:
    """A row per data set: ``name``, ``summary``, ``origin``. None is imported."""
    return _entries("datasets")


def metrics() -> ListFrame:
    """A row per value of every metric: ``metric``, ``value_id`` (names a column of tables), ``label``,
    ``unit``, ``better`` (``lower``, ``higher``, ``target`` or ``none``), ``meaning``, and ``index``: what
    it is a curve over, or nothing. Broken metrics are left out."""
    metrics_by_name, _ = registry.working("metrics")
    return ListFrame(
        [
            {"metric": name, "value_id": value.id} | {each: getattr(value, each) for each in FACTS}
            for name, metric in metrics_by_name.items()
            for value in metric.card.values
        ]
    )


FACTS = ("label", "unit", "better", "meaning", "index")


def _entries(kind: registry.Kind) -> ListFrame:
    rows: list[dict[str, Any]] = [
        {"name": entry.name, "summary": entry.summary, "origin": entry.origin}
        for entry in registry.names(kind)
    ]
    return ListFrame(rows, columns=["name", "summary", "origin"])
