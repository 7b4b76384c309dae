"""Named variants and ablations of a method, from the TOML files beside its module."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from retarget_bench.errors import FileError
from retarget_bench.files import read_toml

T = TypeVar("T")
LIKE = "like"


def beside(module: str, kind: type[T]) -> dict[str, T]:
    """The variants in ``variants.toml`` beside a module's file; see ``read``."""
    return read(Path(module).with_name("variants.toml"), kind)


def read(path: Path, kind: type[T]) -> dict[str, T]:
    """Name -> a dataclass from the table of this name, with those in it from tables below.

    What a table leaves out is as in the variant that its ``like`` names, else the field's default.
    Raises FileError where a table does not fit.
    """
    tables, adapter = read_toml(path), TypeAdapter(kind)
    if others := [name for name, table in tables.items() if not isinstance(table, dict)]:
        raise FileError(path, f"has {others[0]}, which is no table; every variant is one")
    variants: dict[str, T] = {}
    for name in tables:
        try:
            table = _complete(tables, name)
            variants[name] = adapter.validate_json(json.dumps(table, allow_nan=False), strict=True)
        except ValidationError as error:
            odd = error.errors()[0]
            place = ".".join(map(str, (name, *odd["loc"])))
            raise FileError(path, f"does not fit at {place}: {odd['msg']}") from None
        except (TypeError, ValueError) as error:
            raise FileError(path, f"does not fit at {name}: {error}") from None
        except KeyError as error:
            raise FileError(path, f"does not fit: {name} is like {error}, which is no other") from None
        if unknown := next(_unknown(table, asdict(variants[name])), ""):  # type: ignore[call-overload]
            raise FileError(path, f"has {name}.{unknown}, which is not known")
    return variants


def _complete(tables: Mapping[str, Mapping[str, Any]], name: str) -> Mapping[str, Any]:
    """A table with what it leaves out. Raises KeyError where it is like none, or in the end like itself."""
    table = dict(tables[name])
    base = table.pop(LIKE, None)
    if base is None:
        return table
    others = {other: each for other, each in tables.items() if other != name}
    return _joined(_complete(others, base), table)


def _joined(table: Mapping[str, Any], changes: Mapping[str, Any]) -> Mapping[str, Any]:
    tables = {
        name: _joined(table.get(name, {}), each) for name, each in changes.items() if isinstance(each, dict)
    }
    return {**table, **changes, **tables}


def _unknown(table: Mapping[str, Any], known: Mapping[str, Any]) -> Iterator[str]:
    """The dotted names in a table that are none of those that are known."""
    for name, value in table.items():
        if name not in known:
            yield name
        elif isinstance(value, dict) and isinstance(known[name], dict):
            yield from (f"{name}.{each}" for each in _unknown(value, known[name]))
