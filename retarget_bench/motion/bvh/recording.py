"""A BVH document as a skeleton and its motion."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError, NotSupported
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.bvh.document import POSITIONS, ROTATIONS, Document, Hierarchy
from retarget_bench.motion.recording import MOST_JOINTS, Recording, reach, resting, unique_names
from retarget_bench.motion.skeleton import EndSite, Skeleton

ROOT_READINGS = ("auto", "absolute", "relative")
_STILL, _SAME = 1e-3, 1e-5
"""Shares of the body's reach up to which a joint's place in its parent's frame counts as constant (a skin
moves more than that on its bone), and up to which it counts as its OFFSET (rounding in print)."""
_LONGEST = 1e9
"""No body is longer in any unit."""
DUMMY_NAMES = ("root", "reference", "armature", "world", "scene", "origin", "global", "master")
HIP_NAMES = ("hip", "pelvis")

Offset = tuple[float, float, float]


def record(
    path: Path,
    document: Document,
    *,
    root: str,
    scale: float,
    fold: bool,
    inner: bool = False,
    rate: float | None = None,
) -> Recording:
    """The recording that a document states; see ``bvh.read``."""
    if root not in ROOT_READINGS:
        raise NotSupported(f"root={root!r} is not known; it is one of {', '.join(ROOT_READINGS)}")
    if not (np.isfinite(scale) and scale > 0):
        raise NotSupported(f"scale must be positive, got {scale}")
    hierarchy, notes = document.hierarchy, list[str]()
    if len(hierarchy) > MOST_JOINTS:
        raise FileError(path, f"has {len(hierarchy)} joints; bodies of up to {MOST_JOINTS} are read")
    tips = np.array([site.offset for site in hierarchy.end_sites])
    if any(np.abs(each).max(initial=0.0) > _LONGEST for each in (hierarchy.offsets, tips, document.values)):
        raise FileError(path, f"holds numbers above {_LONGEST:g}: no body is that long in any unit")
    names = unique_names(hierarchy.names)
    notes += [
        f"a second joint {old!r} is called {new!r}"
        for old, new in zip(hierarchy.names, names, strict=True)
        if old != new
    ]
    turned = local_rotations(document)
    stated = _stated_places(path, document)
    first = 0
    while fold and _is_dummy(hierarchy, first, stated, turned):
        first += 1
    if first:  # whatever lies above only carries it, and is folded into it
        above = ", ".join(map(repr, hierarchy.names[:first]))
        notes.append(f"{above} only carries {hierarchy.names[first]!r} and is folded into it")
    replaced, moved = _replaced_offsets(path, hierarchy, stated, first, notes, inner=inner)
    skeleton = _skeleton(hierarchy, first, replaced, scale)
    absolute, heading = _carried(document, stated, turned, first, relative=False)
    relative, _ = _carried(document, stated, turned, first, relative=True)
    turned = turned[:, first:]
    turned[:, 0] = heading
    absolute, relative = absolute * scale, relative * scale
    if np.abs(relative - absolute).max() <= 1e-6 * reach(skeleton):
        root = "absolute"
    if root == "auto":
        root = "relative" if is_relative(skeleton, turned, absolute, relative) else "absolute"
        other = "absolute" if root == "relative" else "relative"
        away = np.linalg.norm((relative - absolute).mean(axis=0))
        notes.append(f"root places read as {root} (root={other} would move them by {away:.4g})")
    places = relative if root == "relative" else absolute
    turned = rotation.continuous(turned)
    steps = _steps(skeleton, first, moved, document.frames, scale)
    timed = document.frame_time > 0
    fps = document.fps if timed or rate is None else rate
    return Recording(skeleton, turned, places, fps, tuple(notes), rate_stated=timed, places=steps)


def _steps(
    skeleton: Skeleton, first: int, moved: dict[int, np.ndarray], frames: int, scale: float
) -> np.ndarray | None:
    """``(frames, joints, 3)`` every joint in its parent's frame, of those of the file that move there."""
    if not moved:
        return None
    steps = np.repeat(skeleton.offsets[None], frames, axis=0)
    for joint, positions in moved.items():
        steps[:, joint - first] = positions * scale
    return steps


