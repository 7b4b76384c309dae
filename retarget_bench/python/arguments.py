"""Arguments of the Python interface checked against their annotations: a wrong one is a sentence."""

from __future__ import annotations

import inspect
import numbers
from collections.abc import Callable, Collection, Sequence
from functools import cache, wraps
from types import SimpleNamespace, UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from retarget_bench.errors import BenchError

P = ParamSpec("P")
T = TypeVar("T")
NUMBERS: dict[Any, type] = {int: numbers.Integral, float: numbers.Real}
WORDS = {
    "str": "text",
    "PathLike": "a path",
    "int": "a whole number",
    "float": "a number",
    "NoneType": "None",
    "ModuleType": "a module",
    "Callable": "a class or function",
}


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """The function, which raises BenchError for an argument of another type than its annotation has.

    Arguments that are missing or have unknown names are TypeErrors, as everywhere in Python. Truth values
    are not looked at.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> T:
        try:
            bound = signature.bind(*given, **named)
        except TypeError:
            return function(*given, **named)  # which says it in Python's words
        for name, value in bound.arguments.items():
            if name not in (known := _kinds(function)):
                continue
            several = signature.parameters[name].kind is inspect.Parameter.VAR_POSITIONAL
            for each in value if several else (value,):
                if not fits(each, known[name]):
                    raise BenchError(
                        f"{function.__name__}: {name} is {_shown(each)}, of type {type(each).__name__}; "
                        f"it takes {' or '.join(dict.fromkeys(_words(known[name])))}"
                    )
        return function(*given, **named)

    return call


@cache
def _kinds(function: Callable[..., Any]) -> dict[str, Any]:
    """Parameter -> its annotation, resolved; that of what is returned may name what is not imported."""
    parameters = inspect.signature(function).parameters
    named = {
        name: each.annotation
        for name, each in parameters.items()
        if each.annotation is not each.empty and each.kind is not each.VAR_KEYWORD
    }
    scope = inspect.unwrap(function).__globals__
    return get_type_hints(SimpleNamespace(__annotations__=named), scope)


def fits(value: object, kind: Any) -> bool:
    """True if a value is of an annotated type, sequences item by item."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(fits(value, each) for each in inner)
    if origin is Sequence:
        if not isinstance(value, Collection) or isinstance(value, str | bytes):
            return False
        return all(fits(each, inner[0]) for each in value)
    if origin is Callable:
        return callable(value)
    if origin is Literal:
        return value in inner
    kind = NUMBERS.get(kind, origin or kind)
    return kind in (Any, bool) or isinstance(value, kind)


def _words(kind: Any) -> list[str]:
    """The types that an annotation allows, for people."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return [word for each in inner for word in _words(each)]
    if origin is Literal:
        return [repr(each) for each in inner]
    if origin is Sequence:
        each, *others = _words(inner[0])
        return [f"a list of {'such' if others else each}"]
    name = getattr(origin or kind, "__name__", str(kind))
    return [WORDS.get(name, f"a {name}")]


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
