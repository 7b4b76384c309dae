"""The process that reads an FBX file: ``python child.py FILE FOLDER TAKE MEMORY SECONDS``.

ufbx crashes where its objects are freed, at the end of a process too, and damaged files may make it crash
or run on for ever. So it is used here alone: all of its objects are kept in a list, what was found is
written as arrays, and the process ends without cleaning up. To start fast it imports NumPy and ufbx alone.

Written is ``scene.npz`` with the arrays of ``fbx.content.Content``, or ``problem.txt`` with the rest of a
sentence about the file.
"""

from __future__ import annotations

import gc
import json
import math
import os
import sys
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

SCENE, PROBLEM = "scene.npz", "problem.txt"
NO_TAKE = "0"
"""Asks for no frames: numbers of takes begin at 1."""
_ALIVE: list[Any] = []
"""Objects of ufbx, none of which may be freed."""
_MOST_NODES = 100_000
_MOST_FRAMES = 10_000_000
"""Frames times nodes."""
_DEEPEST = 5_000
_UNPACKED, _UNPACKED_PER_BYTE = 1 << 28, 30
"""Bytes that a file may unpack to, and for each of its own: compressed zeros cost it a thousandth."""
_ON_GRID = 0.02
"""Share of a frame by which a take may end before its last frame."""
_AFTER = 1e-10
"""Seconds after a frame at which it is looked at: times of keys are rounded, and a key that makes a step
has to be reached."""
_SLOWEST, _FASTEST = 1.0, 1000.0
_PATHS = {"Lcl Translation": 0, "Lcl Rotation": 1, "Lcl Scaling": 2}
_SAME_SCALE = 1e-4
"""Share by which a scale may change and count as constant: that much is rounding in single precision."""
_PROBLEMS = {
    "EmptyFileError": "is empty",
    "TruncatedFileError": "is cut off",
    "UnsupportedVersionError": "is of a version of FBX that is not read: export it again, as FBX 7.4",
    "NodeDepthLimitError": f"has nodes more than {_DEEPEST} deep: it is damaged",
    "Failed to load": "is damaged: ufbx cannot read it",
    **dict.fromkeys(("UnrecognizedFileFormatError", "Not an FBX file"), "is no FBX file"),
}
"""Sentences on errors, by their type or their text."""


class Refused(Exception):
    """A file that is not read; the text is the rest of a sentence about it."""


def extract(path: Path, take: str) -> dict[str, np.ndarray]:
    """The arrays of a file. Raises Refused, errors of ufbx, MemoryError.

    take: whose frames to add, by name or number from 1 on; "": the first that moves a bone.
    """
    scene = _loaded(path)
    nodes = _list(scene.nodes)[1:]  # without the root that ufbx adds
    if len(nodes) > _MOST_NODES:
        raise Refused(f"has {len(nodes)} nodes; files of up to {_MOST_NODES} are read")
    numbers = {node.element_id: number for number, node in enumerate(nodes)}
    arrays = _tree(nodes, numbers)
    takes = _list(scene.anim_stacks)
    arrays["spreads"], curves = _animated(takes, numbers)
    arrays |= _meshes(scene, nodes, numbers)
    concerned = _concerned(arrays)
    number = _chosen(take, [each.name for each in takes], arrays["spreads"], concerned)
    facts = {**_facts(scene, nodes, takes), "baked": number}
    facts["characters"] = [_links(each, numbers) for each in _list(scene.characters)]
    if number is not None:
        rate, spacing = _rate(facts, curves[number])
        facts |= {"rate": rate, "keys_per_second": spacing}
        moved = [node for node in concerned if (arrays["spreads"][number, node] >= 0).any()]
        times = _times(takes[number], curves[number], rate, len(moved))
        arrays |= _baked(_keep(takes[number].anim), [nodes[node] for node in moved], times)
        arrays |= {"moved": np.array(moved, dtype=np.int64), "times": times}
    arrays["facts"] = np.frombuffer(json.dumps(facts).encode(), np.uint8)
    return arrays


# ------------------------------------------------------------------------------------------------ ufbx
def _keep(thing: Any) -> Any:
    """The same object, which is never freed."""
    _ALIVE.append(thing)
    return thing


def _list(things: Any) -> list[Any]:
    """The objects of a list of ufbx."""
    return _keep([_keep(each) for each in _keep(things)])


def _array(values: Any) -> np.ndarray:
    """A copy of a list of numbers of ufbx."""
    return np.array(_keep(memoryview(_keep(values))))


