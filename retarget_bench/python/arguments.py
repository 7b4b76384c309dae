"""Arguments of the Python interface: those that are declared as options, and checks against annotations."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import cache, wraps
from types import SimpleNamespace
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, cast, get_type_hints, overload

from retarget_bench.errors import BenchError
from retarget_bench.options import declared, fits, shown, words

P = ParamSpec("P")
O = TypeVar("O")  # noqa: E741
O_co = TypeVar("O_co", covariant=True)
S = TypeVar("S")
T = TypeVar("T")
U = TypeVar("U")


def takes(options: Callable[P, O]) -> Callable[[Callable[[O], T]], Callable[P, T]]:
    """Make a function of an object of options one of these options, by their names and with their help."""

    def with_arguments(function: Callable[[O], T]) -> Callable[P, T]:
        @wraps(function)
        def call(*given: P.args, **named: P.kwargs) -> T:
            return function(options(*given, **named))

        return _documented(call, options, 0)

    return with_arguments


class _After(Protocol[P, O_co]):
    """Makes a function of one argument or two, and of ``options``, one of these options by their names."""

    @overload
    def __call__(self, function: Callable[[S, O_co], T], /) -> Callable[Concatenate[S, P], T]: ...
    @overload
    def __call__(self, function: Callable[[S, U, O_co], T], /) -> Callable[Concatenate[S, U, P], T]: ...


def takes_after(options: Callable[P, O]) -> _After[P, O]:
    """``takes`` for a method, or a function whose first arguments are none of the options."""

    def with_arguments(function: Callable[..., Any]) -> Callable[..., Any]:
        before = len(inspect.signature(function).parameters) - 1

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            return function(*given[:before], options=options(*given[before:], **named))

        return _documented(call, options, before)

    return cast(_After[P, O], with_arguments)


def _documented(call: Any, options: Any, before: int) -> Any:
    """The function with the options' signature, and their help below its own text."""
    own = inspect.signature(inspect.unwrap(call)).parameters.values()
    mine = [each.replace(kind=each.POSITIONAL_ONLY) for each in own][:before]
    kinds = {name: each.kind for name, each in declared(options).items()}
    theirs = [
        each.replace(annotation=kinds[name]) for name, each in inspect.signature(options).parameters.items()
    ]
    call.__signature__ = inspect.Signature([*mine, *theirs])
    lines = [f"{name}: {each.option.help}" for name, each in declared(options).items()]
    call.__doc__ = "\n\n".join([inspect.cleandoc(call.__doc__ or ""), "Options\n-------", *lines])
    return call


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
                        f"{function.__name__}: {name} is {shown(each)}; "
                        f"it takes {' or '.join(dict.fromkeys(words(known[name])))}"
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
