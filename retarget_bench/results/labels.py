"""Current labels for stored values: results keep the labels of the day on which they were scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry


def with_current_labels(values: Mapping[str, Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """The same declarations, with label and meaning as the installed metric has them.

    values: value id -> what a header declares of it. A value stays as it is where its metric is not
    installed, or declares another unit for the id.
    """
    installed = {
        value.id: value
        for metric in dict.fromkeys(str(each.get("metric", "")) for each in values.values())
        for value in _values_of(metric)
    }
    return {
        key: {**each, "label": installed[key].label, "meaning": installed[key].meaning}
        if key in installed and installed[key].unit == each["unit"]
        else each
        for key, each in values.items()
    }


def _values_of(metric: str) -> tuple[Any, ...]:
    try:
        return tuple(registry.create("metrics", metric).card.values) if metric else ()
    except BenchError:
        return ()
