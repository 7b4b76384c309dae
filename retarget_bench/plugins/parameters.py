"""Fitting the parameters that a user wrote to those that a plug-in takes."""

import ast
import dataclasses
import difflib
import inspect
import itertools
import textwrap
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Scalar, Spec, write_value


@dataclass(frozen=True)
class Parameter:
    """One parameter of a plug-in.

    types:       the plain types it takes, out of bool, int, float, str; empty where it does not say.
    choices:     the only values it takes, or empty.
    default:     its default; ``inspect.Parameter.empty`` where it must be given.
    """

    name: str
    types: tuple[type, ...]
    choices: tuple[Scalar, ...]
    default: Any

    @property
    def required(self) -> bool:
        return self.default is inspect.Parameter.empty

    def __str__(self) -> str:
        """``root_rule=none|height (default none)``."""
        kind = "|".join(map(write_value, self.choices)) or "|".join(t.__name__ for t in self.types)
        shown = f"{self.name}={kind}" if kind else self.name
        if self.required:
            return f"{shown} (required)"
        if self.default is None:
            return shown
        plain = isinstance(self.default, str | int | float)
        return f"{shown} (default {write_value(self.default) if plain else str(self.default).lower()})"


def known(factory: Callable[..., Any]) -> tuple[list[Parameter], bool]:
    """The parameters of a plug-in, and whether it takes any others (``**parameters``).

    Those of a class with a dataclass ``Config`` are its fields.
    """
    config = getattr(factory, "Config", None)
    factory = config if isinstance(config, type) and dataclasses.is_dataclass(config) else factory
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):
        return [], True
    hints = _hints(factory)
    parameters, others = [], False
    for each in signature.parameters.values():
        if each.kind is each.VAR_KEYWORD:
            others = True
        elif each.kind in (each.KEYWORD_ONLY, each.POSITIONAL_OR_KEYWORD):
            accepted, choices = _accepted(hints.get(each.name), each.default)
            parameters.append(Parameter(each.name, accepted, choices, each.default))
    return parameters, others


def documented(config: type) -> dict[str, str]:
    """Field -> the docstring under it, in one line, of a dataclass and those that it derives from; none
    where there is no source, as of code that was typed in."""
    lines: dict[str, str] = {}
    for each in reversed(config.__mro__[:-1]):
        try:
            body = ast.parse(textwrap.dedent(inspect.getsource(each))).body[0]
        except (OSError, TypeError):
            continue
        assert isinstance(body, ast.ClassDef)
        for field, text in itertools.pairwise(body.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                lines[ast.unparse(field.target)] = " ".join(ast.literal_eval(text.value).split())
    return {each.name: lines[each.name] for each in dataclasses.fields(config) if each.name in lines}


def fit(spec: Spec, factory: Callable[..., Any]) -> Spec:
    """``spec`` with every value in the type its parameter takes, and those equal to a default left out.

    So ``m[scale=1]`` and ``m[scale=1.0]`` are one, and so are ``m`` and ``m[scale=1]`` if 1 is the default.
    Raises BenchError on an unknown, missing or ill-typed parameter, listing the known ones.
    """
    parameters, others = known(factory)
    by_name = {each.name: each for each in parameters}
    fitted: dict[str, Scalar] = {}
    for name, value in spec.parameters.items():
        if name in by_name:
            fitted[name] = _fit_value(spec, by_name[name], value)
        elif others:
            fitted[name] = value
        else:
            close = difflib.get_close_matches(name, by_name, 1)
            hint = f"; did you mean {close[0]}?" if close else "."
            raise BenchError(f"{spec.name} has no parameter {name!r}{hint}{_sentence(factory)}")
    if missing := [each.name for each in parameters if each.required and each.name not in fitted]:
        example = f"{spec.name}[{missing[0]}=...]"
        raise BenchError(f"{spec.name} needs {', '.join(missing)}: write {example}.{_sentence(factory)}")
    changed = {name: value for name, value in fitted.items() if not _is_default(by_name.get(name), value)}
    return Spec(spec.name, changed, spec.posts)


def class_card(factory: Callable[..., Any]) -> Any:
    """The card that a plug-in's class has; None where each object has its own, set by ``__init__`` or a
    property, as where ``needs`` depend on a parameter."""
    card = getattr(factory, "card", None)
    return None if hasattr(card, "__get__") else card


def describe(factory: Callable[..., Any]) -> list[str]:
    """A line per parameter, with what the plug-in's card says of it."""
    try:
        card = class_card(factory) or factory().card
        lines = {str(name): f": {line}" for name, line in card.parameters.items()}
    except Exception:  # the plug-in's own code; descriptions are a courtesy
        lines = {}
    return [f"{each}{lines.get(each.name, '')}" for each in known(factory)[0]]


def _sentence(factory: Callable[..., Any]) -> str:
    lines = describe(factory)
    return " Its parameters:" + "".join(f"\n  {line}" for line in lines) if lines else " It takes none."


def _fit_value(spec: Spec, parameter: Parameter, value: Scalar) -> Scalar:
    fitted = _cast(value, parameter.types)
    if fitted is None or (parameter.choices and fitted not in parameter.choices):
        close = difflib.get_close_matches(str(value), [str(each) for each in parameter.choices], 1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise BenchError(
            f"{spec.name} does not take {parameter.name}={write_value(value)}{hint}\n  {parameter}"
        )
    return fitted


def _cast(value: Scalar, accepted: tuple[type, ...]) -> Scalar | None:
    """``value`` as one of the accepted types without losing anything, or None."""
    if not accepted or type(value) in accepted:
        return value
    if float in accepted and type(value) is int:
        return float(value)
    if int in accepted and isinstance(value, float) and value.is_integer():
        return int(value)
    if str in accepted:
        return write_value(value)
    return None


def _accepted(hint: Any, default: Any) -> tuple[tuple[type, ...], tuple[Scalar, ...]]:
    """The plain types and the choices of a parameter, from its annotation, else from its default."""
    plain = (bool, int, float, str)
    if typing.get_origin(hint) is typing.Literal:
        choices = tuple(each for each in typing.get_args(hint) if isinstance(each, plain))
        return tuple({type(each): None for each in choices}), choices
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        parts = [_accepted(part, inspect.Parameter.empty) for part in typing.get_args(hint)]
        open_ended = any(plain_types and not choices for plain_types, choices in parts)
        choices = () if open_ended else tuple(each for _, some in parts for each in some)
        return tuple({t: None for plain_types, _ in parts for t in plain_types}), choices
    if hint in plain:
        return (hint,), ()
    if isinstance(hint, type) and issubclass(hint, Path):
        return (str,), ()
    if hint is None and type(default) in plain:
        return (type(default),), ()
    return (), ()


def _hints(factory: Callable[..., Any]) -> dict[str, Any]:
    """Annotations, resolved. A class may annotate with names that exist for a type checker only."""
    function = factory.__init__ if isinstance(factory, type) else factory  # type: ignore[misc]
    try:
        return typing.get_type_hints(function)
    except (NameError, TypeError, AttributeError):
        return {}


def _is_default(parameter: Parameter | None, value: Scalar) -> bool:
    if parameter is None or parameter.required:
        return False
    types = {type(parameter.default), type(value)}
    return (len(types) == 1 or types == {int, float}) and bool(parameter.default == value)
