"""Arguments of the Python interface: those that are declared as options, and checks against annotations."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache, wraps
from types import SimpleNamespace
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, cast, get_type_hints, overload

from retarget_bench.errors import BenchError
from retarget_bench.options import declared, misfit

P = ParamSpec("P")
O = TypeVar("O")  # noqa: E741
O_co = TypeVar("O_co", covariant=True)
S = TypeVar("S")
T = TypeVar("T")
U = TypeVar("U")


class _Taking(Protocol[P, O_co]):
    """Makes a function of ``options``, behind up to two other arguments, one of these options by name."""

    @overload
    def __call__(self, function: Callable[[O_co], T], /) -> Callable[P, T]: ...
    @overload
    def __call__(self, function: Callable[[S, O_co], T], /) -> Callable[Concatenate[S, P], T]: ...
    @overload
    def __call__(self, function: Callable[[S, U, O_co], T], /) -> Callable[Concatenate[S, U, P], T]: ...


def takes(options: Callable[P, O]) -> _Taking[P, O]:
    """Make a function of an object of options one of these options, by their names and with their help."""

    def with_arguments(function: Callable[..., Any]) -> Callable[..., Any]:
        before = len(inspect.signature(function).parameters) - 1

        @wraps(function)
        def call(*values: Any, **named: Any) -> Any:
            return function(*values[:before], options=options(*values[before:], **named))

        return _documented(call, options, before)

    return cast(_Taking[P, O], with_arguments)


def _documented(call: Any, options: Any, before: int) -> Any:
    """The function with the options' signature, and their help below its own text."""
    own = inspect.signature(inspect.unwrap(call)).parameters.values()
    first = [each.replace(kind=each.POSITIONAL_ONLY) for each in own][:before]
    fields = declared(options)
    others = [
        each.replace(annotation=fields[each.name].kind)
        for each in inspect.signature(options).parameters.values()
    ]
    call.__signature__ = inspect.Signature([*first, *others])
    lines = [f"{name}: {each.help}" for name, each in fields.items()]
    call.__doc__ = "\n\n".join([inspect.cleandoc(call.__doc__ or ""), "Options\n-------", *lines])
    return call


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Make a function raise BenchError for an argument that does not fit its annotation.

    Arguments that are missing or have unknown names are TypeErrors, as everywhere in Python. Truth values
    are not looked at.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*values: P.args, **named: P.kwargs) -> T:
        try:
            bound = signature.bind(*values, **named)
        except TypeError:
            return function(*values, **named)  # which says it in Python's words
        kinds = _kinds(function)
        for name, value in bound.arguments.items():
            several = signature.parameters[name].kind is inspect.Parameter.VAR_POSITIONAL
            for each in value if several else (value,):
                if problem := misfit(name, each, kinds.get(name, Any)):
                    raise BenchError(f"{function.__name__}: {problem}")
        return function(*values, **named)

    return call


@cache
def _kinds(function: Callable[..., Any]) -> dict[str, Any]:
    """Parameter -> its resolved annotation. That of the return value may name what is not imported."""
    named = {name: kind for name, kind in function.__annotations__.items() if name != "return"}
    return get_type_hints(SimpleNamespace(__annotations__=named), function.__globals__)
