"""How hard a case of a derived task is, in words and in order, from its conditions."""

from __future__ import annotations

from collections.abc import Mapping

from retarget_bench.evaluation.tasks.questions import MAJOR

NONE = "no level"


def name(conditions: Mapping[str, float]) -> str:
    """``5 cm`` of noise, ``50 %`` of the joints, ``major`` joints."""
    if "noise" in conditions:
        return f"{100 * conditions['noise']:g} cm"
    if MAJOR in conditions:
        return MAJOR
    return f"{100 * conditions['proportion']:g} %" if "proportion" in conditions else NONE


def order(conditions: Mapping[str, float]) -> tuple[bool, float]:
    """Sorts levels: by their number, and those without one last."""
    number = conditions.get("noise", conditions.get("proportion"))
    return number is None, number or 0.0


def number(name: str) -> float | None:
    """The number of a level by its name: centimetres of noise, per cent of the joints; None without."""
    first = name.split()[0] if name else ""
    try:
        return float(first)
    except ValueError:
        return None
