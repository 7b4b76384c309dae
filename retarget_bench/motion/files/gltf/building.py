"""Binary glTF files being put together: arrays, accessors, and the bytes of the whole."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic
from retarget_bench.motion.files.gltf.document import COMPONENTS, MAGIC

_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_CODES = {kind: code for code, kind in COMPONENTS.items()}
VERTICES, INDICES = 34962, 34963
"""Targets of buffer views."""
_LARGEST = (1 << 32) - 1


class Builder:
    """The JSON of a file, and the bytes of its only buffer, both of which grow.

    content: the JSON, which is changed in place. binary: bytes that stay as they are, before all others.
    """

    def __init__(self, content: dict[str, Any], binary: bytes = b"") -> None:
        self.content, self._data = content, bytearray(binary)

    def bytes_view(self, data: bytes, target: int | None = None) -> int:
        """The number of a new buffer view with these bytes."""
        self._data += b"\0" * (-len(self._data) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self._data += data
        return self.add("bufferViews", view)

    def array(
        self, values: np.ndarray, kind: str, *, target: int | None = None, bounds: bool = False
    ) -> int:
        """The number of a new accessor with ``(count, width)`` values of a NumPy type such as ``<f4``.

        bounds: state the smallest and largest values, as times and places of vertices need.
        """
        stored = np.ascontiguousarray(values, dtype=kind)
        accessor: dict[str, Any] = {
            "bufferView": self.bytes_view(stored.tobytes(), target),
            "componentType": _CODES[stored.dtype],
            "count": len(stored),
            "type": _TYPES[stored.shape[1]],
        }
        if bounds:
            accessor["min"] = stored.min(axis=0).tolist()
            accessor["max"] = stored.max(axis=0).tolist()
        return self.add("accessors", accessor)

    def add(self, key: str, item: dict[str, Any]) -> int:
        """The number of a new object of a list at the top level."""
        items: list[dict[str, Any]] = self.content.setdefault(key, [])
        items.append(item)
        return len(items) - 1

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all. Raises FileError."""
        self._data += b"\0" * (-len(self._data) % 4)
        self.content["buffers"] = [{"byteLength": len(self._data)}]
        text = json.dumps(self.content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        head = text.encode("utf-8", "surrogatepass")
        head += b" " * (-len(head) % 4)
        total = 12 + 8 + len(head) + 8 + len(self._data)
        if total > _LARGEST:
            raise FileError(path, "not written: a GLB file holds 4 GB at most")
        with atomic(path) as temporary, temporary.open("wb") as file:
            file.write(MAGIC + struct.pack("<II", 2, total))
            file.write(struct.pack("<I4s", len(head), b"JSON") + head)
            file.write(struct.pack("<I4s", len(self._data), b"BIN\0"))
            file.write(self._data)


class AnimationBuilder:
    """An animation of a file being put together: frames at one rate, connected linearly.

    frames: how many. fps: frames per second.
    """

    def __init__(self, builder: Builder, name: str, frames: int, fps: float) -> None:
        self._builder, self._name, self._frames = builder, name, frames
        self._times = builder.array(np.arange(frames)[:, None] / fps, "<f4", bounds=True)
        self._first: int | None = None
        self._channels: list[dict[str, Any]] = []
        self._samplers: list[dict[str, Any]] = []

    def track(self, node: int, path: str, values: np.ndarray) -> None:
        """``(frames, width)`` translations, scales, or rotations with w first, of a node; or one for all
        frames."""
        if path == "rotation":
            values = values[:, [1, 2, 3, 0]]
        times = self._times
        if len(values) < self._frames:
            if self._first is None:
                self._first = self._builder.array(np.zeros((1, 1)), "<f4", bounds=True)
            times = self._first
        self._channels.append({"sampler": len(self._samplers), "target": {"node": node, "path": path}})
        self._samplers.append({"input": times, "output": self._builder.array(values, "<f4")})

    def finished(self) -> dict[str, Any]:
        """The animation's JSON."""
        return {"name": self._name, "channels": self._channels, "samplers": self._samplers}
