"""A record as JSON and a file of named arrays whose hash it holds: safetensors, never pickle.

So arrays that were damaged or exchanged are noticed, and a record alone says what its arrays are, without
their being read.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, read_json, write_text
from retarget_bench.training import released

Arrays = Mapping[str, np.ndarray]
SCHEMA = 1
LARGEST_RECORD = 20_000_000
"""Bytes of one."""


@dataclass(frozen=True, kw_only=True)
class Hashed:
    """A record of plain data. hash: of the arrays that it is of."""

    hash: str = ""


R = TypeVar("R", bound=Hashed)


def arrays_hash(arrays: Arrays) -> str:
    """Sixteen hex digits of names, types and numbers."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name], order="C")
        total.update(f"{name} {array.dtype.str} {array.shape}\n".encode() + array.tobytes())
    return total.hexdigest()[:16]


def arrays_of(record: Path) -> Path:
    """The file of arrays beside ``NAME.json``."""
    return record.with_suffix(".safetensors")


def write(path: Path, record: R, arrays: Arrays, file: Path | None = None) -> R:
    """Record and arrays, each atomically, the record last; the record with their hash.

    file: of the arrays, if not the one beside the record. Raises FileError where they cannot be written:
    what was there before is then intact.
    """
    from safetensors.numpy import save

    full = replace(record, hash=arrays_hash(arrays))
    # both are complete before either is renamed; the inner one, the arrays, is renamed first
    with atomic(path) as new_record, atomic(file or arrays_of(path)) as new_file:
        # not save_file, which makes files that nobody else may read
        new_file.write_bytes(save({name: np.asarray(each, order="C") for name, each in arrays.items()}))
        new_record.write_text(_text(full), encoding="utf-8", newline="\n")
    return full


def write_record(path: Path, record: Hashed) -> None:
    """The record alone, whose arrays are as they were. Raises FileError."""
    write_text(path, _text(record))


def _text(record: Hashed) -> str:
    return json.dumps({"schema": SCHEMA, **asdict(record)}, indent=1, ensure_ascii=False) + "\n"


def read_record(path: Path, kind: type[R], what: str) -> R:
    """A record of this kind; ``what`` it should be, for messages (``the card of weights``).

    Raises FileError where it is none, or from a newer version.
    """
    from pydantic import ValidationError

    try:
        facts = read_json(path, LARGEST_RECORD)
    except FileError as error:
        raise FileError(path, f"is not {what}: it {error.problem}") from error
    if not isinstance(facts, dict) or "schema" not in facts:
        raise FileError(path, f"is not {what} (it has no schema)")
    if facts["schema"] != SCHEMA:
        raise FileError(path, f"has schema {facts['schema']}; this version reads {SCHEMA}")
    try:
        record: R = _type(kind).validate_json(json.dumps(facts), strict=True)  # type: ignore[arg-type]
    except ValidationError as error:
        odd = error.errors()[0]
        where = ".".join(map(str, odd["loc"]))
        raise FileError(path, f"is not {what} ({where}: {odd['msg']})") from error
    return record


@lru_cache
def _type(kind: Any) -> Any:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


def read_arrays(file: Path, record: Path, written: str) -> dict[str, np.ndarray]:
    """The arrays whose hash a record holds. Raises FileError where they are damaged or others."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    try:
        if not file.is_file():
            raise OSError("it is no file")
        arrays: dict[str, np.ndarray] = load_file(file)
    except (OSError, SafetensorError) as error:
        raise FileError(file, f"cannot be read ({error}); train it anew") from error
    except (KeyError, TypeError, AttributeError, ValueError) as error:  # of types that numpy lacks
        raise FileError(file, f"holds numbers of a type that cannot be read ({error})") from error
    if arrays_hash(arrays) != written:
        raise FileError(file, f"is not what {record.name} describes; train it anew")
    return arrays


def read_weights(record: Path, written: str) -> dict[str, np.ndarray]:
    """The same of arrays beside their record, each of real, finite numbers. Raises FileError."""
    file = released.at_hand(arrays_of(record))
    arrays = read_arrays(file, record, written)
    for name, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise FileError(file, f"{name} is of type {array.dtype}; weights are real numbers")
        with np.errstate(over="ignore"):  # single precision is what they are used in
            finite = np.isfinite(array.astype(np.float32)).all()
        if not finite:
            raise FileError(file, f"{name} has numbers that are not finite; train it anew")
    return arrays


def verify(record: Path, written: str) -> None:
    """Compare weights with what their record says, once for each state of their file. Raises FileError."""
    file = released.at_hand(arrays_of(record))
    state = file.stat() if file.exists() else None
    _verified(record, written, state and (state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=128)
def _verified(record: Path, written: str, _state: tuple[int, int] | None) -> None:
    read_weights(record, written)
