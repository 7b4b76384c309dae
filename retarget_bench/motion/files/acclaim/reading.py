"""From an ASF file, and an AMC file of it, to a skeleton and its motion.

A bone ``b`` has a frame of its own, ``C`` (its ``axis``), in which its numbers are meant: against its
parent it turns by ``C M C^-1``. So every joint, standing where its bone begins, has a frame that is
parallel to the world in the rest pose, and bones that begin at the root stand in one place with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion import rotation
from retarget_bench.motion.file_kinds import TEXT, check_kind
from retarget_bench.motion.files.acclaim.skeleton import (
    LENGTH,
    ROTATIONS,
    TRANSLATIONS,
    AcclaimSkeleton,
    Bone,
    read_skeleton,
)
from retarget_bench.motion.files.acclaim.values import AcclaimMotion, read_values
from retarget_bench.motion.recording import Recording, reach, resting, unique_names
from retarget_bench.motion.skeleton import EndSite, Skeleton

FPS = 120.0
"""Frames per second of most of the files there are; the format cannot say."""
_CMU = 0.45
"""``length`` of the files of CMU, whose unit is 1 / 0.45 inches."""
_STILL, _SAME = 1e-3, 1e-5
"""Shares of the body's reach up to which a joint's place in its parent's frame counts as constant, and up
to which it counts as that at rest."""
_SUFFIX = ".asf"


def read(path: Path, skeleton: str | PathLike[str] | None = None) -> Recording:
    """The motion of an AMC file on its skeleton, or the one pose of an ASF file, in the skeleton's unit.

    skeleton: the ASF file of an AMC file; None: the one beside it (``beside``).
    Raises FileError for what cannot be read.
    """
    if _is_skeleton(path):
        body, motion, notes = read_skeleton(path), None, ["a skeleton alone: one frame, the pose at rest"]
    else:
        asf = beside(path) if skeleton is None else Path(skeleton)
        body = read_skeleton(asf)
        motion = read_values(path, _widths(body), asf)
        notes = [f"bones from {asf.name}", *_without_values(body, motion)]
    if body.left_out:
        notes.append(f"bones that hang on nothing are left out: {', '.join(body.left_out[:6])}")
    return _recorded(body, motion, notes)


def beside(path: Path) -> Path:
    """The ASF file that lies beside an AMC file: of its name, or of the SUBJECT of SUBJECT_TAKE.amc, or the
    only one there. Raises FileError where none is found."""
    stems = [path.stem]
    while "_" in stems[-1]:
        stems.append(stems[-1].rpartition("_")[0])
    for stem in stems:
        if (same_name := path.with_name(stem + _SUFFIX)).is_file():
            return same_name
    try:
        candidates = {each.stem.lower(): each for each in sorted(path.parent.iterdir()) if _named_asf(each)}
    except OSError:
        candidates = {}
    for stem in stems:  # in other capitals
        if stem.lower() in candidates:
            return candidates[stem.lower()]
    if len(candidates) == 1:
        return next(iter(candidates.values()))
    there = (
        f"beside it are {', '.join(each.name for each in candidates.values())}"
        if candidates
        else "none is there"
    )
    names = " or ".join(dict.fromkeys(f"{stem}{_SUFFIX}" for stem in (stems[0], stems[-1])))
    raise FileError(
        path,
        f"needs its skeleton, {names} in its folder ({there}): say skeleton=FILE",
    )


def needed(path: Path) -> tuple[Path, ...]:
    """The files that the motion of an AMC file depends on, as far as they are there."""
    if _named_asf(path):
        return ()
    try:
        return (beside(path),)
    except FileError:
        return ()


def _named_asf(path: Path) -> bool:
    return path.suffix.lower() == _SUFFIX and not path.name.startswith(".")


def _is_skeleton(path: Path) -> bool:
    """By what the file is, and where this says nothing by its name."""
    kind = check_kind(path, "AMC", "ASF", text=True)
    return _named_asf(path) if kind is TEXT else kind.name == "ASF"


def _widths(body: AcclaimSkeleton) -> dict[str, int]:
    """Numbers in a frame, by bone."""
    return {"root": len(body.order), **{bone.name: len(bone.dof) for bone in body.bones if bone.dof}}


def _without_values(body: AcclaimSkeleton, motion: AcclaimMotion) -> list[str]:
    missing = [name for name in _widths(body) if name not in motion.values]
    if not missing:
        return []
    more = f" and {len(missing) - 6} more" if len(missing) > 6 else ""
    return [f"the motion has no numbers for {', '.join(missing[:6])}{more}: they stay as at rest"]


# ------------------------------------------------------------------------------------------- the motion
def _recorded(body: AcclaimSkeleton, motion: AcclaimMotion | None, notes: list[str]) -> Recording:
    frames = 1 if motion is None else motion.frames
    stated = motion.radians if motion is not None else None
    angles = body.radians if stated is None else stated
    rotations = rotation.identity(frames, len(body.bones) + 1)
    offsets, steps = _rest(body), dict[int, np.ndarray]()
    root = np.repeat(np.array([body.position]), frames, axis=0)
    rotations[:, 0] = _turn(np.array(body.orientation), body.orientation_order)
    if motion is not None:
        if "root" in motion.values:
            values = motion.values["root"]
            root = root + _columns(values, body.order, TRANSLATIONS)
            turned = _turned(values, body.order, angles)
            rotations[:, 0] = rotation.multiply(turned, rotations[:, 0])
        for joint, bone in enumerate(body.bones, 1):
            if bone.name in motion.values:
                values = motion.values[bone.name]
                rotations[:, joint] = _in_frame(bone, _turned(values, bone.dof, angles))
        steps = _steps(body, motion, offsets)
    skeleton, places = _skeleton(body, offsets, steps, frames)
    if any(body.orientation) or any(body.position):
        notes.append("the root is offset by its own position and orientation, about fixed axes")
    return Recording(
        skeleton,
        rotation.continuous(rotations),
        root,
        FPS,
        tuple(notes),
        unit="cmu" if abs(body.length - _CMU) < 1e-6 else "",
        rate_stated=False,
        places=places,
    )


def _rest(body: AcclaimSkeleton) -> np.ndarray:
    """``(joints, 3)`` where bones begin, from where their parents' begin; the root where it is put."""
    ends = np.array([bone.direction for bone in body.bones]) * [[bone.length] for bone in body.bones]
    offsets = np.zeros((len(body.bones) + 1, 3))
    offsets[0] = body.position
    for joint, parent in enumerate(body.parents, 1):
        if parent >= 0:
            offsets[joint] = ends[parent]
    return offsets


