"""Suites: runs written down as TOML files with the options of ``bench run`` in the same words::

    methods = ["copy_rotations[root_rule=height]", "ik"]
    dataset = "mixamo"
    root = "PATH/TO/mixamo"
    splits = ["cross"]

``bench info suite`` prints the JSON schema of these files, by which editors complete and check them.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from retarget_bench import files
from retarget_bench.errors import BenchError, FileError
from retarget_bench.options import Option, declared
from retarget_bench.python.run_options import RunOptions

_TYPES = {str: "string", bool: "boolean", int: "integer", float: "number"}


def _fields() -> dict[str, Option]:
    return {name: each for name, each in declared(RunOptions).items() if not each.python}


def read_suite(path: Path) -> dict[str, Any]:
    """The options that a suite file sets. Raises FileError that lists every mistake with its place."""
    fields = _fields()
    entries, mistakes = files.read_toml(path), []
    for name, value in entries.items():
        try:
            if name not in fields:
                raise BenchError(f"{name}: there is no such option")
            fields[name].check(value)
        except BenchError as error:
            mistakes.append(f"\n  {error}")
    if mistakes:
        raise FileError(path, f"is not a suite file (it may set {', '.join(fields)}):{''.join(mistakes)}")
    return {
        name: [value] if fields[name].several and isinstance(value, str) else value
        for name, value in entries.items()
    }


def schema() -> str:
    """The JSON schema (2020-12) of what ``read_suite`` takes, made from the same options.

    It takes a little more: texts of commas alone, and whole numbers that are written with a point.
    """
    content = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A suite: options of bench run --suite",
        "type": "object",
        "properties": {name: _property(each) for name, each in _fields().items()},
        "additionalProperties": False,
    }
    return json.dumps(content, indent=2, ensure_ascii=False) + "\n"


def _property(each: Option) -> dict[str, Any]:
    """An option as a property. A default that is no constant, or means another value, is told in words."""
    allowed = _allowed(each.kind)
    limits = {"minimum": each.at_least, "exclusiveMinimum": each.above, "exclusiveMaximum": each.below}
    content = {
        "description": f"{each.help} [default: {each.shown}]" if each.shown else each.help,
        **(allowed[0] if len(allowed) == 1 else {"anyOf": allowed}),
        **{keyword: limit for keyword, limit in limits.items() if limit is not None},
    }
    if each.default is not None and not each.shown:
        content["default"] = each.default
    return content


def _allowed(kind: Any) -> list[dict[str, Any]]:
    """The schemas of an annotated type's members, but for those that no TOML file can hold."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return [schema for each in inner for schema in _allowed(each)]
    if origin in (Sequence, tuple):
        (items,) = _allowed(inner[0])
        return [{"type": "array", "items": items}]
    if origin is Literal:
        return [{"enum": list(inner)}]
    return [{"type": _TYPES[kind]}] if kind in _TYPES else []
