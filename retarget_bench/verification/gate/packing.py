"""Whole cases as one ``.npz`` file: any of the engine's frozen dataclasses, arrays apart, rest as JSON.

A character's measures are not stored but found again when the file is read, so that a change of how bodies
are measured is seen. Skins are left out. Rotations are stored in single precision, and are unit again when
they are read.
"""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from retarget_bench import api
from retarget_bench.errors import BenchError, FileError
from retarget_bench.files import atomic
from retarget_bench.motion import character, measures, motion, rotation, skeleton

SCHEMA = 1
_TREE = "tree"
_FOUND_AGAIN = ("measures", "skin")
KNOWN = {
    name: made
    for module in (api, character, motion, skeleton)
    for name, made in vars(module).items()
    if isinstance(made, type) and is_dataclass(made)
}
"""Name -> dataclass that a file may hold."""


def write(path: Path, thing: Any) -> None:
    """Dataclasses, mappings, tuples, arrays and plain values, as one file. Raises FileError."""
    packer = _Packer()
    tree = {"schema": SCHEMA, "thing": packer.pack(thing)}
    packer.arrays[_TREE] = np.array(json.dumps(tree, allow_nan=False))
    with atomic(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **packer.arrays)  # type: ignore[arg-type]


def read(path: Path) -> Any:
    """The object given to ``write``. Raises FileError that names the file and what is wrong with it."""
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        tree = json.loads(str(arrays.pop(_TREE)))
        schema = tree["schema"]
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile) as error:
        raise FileError(path, f"is not a file of frozen motions, or is damaged ({error})") from error
    if not isinstance(schema, int) or schema > SCHEMA:
        raise FileError(
            path, f"has schema {schema} of frozen motions; this version reads up to {SCHEMA}. Upgrade"
        )
    try:
        return _Unpacker(arrays).unpack(tree["thing"])
    except (KeyError, IndexError, TypeError, ValueError, BenchError) as error:
        raise FileError(path, f"holds something that this version cannot build: {error}") from error


class _Packer:
    """Objects that occur more than once, such as bodies, are written once."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray] = {}
        self._seen: dict[int, int] = {}
        self._kept: list[Any] = []

    def pack(self, thing: Any) -> Any:
        if thing is None or isinstance(thing, bool | int | float | str):
            return thing
        if isinstance(thing, np.generic):
            return thing.item()
        if id(thing) in self._seen:
            return {"same": self._seen[id(thing)]}
        if isinstance(thing, np.ndarray):
            packed = {"array": f"array_{len(self.arrays)}"}
            self.arrays[packed["array"]] = _small(thing)
            return packed
        if isinstance(thing, Mapping):
            return {"mapping": {str(key): self.pack(value) for key, value in thing.items()}}
        if isinstance(thing, tuple | list):
            return {"tuple": [self.pack(each) for each in thing]}
        return self._dataclass(thing)

    def _dataclass(self, thing: Any) -> dict[str, Any]:
        name = type(thing).__name__
        if KNOWN.get(name) is not type(thing):
            raise BenchError(f"a {name} cannot be stored among frozen motions")
        stored = thing
        if isinstance(thing, motion.Motion):
            stored = replace(thing, rotations=thing.rotations.astype(np.float32))
        inside = {
            each.name: self.pack(getattr(stored, each.name))
            for each in fields(stored)
            if each.name not in _FOUND_AGAIN
        }
        self._seen[id(thing)] = len(self._kept)
        self._kept.append(thing)
        return {"is": name, "fields": inside}


class _Unpacker:
    def __init__(self, arrays: Mapping[str, np.ndarray]) -> None:
        self._arrays = arrays
        self._made: list[Any] = []

    def unpack(self, packed: Any) -> Any:
        if not isinstance(packed, dict):
            return packed
        if "same" in packed:
            return self._made[packed["same"]]
        if "array" in packed:
            array = self._arrays[packed["array"]]
            return array.astype(np.float64) if array.dtype == np.float32 else array
        if "mapping" in packed:
            return {key: self.unpack(value) for key, value in packed["mapping"].items()}
        if "tuple" in packed:
            return tuple(self.unpack(each) for each in packed["tuple"])
        inside = {name: self.unpack(value) for name, value in packed["fields"].items()}
        if packed["is"] == "Character":
            inside["measures"] = measures.measure(
                inside["skeleton"], inside["roles"], inside["reference_pose"]
            )
        if packed["is"] == "Motion":
            inside["rotations"] = rotation.normalise(inside["rotations"])
        self._made.append(KNOWN[packed["is"]](**inside))
        return self._made[-1]


def _small(array: np.ndarray) -> np.ndarray:
    """Single precision where nothing is lost by it."""
    if array.dtype != np.float64:
        return array
    single = array.astype(np.float32)
    return single if np.array_equal(single.astype(np.float64), array) else array
