"""Animations of a glTF file: their tracks, the rate that they were made at, and values at given times.

After the specification of glTF 2.0, section 3.11 and appendix C (interpolation).
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import numpy as np

from retarget_bench.motion.files.gltf.document import Document
from retarget_bench.motion.files.scenes.scene import Track

_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
_INTERPOLATIONS = ("LINEAR", "STEP", "CUBICSPLINE")
_RATES = (30, 24, 25, 48, 50, 60, 90, 100, 120, 240, 12, 15, 20, 10, 24 / 1.001, 30 / 1.001, 60 / 1.001)
"""Rates in use; those that are tried first for keys that are not evenly spaced come first."""
_USUAL = 30.0
_SLOWEST = 5.0
"""Keys farther apart than at this rate are poses to be connected, and not frames."""
_ON_GRID = 0.02
"""Share of a frame within which a key lies on it: times are single precision."""
_MOST_FRAMES = 10_000_000
"""Frames times tracks."""


def take_names(document: Document) -> tuple[str, ...]:
    """The names of a file's animations, "" for one without a name."""
    return tuple(document.name(each) for each in document.items("animations"))


def tracks(document: Document, number: int, only: Container[int]) -> list[Track]:
    """The tracks of an animation that move, turn or scale some nodes. Raises FileError where one is
    damaged."""
    item = document.item("animations", number, "the file")
    by = f"animations[{number}]"
    samplers = document.listed(item, "samplers", by)
    tracks: dict[tuple[int, str], Track] = {}
    for channel in document.listed(item, "channels", by):
        target = document.inside(channel, "target", by)
        path, node = target.get("path"), target.get("node")
        if node is None or not isinstance(path, str) or path not in _WIDTHS:
            continue  # weights of morph targets, and what extensions animate
        document.item("nodes", node, by)
        if node not in only:
            continue
        sampler = document.integer(channel, "sampler", by)
        if sampler >= len(samplers):
            raise document.fail(f"{by} refers to sampler {sampler} of {len(samplers)}")
        tracks[node, path] = _track(document, samplers[sampler], node, path, f"{by}.samplers[{sampler}]")
    return list(tracks.values())


def animated(document: Document, number: int) -> list[int]:
    """The nodes that an animation turns or moves."""
    by, nodes = f"animations[{number}]", []
    for channel in document.listed(document.items("animations")[number], "channels", by):
        target = document.inside(channel, "target", by)
        if target.get("path") in ("rotation", "translation") and target.get("node") is not None:
            document.item("nodes", target["node"], by)
            nodes.append(target["node"])
    return nodes


def _track(document: Document, sampler: dict[str, Any], node: int, path: str, by: str) -> Track:
    interpolation = sampler.get("interpolation", "LINEAR")
    if interpolation not in _INTERPOLATIONS:
        raise document.fail(f"{by} has an unknown interpolation {str(interpolation)[:20]!r}")
    times = document.array(sampler.get("input"), ("SCALAR",), f"{by}.input")[:, 0]
    values = document.array(sampler.get("output"), (f"VEC{_WIDTHS[path]}",), f"{by}.output")
    if interpolation == "CUBICSPLINE":
        if len(values) % 3:
            raise document.fail(f"{by} has {len(values)} values, which are not three for each key")
        values = values.reshape(-1, 3, _WIDTHS[path])
    if not len(times) or len(times) != len(values):
        raise document.fail(f"{by} has {len(times)} times and {len(values)} values")
    if (np.diff(times) < 0).any() or np.abs(times).max() > 1e9:
        raise document.fail(f"{by} has times that do not ascend")
    if np.abs(values).max(initial=0.0) > 1e9:
        raise document.fail(f"{by} holds numbers above 1e+09: no body is that long in any unit")
    if path == "rotation":
        values = values[..., [3, 0, 1, 2]]
    return Track(node, path, times.astype(np.float64), values, interpolation)


def frame_times(document: Document, tracks: Iterable[Track]) -> tuple[np.ndarray, float, str]:
    """The times ``(frames,)`` to sample tracks at, the frames per second, and how these were found.

    Where the keys are evenly spaced they are the frames. Otherwise it is the first usual rate on whose
    frames all keys lie, else 30. A frame beside a key is moved onto it, so that nothing is interpolated
    that is stated.
    """
    tracks = list(tracks)
    keys = _distinct(np.concatenate([track.times for track in tracks])) if tracks else np.zeros(1)
    if len(keys) == 1:
        return keys, _USUAL, "holds one pose"
    fps, how = _rate(keys)
    count = int(np.floor((keys[-1] - keys[0]) * fps + _ON_GRID)) + 1
    if count * max(len(tracks), 1) > _MOST_FRAMES:
        raise document.fail(f"has an animation that lasts {keys[-1] - keys[0]:.4g} s: it is damaged")
    times = keys[0] + np.arange(count) / fps
    near = np.clip(np.searchsorted(keys, times), 1, len(keys) - 1)
    near -= (times - keys[near - 1]) < (keys[near] - times)
    beside = np.abs(keys[near] - times) <= _ON_GRID / fps
    return np.where(beside, keys[near], times), fps, how


def _distinct(times: np.ndarray) -> np.ndarray:
    """The times in order; those that differ by rounding in single precision are one."""
    times = np.sort(times)
    apart = max(1e-6, 4 * float(np.finfo(np.float32).eps) * float(np.abs(times).max()))
    return times[np.concatenate([[True], np.diff(times) > apart])]


def _rate(keys: np.ndarray) -> tuple[float, str]:
    """Frames per second of keys, at least two, and how they tell it."""
    even = (len(keys) - 1) / (keys[-1] - keys[0])
    grid = keys[0] + np.arange(len(keys)) / even
    if even >= _SLOWEST and np.abs(keys - grid).max() <= _ON_GRID / even:
        near = min(_RATES, key=lambda rate: abs(rate - even))
        fps = near if abs(near - even) <= 1e-3 * near else float(f"{even:.5g}")
        return float(fps), f"{fps:g} per second, as its keys are spaced"
    for rate in _RATES:
        frames = keys * rate
        if np.abs(frames - np.round(frames)).max() <= _ON_GRID:
            return float(rate), f"{rate:g} per second, on whose frames its keys lie"
    return _USUAL, f"{_USUAL:g} per second, since its keys are not evenly spaced"
