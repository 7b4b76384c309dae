"""Options declared once: a field with its help is an option of a command, an argument in Python and an
entry of a suite file.

A class of options is an ``OptionSet`` whose fields are made by ``option``. ``commands/options.py`` makes
the command's options from it, ``python/arguments.py`` the arguments of a function, and
``commands/suite.py`` reads files of them, and makes their JSON schema. All build the same object, which
checks itself.
"""

from __future__ import annotations

import numbers
import operator
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from functools import cache
from types import UnionType
from typing import (
    Any,
    ClassVar,
    Literal,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from retarget_bench import defaults
from retarget_bench.errors import BenchError

Names = str | Sequence[str]
"""One name, or several."""
Kind = Literal["methods", "metrics", "datasets", "posts"]
"""Of plug-ins."""
Bodies = Literal["", "people", "four-legged", "mixed", "all"]
"""Groups of cases by their source and target: on two legs, on four, one of each, or all; "": people, where
there are any."""
_COMMA = re.compile(r",(?![^\[\]]*\])")
_NUMBERS: dict[Any, type] = {int: numbers.Integral, float: numbers.Real}


@dataclass(frozen=True)
class Option:
    """A field of a class of options.

    help:    a sentence. shown: its default in words, where that is not the value itself.
    letter:  its short form in commands. metavar: what stands for its value there.
    at_least, above, below: limits of a number.
    names:   kinds of plug-ins that shells complete it by.
    python:  an option of Python alone.
    name, kind, default, required: of the field, as Python has them: its annotated type, its default (None
             where it has none), and whether it must be given.
    """

    help: str
    shown: str = ""
    letter: str = ""
    metavar: str = ""
    at_least: float | None = None
    above: float | None = None
    below: float | None = None
    names: tuple[Kind, ...] = ()
    python: bool = False
    name: str = ""
    kind: Any = None
    default: Any = None
    required: bool = False

    @property
    def several(self) -> bool:
        """True where it takes several values."""
        return any(get_origin(each) in (Sequence, tuple) for each in _parts(self.kind))

    @property
    def choices(self) -> tuple[str, ...]:
        """The values that it can have, where these are listed; () elsewhere."""
        return tuple(
            each for part in _parts(self.kind) if get_origin(part) is Literal for each in get_args(part)
        )

    def is_a(self, kind: type) -> bool:
        """True where a value, or each of several, is of this type."""
        parts = _parts(self.kind)
        items = [each for part in parts for each in get_args(part) if get_origin(part) in (Sequence, tuple)]
        return kind in (*parts, *items)

    def check(self, value: Any) -> None:
        """Raises BenchError for a value that the field cannot have."""
        if self.choices and isinstance(value, str) and value not in self.choices:
            choices = ", ".join(filter(None, self.choices))
            raise BenchError(f"{self.name}: {value!r} is not known; it is one of {choices}")
        if problem := misfit(self.name, value, self.kind):
            raise BenchError(problem)
        if self.several and _is_empty(value):
            text = value if isinstance(value, str) else " ".join(value)
            raise BenchError(f"{self.name}: {text!r} names nothing; leave it out for all, or name some")
        bounds = (
            ("at least", self.at_least, operator.ge),
            ("above", self.above, operator.gt),
            ("below", self.below, operator.lt),
        )
        limits = [(words, limit, within) for words, limit, within in bounds if limit is not None]
        if value is not None and not all(within(value, limit) for _, limit, within in limits):
            number = value if isinstance(value, int) else f"{value:g}"
            raise BenchError(
                f"{self.name} is {number}; it must be "
                + " and ".join(f"{words} {limit:g}" for words, limit, _ in limits)
            )


def _is_empty(names: Any) -> bool:
    """True for texts that hold nothing but commas and blanks."""
    texts = [names] if isinstance(names, str) else names or ()
    return any(texts) and all(isinstance(each, str) for each in texts) and not listed(texts)


def option(
    help: str,
    *,
    default: Any = MISSING,
    default_factory: Any = MISSING,
    kw_only: bool = True,
    **others: Any,
) -> Any:
    """A field of a class of options, to be given where it has no default. others: see ``Option``."""
    metadata = {"option": Option(help, **others)}
    return field(default=default, default_factory=default_factory, kw_only=kw_only, metadata=metadata)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(option, field))