def local_rotations(document: Document) -> np.ndarray:
    """``(frames, joints, 4)`` unit quaternions; joints with the same channels are turned at once."""
    hierarchy = document.hierarchy
    first = np.array(hierarchy.first_columns)
    turned = rotation.identity(document.frames, len(hierarchy))
    for channels, joints in hierarchy.groups:
        places = [place for place, name in enumerate(channels) if name in ROTATIONS]
        if not places:
            continue
        angles = np.zeros((document.frames, len(joints), 3))
        columns = first[joints][:, None] + places
        angles[..., : len(places)] = np.radians(document.values[:, columns])
        # a joint that lacks an axis never turns about it: that axis goes last, with angle 0
        axes = "".join(channels[place][0] for place in places)
        order = axes + "".join(axis for axis in "XYZ" if axis not in axes)
        turned[:, joints] = rotation.from_euler(angles, order)
    return turned


def _stated_places(path: Path, document: Document) -> dict[int, np.ndarray]:
    """Joint -> ``(frames, 3)`` its position channels, for the joints that have them."""
    hierarchy, stated = document.hierarchy, {}
    for channels, joints in hierarchy.groups:
        places = [channels.index(name) for name in POSITIONS if name in channels]
        if len(places) not in (0, 3):
            raise FileError(
                path,
                f"joint {hierarchy.names[joints[0]]!r} has {len(places)} position channels, not 3 or none",
            )
        for joint in joints if places else ():
            stated[joint] = document.values[:, [hierarchy.first_columns[joint] + place for place in places]]
    return dict(sorted(stated.items()))


# ------------------------------------------------------------------------------------- the dummy root
def _is_dummy(hierarchy: Hierarchy, joint: int, stated: dict[int, np.ndarray], turned: np.ndarray) -> bool:
    """True for a joint with one child alone, which moves by itself or is named as the hips.

    Folding is exact for any joint with one child; this only decides which joint should be the root.
    """
    if hierarchy.children(joint) != [joint + 1] or any(s.parent == joint for s in hierarchy.end_sites):
        return False
    if joint + 1 in stated:
        still = not np.any(stated.get(joint, 0.0)) and not np.any(turned[:, joint, 1:])
        size = reach(_skeleton(hierarchy, joint + 1, (), 1.0))
        return still or bool(np.ptp(stated[joint + 1], axis=0).max() > _STILL * size)
    name, below = hierarchy.names[joint].lower(), hierarchy.names[joint + 1].lower()
    return any(word in name for word in DUMMY_NAMES) and any(word in below for word in HIP_NAMES)


def _carried(
    document: Document, stated: dict[int, np.ndarray], turned: np.ndarray, first: int, *, relative: bool
) -> tuple[np.ndarray, np.ndarray]:
    """World places ``(frames, 3)`` and orientations ``(frames, 4)`` of the joint ``first``."""
    for joint in range(first + 1):
        offset = np.broadcast_to(document.hierarchy.offsets[joint], (document.frames, 3))
        step = stated[joint] + offset * relative if joint in stated else offset
        if joint == 0:
            place, heading = step, turned[:, 0]
        else:
            place = place + rotation.rotate(heading, step)
            heading = rotation.multiply(heading, turned[:, joint])
    return place, heading


