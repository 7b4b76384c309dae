"""The content of a glTF or GLB file: its JSON, its buffers and the arrays in them.

After the specification of glTF 2.0 (Khronos Group, 2021): section 4 (GLB), 3.6 (buffers and accessors).
"""

from __future__ import annotations

import base64
import binascii
import json
import math
import struct
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from retarget_bench.errors import FileError, visible
from retarget_bench.files import LARGEST, check_ordinary, nesting
from retarget_bench.motion.file_kinds import check_kind

_LARGEST = 1e9
"""No place, turn or scale of a body is larger in any unit."""


class Values:
    """The JSON of a file, with the path for messages."""

    def __init__(self, path: Path, content: dict[str, Any]) -> None:
        self.path, self.content = path, content
        self._items: dict[str, list[dict[str, Any]]] = {}

    def fail(self, problem: str) -> FileError:
        """The error to raise: ``problem`` is the rest of a sentence about the file."""
        return FileError(self.path, problem)

    def items(self, key: str) -> list[dict[str, Any]]:
        """A list of objects at the top level, such as ``nodes``; [] where there is none."""
        if key not in self._items:
            entries = self.content.get(key, [])
            if not isinstance(entries, list) or not all(isinstance(each, dict) for each in entries):
                raise self.fail(f"its {key!r} is no list of objects: the file is damaged")
            self._items[key] = entries
        return self._items[key]

    def item(self, key: str, number: Any, by: str) -> dict[str, Any]:
        """One of these objects; ``by`` names what refers to it."""
        entries = self.items(key)
        if not _is_whole(number) or not 0 <= number < len(entries):
            raise self.fail(f"{by} refers to {key}[{_shown(number)}], and there are {len(entries)}")
        return entries[number]

    def inside(self, owner: dict[str, Any], key: str, by: str) -> dict[str, Any]:
        """An object in another; {} where there is none."""
        value = owner.get(key, {})
        if not isinstance(value, dict):
            raise self.fail(f"{by} has a {key!r} that is no object: the file is damaged")
        return value

    def listed(self, owner: dict[str, Any], key: str, by: str, kind: type = dict) -> list[Any]:
        """A list of objects (or of whole numbers, ``kind=int``) in another; [] where there is none."""
        entries = owner.get(key, [])
        if not isinstance(entries, list):
            raise self.fail(f"{by} has {key!r} that are no list: the file is damaged")
        if not all(_is_whole(each) if kind is int else isinstance(each, kind) for each in entries):
            raise self.fail(f"{by} has {key!r} of the wrong kind: the file is damaged")
        return entries

    def integer(self, owner: dict[str, Any], key: str, by: str, default: int | None = None) -> int:
        """A whole number of at least 0; raises FileError where it is missing and has no default."""
        value = owner.get(key, default)
        if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 53:
            return value
        raise self.fail(f"{by} has {key}={_shown(value)}, which is no count or offset")

    def text(self, owner: dict[str, Any], key: str) -> str:
        """A text; "" where there is none, or something else."""
        value = owner.get(key, "")
        return value if isinstance(value, str) else ""

    def numbers(self, owner: dict[str, Any], key: str, count: int, by: str) -> np.ndarray | None:
        """``(count,)`` finite numbers, None where there are none."""
        value = owner.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != count or not all(map(_is_finite, value)):
            raise self.fail(f"{by} has a {key!r} that is not {count} finite numbers")
        return np.array(value, dtype=np.float64)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_finite(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= _LARGEST and math.isfinite(value)


def _shown(value: Any) -> str:
    text = (
        "nothing" if value is None else repr(value) if isinstance(value, float | str) else str(value)[:20]
    )
    return text[:40]


MAGIC = b"glTF"
_JSON, _BINARY = 0x4E4F534A, 0x004E4942
COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
"""componentType -> type of number."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
"""Type of an accessor -> numbers in an element."""
_ZEROS, _SHARED = 1 << 24, 4
"""Numbers that a file may unpack to without data, and for each byte of data: accessors without data are
zeros, which cost the file nothing, and several may share theirs."""
_DEEPEST = 100
"""Levels of lists and objects of a file."""
_PACKED = ("EXT_meshopt_compression", "KHR_meshopt_compression")


class Document(Values):
    """A file's JSON (``content``), and its arrays. ``binary`` is the GLB's own buffer, b"" where none is.

    Raises FileError, with the path and what is wrong, for whatever the specification does not allow and
    a reader needs.
    """

    def __init__(self, path: Path, content: dict[str, Any], binary: bytes) -> None:
        super().__init__(path, content)
        self.binary = binary
        self._buffers: dict[int, bytes] = {}
        self._arrays: dict[int, np.ndarray] = {}
        self._counted: set[str] = set()
        self._loaded = self._unpacked = 0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the nodes; ``node_3`` for one without a name."""
        nodes = self.items("nodes")
        return tuple(self.name(node).strip() or f"node_{n}" for n, node in enumerate(nodes))

    def name(self, item: dict[str, Any]) -> str:
        """The name of a node or animation as it can be shown, "" for one without."""
        return visible(self.text(item, "name"), lines=False)

    # --------------------------------------------------------------------------------------- buffers
    def buffer(self, number: int) -> bytes:
        """The bytes of a buffer: the GLB's own, of a ``data:`` URI, or of a file beside this one."""
        if number not in self._buffers:
            item = self.item("buffers", number, "a buffer view")
            size = self.integer(item, "byteLength", f"buffers[{number}]")
            uri = item.get("uri")
            if uri is None:
                if number or not self.binary:
                    raise self.fail(f"buffers[{number}] has no data: the file is incomplete")
                data = self.binary
            else:
                data = self.linked(uri, f"buffers[{number}]")
            if len(data) < size:
                raise self.fail(f"buffers[{number}] has {len(data)} bytes of {size}: it is cut off")
            self._loaded += size
            if self._loaded > LARGEST:
                raise self.fail(f"has buffers of {self._loaded:,} bytes; up to {LARGEST:,} are read")
            self._buffers[number] = data[:size]
        return self._buffers[number]

    def linked(self, uri: Any, by: str) -> bytes:
        """The bytes that a URI names. Only ``data:`` and files in the file's own folder or below it are
        read."""
        if not isinstance(uri, str):
            raise self.fail(f"{by} has a URI that is no text")
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            try:
                encoded = head.endswith(";base64")
                return base64.b64decode(body, validate=True) if encoded else unquote(body).encode("latin-1")
            except (binascii.Error, ValueError) as error:
                raise self.fail(f"{by} has a data: URI that cannot be decoded") from error
        name = unquote(uri)
        folder = self.path.parent
        outside = Path(name).is_absolute() or ".." in Path(name).parts or ":" in name or "\0" in name
        if outside or not name:
            raise self.fail(f"{by} refers to {name[:80]!r}, which is no file in the same folder")
        try:
            if not (folder / name).is_file():
                raise self.fail(f"{by} is the file {name[:80]!r}, which is not beside it: copy it there")
            check_ordinary(folder / name, LARGEST)
            return (folder / name).read_bytes()
        except OSError as error:
            raise FileError(folder / name, f"cannot be read ({error.strerror or error})") from error

    def view(self, number: Any, by: str) -> tuple[memoryview, int]:
        """The bytes of a buffer view, and its stride (0: packed)."""
        item = self.item("bufferViews", number, by)
        name = f"bufferViews[{number}]"
        if any(each in self.inside(item, "extensions", name) for each in _PACKED):
            raise self.fail("is compressed by meshopt, which is not read: export it without compression")
        buffer = self.buffer(self.integer(item, "buffer", name))
        start, size = self.integer(item, "byteOffset", name, 0), self.integer(item, "byteLength", name)
        if start + size > len(buffer):
            raise self.fail(f"{name} ends at byte {start + size} of a buffer of {len(buffer)}: cut off")
        return memoryview(buffer)[start : start + size], self.integer(item, "byteStride", name, 0)

    # ------------------------------------------------------------------------------------- accessors
    def array(self, number: Any, kinds: tuple[str, ...], by: str) -> np.ndarray:
        """``(count, width)`` of an accessor of one of these types: float64 where its numbers are real or
        normalised, else whole numbers. Read-only. Raises FileError for NaN and infinity."""
        item = self.item("accessors", number, by)
        name = f"accessors[{number}]"
        if item.get("type") not in kinds:
            raise self.fail(f"{by} needs {' or '.join(kinds)}; {name} is {str(item.get('type'))[:20]!r}")
        if number in self._arrays:
            return self._arrays[number]
        values = self._read(item, name)
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            raise self.fail(f"{name} holds NaN or infinity")
        values.setflags(write=False)
        if item["type"] == "SCALAR":  # times, which many tracks share
            self._arrays[number] = values
        return values

    def _count(self, numbers: int, name: str) -> None:
        """Raise FileError where an accessor of so many numbers, with those before, is too much."""
        self._unpacked += numbers * (name not in self._counted)
        self._counted.add(name)
        if self._unpacked > _ZEROS + _SHARED * self._loaded:
            raise self.fail(
                f"unpacks to {self._unpacked:,} numbers up to {name}, from {self._loaded:,} bytes of data: "
                "it is damaged"
            )

    def _read(self, item: dict[str, Any], name: str) -> np.ndarray:
        kind = self._component(item, name)
        count, width = self.integer(item, "count", name), WIDTHS[item["type"]]
        if item.get("bufferView") is None:
            self._count(count * width, name)
            values = np.zeros((count, width), kind)
        else:
            start = self.integer(item, "byteOffset", name, 0)
            values = self._elements(item["bufferView"], start, count, width, kind, name)
            self._count(count * width, name)
        if sparse := self.inside(item, "sparse", name):
            values = self._replaced(values, sparse, name)
        if kind.kind == "f":
            with np.errstate(invalid="ignore"):  # signalling NaN, which is found out later
                return values.astype(np.float64)
        if item.get("normalized") is True:
            most = np.iinfo(kind).max
            return np.maximum(values.astype(np.float64) / most, -1.0)
        return values.astype(np.int64)

    def _component(self, item: dict[str, Any], name: str) -> np.dtype[Any]:
        kind = item.get("componentType")
        if not isinstance(kind, int) or kind not in COMPONENTS:
            raise self.fail(f"{name} has an unknown componentType {str(kind)[:20]}")
        return COMPONENTS[kind]

    def _elements(
        self, view: Any, start: int, count: int, width: int, kind: np.dtype, name: str
    ) -> np.ndarray:
        """``(count, width)`` numbers of a buffer view, from a byte on."""
        data, stride = self.view(view, name)
        size = width * kind.itemsize
        step = stride or size
        if step < size:
            raise self.fail(f"{name} has elements of {size} bytes that lie {step} bytes apart")
        if count and start + step * (count - 1) + size > len(data):
            raise self.fail(
                f"{name} has {count} elements, which do not fit in its {len(data)} bytes: it is cut off"
            )
        if not count:
            return np.zeros((0, width), kind)
        return np.ndarray((count, width), kind, data, start, (step, kind.itemsize))

    def _replaced(self, elements: np.ndarray, sparse: dict[str, Any], name: str) -> np.ndarray:
        """A copy of the elements with those replaced that a sparse accessor lists."""
        count = self.integer(sparse, "count", f"{name}.sparse")
        places, values = (self.inside(sparse, key, f"{name}.sparse") for key in ("indices", "values"))
        kind = self._component(places, f"{name}.sparse.indices")
        start = self.integer(places, "byteOffset", f"{name}.sparse.indices", 0)
        rows = self._elements(places.get("bufferView"), start, count, 1, kind, f"{name}.sparse.indices")
        if kind.kind != "u" or (rows >= len(elements)).any():
            raise self.fail(f"{name}.sparse replaces elements that there are not")
        start = self.integer(values, "byteOffset", f"{name}.sparse.values", 0)
        by = self._elements(
            values.get("bufferView"),
            start,
            count,
            elements.shape[1],
            elements.dtype,
            f"{name}.sparse.values",
        )
        changed = np.array(elements)
        changed[rows[:, 0]] = by
        return changed


def open_document(path: Path) -> Document:
    """The content of a file. Raises FileError where it is no glTF 2.0."""
    check_kind(path, "glTF")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    text, binary = _chunks(path, data) if data[:4] == MAGIC else (data, b"")
    try:
        content = json.loads(text.decode("utf-8-sig"), parse_constant=_refused)
        if nesting(content) > _DEEPEST:
            raise RecursionError("it is nested too deeply")
    except (ValueError, RecursionError) as error:
        raise FileError(path, f"holds no readable JSON ({str(error)[:100]})") from error
    if not isinstance(content, dict) or not isinstance(content.get("asset"), dict):
        raise FileError(path, "is no glTF file: it has no 'asset'")
    version = str(content["asset"].get("version", "?"))[:10]
    if not version.startswith("2."):
        raise FileError(path, f"is glTF {version}; glTF 2.0 is read: export it again, as glTF 2.0")
    return Document(path, content, binary)


def _refused(word: str) -> float:
    raise ValueError(f"{word} is no number of JSON")


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a GLB."""
    if len(data) < 20:
        raise FileError(path, f"is cut off after {len(data)} bytes")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise FileError(path, f"is GLB version {version}; version 2 is read: export it again, as glTF 2.0")
    if length > len(data):
        raise FileError(path, f"is cut off: it has {len(data)} bytes, and {length} are declared")
    chunks: dict[int, bytes] = {}
    start = 12
    while start + 8 <= length:
        size, kind = struct.unpack_from("<II", data, start)
        if start + 8 + size > length:
            raise FileError(path, f"is cut off: its chunk at byte {start} has {size} bytes")
        chunks.setdefault(kind, data[start + 8 : start + 8 + size])
        start += 8 + size
    if _JSON not in chunks:
        raise FileError(path, "has no JSON chunk: it is damaged")
    return chunks[_JSON], chunks.get(_BINARY, b"")