def _integers(values: Any) -> np.ndarray:
    """Likewise of a list of whole numbers, which has no buffer."""
    values = _keep(values)
    return np.fromiter(iter(values), np.int64, len(values))


def _matrix(columns: Any) -> np.ndarray:
    """``(4, 4)`` of a transform of ufbx, which states four columns."""
    matrix = np.eye(4)
    matrix[:3] = np.array(columns).T
    return matrix


def _loaded(path: Path) -> Any:
    """The scene, with scales that children inherit and joints that turn about their own places."""
    import ufbx

    options: dict[str, Any] = {
        "file_format": ufbx.FileFormat.FBX,
        "ignore_embedded": True,
        "skip_mesh_parts": True,
        "skip_skin_vertices": True,
        "node_depth_limit": _DEEPEST,
        "inherit_mode_handling": ufbx.InheritModeHandling.COMPENSATE,
        "pivot_handling": ufbx.PivotHandling.ADJUST_TO_ROTATION_PIVOT,
        "index_error_handling": ufbx.IndexErrorHandling.ABORT_LOADING,
    }
    data = _keep(path.read_bytes())
    _limit_growth(_UNPACKED + _UNPACKED_PER_BYTE * len(data))
    scene = _keep(ufbx.load_memory(data, **options))
    _limit_growth(sys.maxsize)
    return scene


def _facts(scene: Any, nodes: list[Any], takes: list[Any]) -> dict[str, Any]:
    """The facts that are no arrays: names, unit, axes and rate."""
    import ufbx

    settings = _keep(scene.settings)
    return {
        "names": [node.name for node in nodes],
        "takes": [each.name for each in takes],
        "unit": settings.unit_meters,
        "axes": [int(axis) for axis in settings.axes],
        "fps": settings.frames_per_second,
        "rate_stated": ufbx.find_int(_keep(settings.props), "TimeMode", 0) > 0,
    }


# ----------------------------------------------------------------------------------------------- nodes
def _tree(nodes: list[Any], numbers: dict[int, int]) -> dict[str, np.ndarray]:
    """Parents, transforms at rest and kinds of the nodes."""
    import ufbx

    parents = np.full(len(nodes), -1)
    rest = np.empty((len(nodes), 10))
    kinds = np.zeros(len(nodes), dtype=np.int64)
    for number, node in enumerate(nodes):
        if (parent := _keep(node.parent)) is not None:
            parents[number] = numbers.get(parent.element_id, -1)
        rest[number] = _flat(node.local_transform)
        kinds[number] = int(node.attrib_type)
    plain = (int(ufbx.ElementType.UNKNOWN), int(ufbx.ElementType.BONE), int(ufbx.ElementType.EMPTY))
    return {
        "parents": parents,
        "rest": rest,
        "bones": kinds == int(ufbx.ElementType.BONE),
        "plain": np.isin(kinds, plain),
    }


def _flat(transform: Any) -> tuple[float, ...]:
    """Translation, rotation (w first) and scale of a transform of ufbx: ten numbers."""
    (a, b, c), (x, y, z, w), (d, e, f) = transform
    return a, b, c, w, x, y, z, d, e, f


def _concerned(arrays: dict[str, np.ndarray]) -> list[int]:
    """The nodes whose motion is read: bones and all above them; without bones all nodes."""
    parents, chosen = arrays["parents"].tolist(), set[int]()
    skinned = [arrays[name].tolist() for name in arrays if name.startswith("skin_joints_")]
    bones = {*np.flatnonzero(arrays["bones"]).tolist(), *(node for each in skinned for node in each)}
    for node in bones or range(len(parents)):
        while node >= 0 and node not in chosen:
            chosen.add(node)
            node = parents[node]
    return sorted(chosen)


def _links(character: Any, numbers: dict[int, int]) -> dict[str, int]:
    """The links of a HumanIK character: the property without ``Link`` -> the node."""
    ends = [(_keep(each.src).element_id, each.dst_prop) for each in _list(character.connections_dst)]
    return {name.removesuffix("Link"): numbers[end] for end, name in reversed(ends) if end in numbers}