# ----------------------------------------------------------------------------------------- the bones
def _replaced_offsets(
    path: Path,
    hierarchy: Hierarchy,
    stated: dict[int, np.ndarray],
    first: int,
    notes: list[str],
    *,
    inner: bool,
) -> tuple[tuple[tuple[int, Offset], ...], dict[int, np.ndarray]]:
    """(joint, offset) where position channels below the root differ from the file's OFFSET, and
    ``(frames, 3)`` the places in their parents' frames of joints that move there.

    Raises FileError when a joint moves so and ``inner`` is not asked for: bones have one length.
    """
    joints = [joint for joint in stated if joint > first]
    if not joints:
        return (), {}
    size = reach(_skeleton(hierarchy, first, (), 1.0))
    lows = np.array([stated[joint].min(axis=0) for joint in joints])
    highs = np.array([stated[joint].max(axis=0) for joint in joints])
    middle, spread = (lows + highs) / 2, (highs - lows).max(axis=1)
    moves = spread > _STILL * size
    if moves.any() and not inner:
        worst = hierarchy.names[joints[int(np.argmax(spread))]]
        raise FileError(
            path,
            f"joint {worst!r} moves by up to {spread.max():.4g} against its parent, which only the root "
            "may do: export the file without position channels below the root",
        )
    offsets = hierarchy.offsets[joints]
    if np.abs(middle).sum() < np.abs(middle - offsets).sum():
        middle = middle + offsets  # these channels are relative to OFFSET
        stated = {joint: stated[joint] + hierarchy.offsets[joint] for joint in joints}
    moved = {joint: stated[joint] for joint, each in zip(joints, moves, strict=True) if each}
    if moved:
        positions = np.stack(list(moved.values()), axis=1)
        middle[moves] = resting(offsets[moves], positions, _SAME * size)
    away = np.abs(middle - offsets).max(axis=1)
    replaced = tuple(
        (joint, (x, y, z))
        for joint, (x, y, z), by in zip(joints, middle.tolist(), away, strict=True)
        if by > _SAME * size
    )
    constant = spread[~moves].max(initial=0.0)
    note = f"{len(joints)} joints below the root have position channels, "
    note += f"{int(moves.sum())} of them moving, " if moved else ""
    note += f"constant within {constant:.2g}" if not moves.all() else "none constant"
    if replaced:
        note += f"; {len(replaced)} of them replace OFFSETs that differ by up to {away.max():.4g}"
    notes.append(note)
    return replaced, moved


@lru_cache(maxsize=256)
def _skeleton(
    hierarchy: Hierarchy, first: int, replaced: tuple[tuple[int, Offset], ...], scale: float
) -> Skeleton:
    """The joints from ``first`` on, its offset gathered over those above it; clips of a body share it."""
    offsets = np.array(hierarchy.offsets)
    for joint, offset in replaced:
        offsets[joint] = offset
    offsets[first] = offsets[: first + 1].sum(axis=0)
    sites = []
    for site in hierarchy.end_sites:
        x, y, z = site.offset
        sites.append(EndSite(site.parent - first, (x * scale, y * scale, z * scale)))
    parents = np.maximum(hierarchy.parents[first:] - first, -1)
    names = unique_names(hierarchy.names)[first:]
    return Skeleton(names, parents, offsets[first:] * scale, tuple(sites))


_HIP_HEIGHT = (0.3, 1.5)
"""A standing root's height as a share of its reach: what tells a rest height from an arbitrary place."""
_SUNK = (0.75, 1.25)
"""Bodies that climb or hang are up to 0.6 of that height below 0 in files with absolute places."""
_FRAMES = 32


def is_relative(
    skeleton: Skeleton, rotations: np.ndarray, absolute: np.ndarray, relative: np.ndarray
) -> bool:
    """True where the root's places ``(frames, 3)`` are those of ``relative`` and not those of ``absolute``.

    Both are in use, and no file says which. The wrong one puts the body about a hip height too low or too
    high, since they differ by the root's OFFSET. They are relative when the absolute reading leaves the
    lowest joint one OFFSET height below 0 (0.75 to 1.25 of it, median over frames), and the OFFSET is a hip
    height and not the first frame.
    """
    size = reach(skeleton)
    shift = (relative - absolute).mean(axis=0)
    if not size or np.abs(absolute[0] - shift).max() <= 1e-4 * size:
        return False
    axes = (axis for axis in (1, 2) if _HIP_HEIGHT[0] * size <= shift[axis] <= _HIP_HEIGHT[1] * size)
    if (up := next(axes, None)) is None or np.median(absolute[:, up]) > 0.5 * shift[up]:
        return False  # no body reaches that far below its root; this spares most files the kinematics
    some = np.unique(np.linspace(0, len(absolute) - 1, _FRAMES).astype(int))
    joints, _ = kinematics.forward(skeleton, rotations[some], absolute[some])
    sunk = -np.median(joints[:, :, up].min(axis=1)) / shift[up]
    return bool(_SUNK[0] <= sunk <= _SUNK[1])
