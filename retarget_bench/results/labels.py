"""Current labels for stored values: results keep the labels of the day on which they were scored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.results.header import DeclaredValue


def with_current_labels(values: Mapping[str, DeclaredValue]) -> dict[str, DeclaredValue]:
    """The same declarations, with label and meaning as the installed metric has them.

    values: by id. A value is unchanged where its metric is not installed, or gives it another unit.
    """
    installed = {
        value.id: value
        for metric in dict.fromkeys(each.metric for each in values.values())
        for value in _values_of(metric)
    }
    return {
        key: replace(each, label=installed[key].label, meaning=installed[key].meaning)
        if key in installed and installed[key].unit == each.unit
        else each
        for key, each in values.items()
    }


def _values_of(metric: str) -> tuple[Any, ...]:
    try:
        return tuple(registry.create("metrics", metric).card.values) if metric else ()
    except BenchError:
        return ()