class OptionSet:
    """Base of classes of options: a subclass is a frozen dataclass of keywords, and checks its values.

    Raises BenchError that names the field whose value is of another type, not among its choices, or beyond
    its limits.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for each in declared(kind).values():
            each.check(getattr(self, each.name))


@cache
def declared(options: Any) -> dict[str, Option]:
    """The options of a class by name, in their order, those of bases first."""
    kinds = get_type_hints(options)
    return {
        each.name: replace(
            each.metadata["option"],
            name=each.name,
            kind=kinds[each.name],
            default=each.default if each.default_factory is MISSING else each.default_factory(),
            required=each.default is each.default_factory is MISSING,
        )
        for each in fields(options)
        if "option" in each.metadata
    }


# ------------------------------------------------------------------------ options of several classes
class Parallel(OptionSet):
    """What works in several processes."""

    jobs: int = option(
        "Number of processes.",
        default_factory=defaults.jobs,
        shown=f"one per core, at most {defaults.MOST_JOBS}",
        letter="j",
        at_least=1,
        metavar="N",
    )


class OfMethods(OptionSet):
    """What shows some methods of results."""

    methods: Names = option(
        "Only these methods; pictures have them in this order.",
        default=(),
        shown="all that there are",
        letter="m",
        metavar="METHOD",
        names=("methods",),
    )


class OfSplits(OptionSet):
    """What is about some splits."""

    splits: Names = option(
        "Splits, such as cross (bench info DATASET lists them).",
        default=(),
        shown="all",
        letter="s",
        metavar="SPLIT",
    )


class OfBodies(OptionSet):
    """What is about a group of bodies."""

    bodies: Bodies = option(
        "Bodies on two legs, on four, or one of each.", default="", shown="people, where there are any"
    )


class WithData(OptionSet):
    """What shows motion of the data that results are of."""

    root: str | None = option("Where the data lie, if not as usual.", default=None, metavar="DIR")


def listed(names: Names) -> tuple[str, ...]:
    """Names as a tuple, each once. A text may hold several with commas between them; those in brackets
    separate parameters."""
    several = [names] if isinstance(names, str) else names
    parts = [part.strip() for text in several for part in _COMMA.split(text)]
    return tuple(dict.fromkeys(filter(None, parts)))


# ------------------------------------------------------------------------------------ annotated types
def _parts(kind: Any) -> tuple[Any, ...]:
    """The members of a union; the type itself elsewhere."""
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def misfit(name: str, value: object, kind: Any) -> str:
    """A sentence on a value that is not of an annotated type; "" for one that is."""
    if _fits(value, kind):
        return ""
    text = repr(value)
    text = text if len(text) <= 40 else f"{text[:37]}..."
    types = " or ".join(dict.fromkeys(_words(kind)))
    return f"{name} is {text}, of type {type(value).__name__}; it takes {types}"


def _fits(value: object, kind: Any) -> bool:
    """True if a value is of an annotated type, sequences item by item. Truth values are no numbers, and
    nothing else is a truth value: any text is true to Python."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in inner)
    if origin in (Sequence, tuple):
        if not isinstance(value, Collection) or isinstance(value, str | bytes | Mapping):
            return False
        return all(_fits(each, inner[0]) for each in value)
    if origin is Callable:
        return callable(value)
    if origin is Literal:
        return value in inner
    if kind in _NUMBERS:
        return isinstance(value, _NUMBERS[kind]) and not isinstance(value, bool)
    kind = origin or kind
    return kind is Any or isinstance(value, kind)


_TYPES = {
    "str": "text",
    "PathLike": "a path",
    "Path": "a path",
    "bool": "True or False",
    "int": "a whole number",
    "float": "a number",
    "NoneType": "None",
    "ModuleType": "a module",
    "Callable": "a class or function",
    "Mapping": "a dictionary",
    "ndarray": "an array",
}


def _words(kind: Any) -> list[str]:
    """The types that an annotation allows, for people."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return [word for each in inner for word in _words(each)]
    if origin is Literal:
        return [repr(each) for each in inner]
    if origin in (Sequence, tuple):
        each, *others = _words(inner[0])
        return [f"a list of {'such' if others else each}"]
    name = getattr(origin or kind, "__name__", str(kind))
    return [_TYPES.get(name, f"a {name}")]
