"""From what a BVH file says to a skeleton and its motion."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.bvh_document import Document, Hierarchy
from retarget_bench.motion.bvh_root import is_relative, reach
from retarget_bench.motion.skeleton import EndSite, Skeleton

ROOT_READINGS = ("auto", "absolute", "relative")
_STILL = 1e-3
"""Share of the body's reach up to which a joint's place against its parent counts as constant."""
_DUMMY_NAMES = ("root", "reference", "armature", "world", "scene", "origin", "global", "master")
_HIP_NAMES = ("hip", "pelvis")


@dataclass(frozen=True, eq=False)
class Recording:
    """A motion as a file states it, in the file's axes; it knows nothing of roles or units.

    rotations: ``(frames, joints, 4)`` local unit quaternions, w first, continuous in sign.
    root:      ``(frames, 3)`` the root joint's place in the world, in the file's unit times the scale.
    notes:     one sentence for each thing that was decided, folded or renamed.
    """

    skeleton: Skeleton
    rotations: np.ndarray
    root: np.ndarray
    fps: float
    notes: tuple[str, ...] = ()


def record(path: Path, document: Document, *, root: str, scale: float) -> Recording:
    """The recording that a document states; see ``bvh.read``."""
    if root not in ROOT_READINGS:
        raise NotSupported(f"root={root!r} is not known; it is one of {', '.join(ROOT_READINGS)}")
    if not (np.isfinite(scale) and scale > 0):
        raise NotSupported(f"scale must be positive, got {scale}")
    notes: list[str] = []
    names = _unique_names(document.hierarchy, notes)
    turned = local_rotations(document)
    stated = _stated_places(path, document)
    first = _first_joint(document.hierarchy, stated, turned, notes)
    offsets = _constant_offsets(path, document.hierarchy, names, stated, first, notes)
    skeleton = _skeleton(document.hierarchy, names, offsets, first, scale)
    absolute, heading = _carried(document, stated, turned, first, relative=False)
    relative, _ = _carried(document, stated, turned, first, relative=True)
    turned = turned[:, first:]
    turned[:, 0] = heading
    absolute, relative = absolute * scale, relative * scale
    chosen = _reading(root, skeleton, turned, absolute, relative, notes)
    return Recording(skeleton, rotation.continuous(turned), chosen, document.fps, tuple(notes))


def local_rotations(document: Document) -> np.ndarray:
    """``(frames, joints, 4)`` unit quaternions; joints with the same channel order are turned at once."""
    hierarchy = document.hierarchy
    groups: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for joint in range(len(hierarchy)):
        groups[tuple(hierarchy.rotation_columns(joint))].append(joint)
    turned = rotation.identity(document.frames, len(hierarchy))
    for axes, joints in groups.items():
        if not axes:
            continue
        columns = [list(hierarchy.rotation_columns(joint).values()) for joint in joints]
        angles = np.zeros((document.frames, len(joints), 3))
        angles[..., : len(axes)] = np.radians(document.values[:, columns])
        # a joint that lacks an axis never turns about it: that axis goes last, with angle 0
        order = "".join("XYZ"[axis] for axis in (*axes, *({0, 1, 2} - set(axes))))
        turned[:, joints] = rotation.from_euler(angles, order)
    return turned


def _unique_names(hierarchy: Hierarchy, notes: list[str]) -> tuple[str, ...]:
    """The names, with ``_2``, ``_3`` ... behind those that occurred before."""
    taken, used, last = set(hierarchy.names), set[str](), dict[str, int]()
    names = []
    for name in hierarchy.names:
        unique = name
        while unique in used or (unique != name and unique in taken):
            last[name] = last.get(name, 1) + 1
            unique = f"{name}_{last[name]}"
        if unique != name:
            notes.append(f"another joint {name!r} is called {unique!r}")
        used.add(unique)
        names.append(unique)
    return tuple(names)


def _stated_places(path: Path, document: Document) -> dict[int, np.ndarray]:
    """Joint -> ``(frames, 3)`` its position channels, for the joints that have them."""
    stated = {}
    for joint, name in enumerate(document.hierarchy.names):
        columns = document.hierarchy.position_columns(joint)
        if len(columns) == 3:
            stated[joint] = document.values[:, [columns[axis] for axis in range(3)]]
        elif columns:
            raise FileError(
                path, f"joint {name!r} has {len(columns)} position channels: 3 or none are read"
            )
    return stated


# ------------------------------------------------------------------------------------- the dummy root
def _first_joint(
    hierarchy: Hierarchy, stated: dict[int, np.ndarray], turned: np.ndarray, notes: list[str]
) -> int:
    """The joint that becomes the root: whatever lies above it only carries it, and is folded into it."""
    first = 0
    while _is_dummy(hierarchy, first, stated, turned):
        first += 1
    if first:
        above = ", ".join(map(repr, hierarchy.names[:first]))
        notes.append(f"{above} only carries {hierarchy.names[first]!r} and is folded into it")
    return first


def _is_dummy(hierarchy: Hierarchy, joint: int, stated: dict[int, np.ndarray], turned: np.ndarray) -> bool:
    """Whether the joint has one child alone, which moves by itself or is named as the hips.

    Folding is exact for any joint with one child; this only decides what deserves to be the root.
    """
    if hierarchy.children(joint) != [joint + 1] or any(s.parent == joint for s in hierarchy.end_sites):
        return False
    if joint + 1 in stated:
        still = not np.any(stated.get(joint, 0.0)) and not np.any(turned[:, joint, 1:])
        lengths = np.abs(hierarchy.offsets).sum()
        return still or bool(np.ptp(stated[joint + 1], axis=0).max() > _STILL * lengths)
    name, below = hierarchy.names[joint].lower(), hierarchy.names[joint + 1].lower()
    return any(word in name for word in _DUMMY_NAMES) and any(word in below for word in _HIP_NAMES)


def _carried(
    document: Document, stated: dict[int, np.ndarray], turned: np.ndarray, first: int, *, relative: bool
) -> tuple[np.ndarray, np.ndarray]:
    """World places ``(frames, 3)`` and orientations ``(frames, 4)`` of the joint ``first``."""
    place = np.zeros((document.frames, 3))
    heading = rotation.identity(document.frames)
    for joint in range(first + 1):
        offset = document.hierarchy.offsets[joint]
        step = stated[joint] + offset * relative if joint in stated else offset
        place = place + rotation.rotate(heading, np.broadcast_to(step, place.shape))
        heading = rotation.multiply(heading, turned[:, joint])
    return place, heading


def _reading(
    asked: str,
    skeleton: Skeleton,
    turned: np.ndarray,
    absolute: np.ndarray,
    relative: np.ndarray,
    notes: list[str],
) -> np.ndarray:
    """The root's places by the asked reading, or by the one that the data speaks for."""
    if np.abs(relative - absolute).max() <= 1e-6 * reach(skeleton):
        return absolute
    if asked == "auto":
        asked = "relative" if is_relative(skeleton, turned, absolute, relative) else "absolute"
        other = "absolute" if asked == "relative" else "relative"
        away = np.linalg.norm((relative - absolute).mean(axis=0))
        notes.append(f"root places read as {asked} (root={other} would move them by {away:.4g})")
    return relative if asked == "relative" else absolute