# ----------------------------------------------------------------------------------------------- takes
def _animated(takes: list[Any], numbers: dict[int, int]) -> tuple[np.ndarray, list[list[Any]]]:
    """``(takes, nodes, 3)`` the largest range of the curves of every node's translation, rotation (degrees)
    and scale, -1 where it has none; and the curves of each take."""
    spreads = np.full((len(takes), len(numbers), 3), -1.0)
    curves: list[list[Any]] = []
    for number, take in enumerate(takes):
        curves.append([])
        for layer in _list(take.layers):
            for prop in _list(layer.anim_props):
                node = numbers.get(_keep(prop.element).element_id)
                path = _PATHS.get(prop.prop_name)
                if node is None or path is None:
                    continue
                for curve in _keep(_keep(prop.anim_value).curves):
                    if curve is not None and len(_keep(curve.keyframes)):
                        spread = curve.max_value - curve.min_value
                        spreads[number, node, path] = max(spreads[number, node, path], spread)
                        curves[-1].append(_keep(curve))
    return spreads, curves


def _chosen(take: str, names: list[str], spreads: np.ndarray, concerned: list[int]) -> int | None:
    """The number of the take whose frames to add; the reader asks again where it needs another."""
    if take in names:
        return names.index(take)
    if take == NO_TAKE:
        return None
    if take.isdecimal() and 0 < int(take[:9]) <= len(names):
        return int(take) - 1
    own = spreads[:, concerned]
    for has in (own > 0, own >= 0):
        moving = np.flatnonzero(has.any(axis=(1, 2)))
        if len(moving):
            return int(moving[0])
    return None


def _rate(facts: dict[str, Any], curves: list[Any]) -> tuple[float, float]:
    """Frames per second, and those that the keys of the longest curve are spaced by, 0 where unevenly."""
    longest = max(curves, key=lambda curve: len(_keep(curve.keyframes)), default=None)
    times = [key.time for key in _keep(longest.keyframes)] if longest is not None else []
    steps = np.diff(times)
    spacing = 0.0
    if len(steps) > 1 and 0 < steps.max() <= (1 + _ON_GRID) * steps.min():
        spacing = float(1.0 / steps.mean())
    stated = facts["fps"] if facts["rate_stated"] else math.nan
    for rate in (stated, spacing, facts["fps"]):
        if _SLOWEST <= rate <= _FASTEST:
            return rate, spacing
    return 30.0, spacing


def _times(take: Any, curves: list[Any], rate: float, moved: int) -> np.ndarray:
    """``(frames,)`` seconds of the frames of a take: its own range, or that of its keys where it has
    none or another than they."""
    low = min((curve.min_time for curve in curves), default=0.0)
    high = max((curve.max_time for curve in curves), default=0.0)
    begin, end = take.time_begin, take.time_end
    if not (math.isfinite(begin) and math.isfinite(end) and begin < end and begin <= high and low <= end):
        begin, end = low, high
    count = (end - begin) * rate + _ON_GRID + 1
    if not (math.isfinite(count) and count * max(moved, 1) <= _MOST_FRAMES):
        raise Refused(f"has a take that lasts {end - begin:.4g} s: it is damaged")
    return np.asarray(begin + np.arange(max(int(count), 1)) / rate)


def _baked(anim: Any, nodes: list[Any], times: np.ndarray) -> dict[str, np.ndarray]:
    """Translations, rotations and scales of the nodes at the times: ``moved_PATH_N`` for the nth of them,
    ``(frames, width)``, or one row where it does not change."""
    arrays: dict[str, np.ndarray] = {}
    shifted = (times + _AFTER).tolist()
    for number, node in enumerate(nodes):
        at = node.evaluate_transform
        rows = np.array([_flat(at(anim, time)) for time in shifted])
        scales = rows[:, 7:]
        if (np.ptp(scales, axis=0) <= _SAME_SCALE * np.abs(scales).max(axis=0)).all():
            rows[:, 7:] = np.median(scales, axis=0)
        for name, part in (("translation", rows[:, :3]), ("rotation", rows[:, 3:7]), ("scale", scales)):
            still = not np.ptp(part, axis=0).any()
            arrays[f"moved_{name}_{number}"] = np.array(part[:1] if still else part)
    return arrays


# ---------------------------------------------------------------------------------------------- meshes
def _meshes(scene: Any, nodes: list[Any], numbers: dict[int, int]) -> dict[str, np.ndarray]:
    """The triangles of the meshes, the nodes that show them, and what binds them to joints."""
    arrays: dict[str, np.ndarray] = {}
    surfaces, skins = [], 0
    for mesh_number, mesh in enumerate(_list(scene.meshes)):
        shown = [numbers[node.element_id] for node in _list(mesh.instances) if node.element_id in numbers]
        if not shown:
            continue
        arrays |= _triangles(mesh, mesh_number)
        deformers = _list(mesh.skin_deformers)
        bound = _bound(deformers[0], numbers, skins) if deformers else {}
        arrays |= bound
        for node in shown:
            surfaces.append((node, mesh_number, skins if bound else -1))
        skins += bool(bound)
    arrays["surfaces"] = np.array(surfaces, dtype=np.int64).reshape(-1, 3)
    geometry = [_matrix(nodes[node].geometry_to_node) for node, _, _ in surfaces]
    arrays["geometry"] = np.array(geometry).reshape(-1, 4, 4)
    return arrays