def _steps(body: AcclaimSkeleton, motion: AcclaimMotion, offsets: np.ndarray) -> dict[int, np.ndarray]:
    """Joint -> ``(frames, 3)`` its place in its parent's frame, where bones shift or stretch."""
    steps: dict[int, np.ndarray] = {}
    for joint, (bone, parent) in enumerate(zip(body.bones, body.parents, strict=True), 1):
        values = motion.values.get(bone.name)
        if values is not None and set(bone.dof) & set(TRANSLATIONS):
            frame = _turn(np.array(bone.axis), bone.axis_order)
            shift = rotation.rotate(frame[None], _columns(values, bone.dof, TRANSLATIONS))
            steps[joint] = steps.get(joint, offsets[joint]) + shift
        above = body.bones[parent] if parent >= 0 else None
        if above is not None and LENGTH in above.dof and above.name in motion.values:
            longer = motion.values[above.name][:, [above.dof.index(LENGTH)]]
            steps[joint] = steps.get(joint, offsets[joint]) + longer * np.array(above.direction)
    return steps


def _skeleton(
    body: AcclaimSkeleton, offsets: np.ndarray, steps: dict[int, np.ndarray], frames: int
) -> tuple[Skeleton, np.ndarray | None]:
    """The joints, and ``(frames, joints, 3)`` their places where they move against their parents."""
    names = unique_names(("root", *(bone.name for bone in body.bones)))
    parents = np.array([-1, *(parent + 1 for parent in body.parents)])
    leaves = sorted(set(range(1, len(names))) - set(parents.tolist()))
    sites = []
    for joint in leaves:
        bone = body.bones[joint - 1]
        x, y, z = (part * bone.length for part in bone.direction)
        sites.append(EndSite(joint, (x, y, z)))
    skeleton = Skeleton(names, parents, offsets, tuple(sites))
    size = reach(skeleton)
    if not any(np.ptp(positions, axis=0).max() > _STILL * size for positions in steps.values()):
        rigid = np.array(offsets)
        for joint, positions in steps.items():
            rigid[joint] = np.median(positions, axis=0)
        return Skeleton(names, parents, rigid, tuple(sites)), None
    places = np.repeat(offsets[None], frames, axis=0)
    for joint, positions in steps.items():
        places[:, joint] = positions
    moved = list(steps)
    rest_offsets = np.array(offsets)
    rest_offsets[moved] = resting(offsets[moved], places[:, moved], _SAME * size)
    return Skeleton(names, parents, rest_offsets, tuple(sites)), places


def _columns(values: np.ndarray, dof: Sequence[str], axes: Sequence[str]) -> np.ndarray:
    """``(frames, 3)`` the numbers of these degrees of freedom, 0 where there are none."""
    out = np.zeros((len(values), 3))
    for axis, name in enumerate(axes):
        if name in dof:
            out[:, axis] = values[:, dof.index(name)]
    return out


def _turned(values: np.ndarray, dof: Sequence[str], radians: float) -> np.ndarray:
    """``(frames, 4)`` turns about fixed axes, in the order in which ``dof`` names them."""
    order = [name for name in dof if name in ROTATIONS]
    order += [name for name in ROTATIONS if name not in order]
    angles = radians * _columns(values, dof, order)
    return _fixed(angles, "".join(name[1].upper() for name in order))


def _turn(angles: np.ndarray, order: str) -> np.ndarray:
    """``(4,)`` of angles of a line ``axis``: its numbers are those of X, Y and Z, its word the order."""
    return _fixed(angles[["XYZ".index(axis) for axis in order]], order)


def _fixed(angles: np.ndarray, order: str) -> np.ndarray:
    """Turns by ``angles`` ``(..., 3)`` about the fixed axes of ``order``, the first before the others."""
    return rotation.from_euler(np.ascontiguousarray(angles[..., ::-1]), order[::-1])


def _in_frame(bone: Bone, turned: np.ndarray) -> np.ndarray:
    """``C M C^-1``."""
    frame = _turn(np.array(bone.axis), bone.axis_order)[None]
    return rotation.multiply(rotation.multiply(frame, turned), rotation.conjugate(frame))