# ----------------------------------------------------------------------------------------- the bones
def _constant_offsets(
    path: Path,
    hierarchy: Hierarchy,
    names: tuple[str, ...],
    stated: dict[int, np.ndarray],
    first: int,
    notes: list[str],
) -> np.ndarray:
    """``(joints, 3)`` offsets, where position channels below the root replace or confirm those of the file.

    Raises FileError when such a joint moves against its parent: a skeleton has bones of fixed length.
    """
    offsets = np.array(hierarchy.offsets)
    joints = [joint for joint in stated if joint > first]
    if not joints:
        return offsets
    limit = _STILL * np.abs(hierarchy.offsets).sum(axis=1).max()
    lows = np.array([stated[joint].min(axis=0) for joint in joints])
    highs = np.array([stated[joint].max(axis=0) for joint in joints])
    means, spread = (lows + highs) / 2, (highs - lows).max(axis=1)
    if spread.max() > limit:
        worst = joints[int(np.argmax(spread))]
        raise FileError(
            path,
            f"joint {names[worst]!r} moves by up to {spread.max():.4g} against its parent, which only the "
            "root may do: export the file without position channels below the root",
        )
    if np.abs(means).sum() < np.abs(means - offsets[joints]).sum():
        means = means + offsets[joints]
    change = np.abs(means - offsets[joints]).max(axis=1)
    changed = [joint for joint, by in zip(joints, change, strict=True) if by > limit]
    offsets[changed] = means[change > limit]
    notes.append(
        f"position channels of {len(joints)} joints below the root are constant within {spread.max():.2g}"
        + (
            f"; {len(changed)} of them replace an OFFSET that is up to {change.max():.4g} away"
            * bool(changed)
        )
    )
    return offsets


def _skeleton(
    hierarchy: Hierarchy, names: tuple[str, ...], offsets: np.ndarray, first: int, scale: float
) -> Skeleton:
    """The joints from ``first`` on, its offset gathered over those above it."""
    kept = offsets[first:].copy()
    kept[0] = offsets[: first + 1].sum(axis=0)
    sites = tuple(
        EndSite(site.parent - first, tuple((np.array(site.offset) * scale).tolist()))
        for site in hierarchy.end_sites
    )
    parents = np.maximum(hierarchy.parents[first:] - first, -1)
    return Skeleton(names[first:], parents, kept * scale, sites)