def _triangles(mesh: Any, number: int) -> dict[str, np.ndarray]:
    """Vertices, and polygons as fans of triangles."""
    corners = _integers(mesh.vertex_indices)
    faces = _array(mesh.faces).astype(np.int64).reshape(-1, 2)
    extra = np.maximum(faces[:, 1] - 2, 0)
    first = np.repeat(faces[:, 0], extra)
    step = np.arange(extra.sum()) - np.repeat(np.cumsum(extra) - extra, extra)
    triangles = corners[np.stack([first, first + step + 1, first + step + 2], axis=1).reshape(-1, 3)]
    return {f"vertices_{number}": _array(mesh.vertices).reshape(-1, 3), f"faces_{number}": triangles}


def _bound(skin: Any, numbers: dict[int, int], number: int) -> dict[str, np.ndarray]:
    """The joints of a skin, the matrices that bind them, and the weights of vertices; {} without joints."""
    joints: list[int] = []
    matrices, worlds, weights = [], [], []
    for cluster in _list(skin.clusters):
        node = _keep(cluster.bone_node)
        if node is None or node.element_id not in numbers:
            continue
        vertices = _integers(cluster.vertices)
        shares = _array(cluster.weights)
        weights.append(np.stack([np.full(len(vertices), len(joints)), vertices, shares], axis=1))
        joints.append(numbers[node.element_id])
        # a bone with a pivot was moved there, and its geometry by as much the other way
        back = np.eye(4)
        back[:3, 3] = node.geometry_transform.translation
        matrices.append(back @ _matrix(cluster.geometry_to_bone))
        worlds.append(_matrix(cluster.bind_to_world) @ np.linalg.inv(back))
    if not joints:
        return {}
    return {
        f"skin_joints_{number}": np.array(joints, dtype=np.int64),
        f"skin_matrices_{number}": np.array(matrices),
        f"skin_worlds_{number}": np.array(worlds),
        f"skin_weights_{number}": np.concatenate(weights),
    }


# -------------------------------------------------------------------------------------------- process
def limit(memory: int, seconds: int) -> None:
    """Bound this process's address space (bytes) and processor time, where the system can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    for kind, most in (("RLIMIT_AS", memory), ("RLIMIT_CPU", seconds), ("RLIMIT_CORE", 0)):
        try:
            resource.setrlimit(getattr(resource, kind), (most, most))
        except (ValueError, OSError, AttributeError):  # not of this system, or already lower
            continue


def _limit_growth(most: int) -> None:
    """Bound the bytes by which the address space may grow from now on, where the system can."""
    if sys.platform == "linux":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
        soft = min(pages * resource.getpagesize() + most, hard if hard >= 0 else sys.maxsize)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def answer(path: Path, folder: Path, take: str) -> None:
    """Write what a file holds, or what is wrong with it, into a folder."""
    try:
        arrays = extract(path, take)
        with (folder / "written").open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]
        (folder / "written").replace(folder / SCENE)
    except Exception as error:
        (folder / PROBLEM).write_text(_sentence(error), encoding="utf-8", errors="replace")


def _sentence(error: Exception) -> str:
    if isinstance(error, Refused):
        return str(error)
    name, message = type(error).__name__, " ".join(str(error).split())[:200]
    if isinstance(error, MemoryError) or name in ("OutOfMemoryError", "MemoryLimitError"):
        return "needs more memory than a motion file should: it is damaged"
    if isinstance(error, OSError) and name not in _PROBLEMS:
        return f"cannot be read ({error.strerror or error})"
    return _PROBLEMS.get(name) or _PROBLEMS.get(message) or f"cannot be read: ufbx says {message or name!r}"


def main(arguments: list[str]) -> NoReturn:
    """Answer, and end at once."""
    gc.disable()
    file, folder, take, memory, seconds = arguments
    limit(int(memory), int(float(seconds)) + 1)
    answer(Path(file), Path(folder), take)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
