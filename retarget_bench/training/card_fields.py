"""What the fields of a card of weights have to be, so that nobody who reads one need look again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Check = Callable[[Any], bool]


def wrong(card: Mapping[str, Any]) -> str:
    """The first known field that is not what it has to be, as a sentence's end; "" where all are."""
    for name, (check, what) in FIELDS.items():
        if name in card and not check(card[name]):
            return f"its {name} has to be {what}"
    return ""


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _scalar(value: Any) -> bool:
    return isinstance(value, str | int | float)


def _mapping(of: Check) -> Check:
    return lambda value: isinstance(value, Mapping) and all(map(of, value.values()))


def _list(of: Check) -> Check:
    return lambda value: isinstance(value, list) and all(map(of, value))


_SCORES = _mapping(_mapping(_number))


def _data(value: Any) -> bool:
    return isinstance(value, Mapping) and _number(value.get("hours", 0))


def _validated(value: Any) -> bool:
    if not isinstance(value, Mapping) or not _whole(value.get("step")):
        return False
    scores = value.get("scores", {})
    return _SCORES(scores) and bool(scores) and all(scores.values())


FIELDS: Mapping[str, tuple[Check, str]] = {
    **dict.fromkeys(
        ("hash", "method", "version", "preset", "command", "hardware", "torch", "scored_as"),
        (_text, "a text"),
    ),
    **dict.fromkeys(("seed", "steps", "step", "processes"), (_whole, "a whole number")),
    "seconds": (_number, "a number"),
    "facts": (_mapping(_scalar), "parameters by name"),
    "data": (_data, "facts by name, hours a number"),
    "recipe": (_mapping(lambda value: value is None or _scalar(value)), "values by name"),
    "init": (lambda value: value is None or _text(value), "a text or null"),
    "losses": (_mapping(_number), "numbers by name"),
    "validation": (_list(_validated), "a list, each with a step and with scores by split and name"),
    "scores": (_SCORES, "numbers by split and name"),
    "training_manifest": (_mapping(_list(_scalar)), "lists of names"),
    "notes": (_list(_text), "a list of sentences"),
}
"""Name -> whether a value will do, and what would."""
