"""From an ASF file, and an AMC file of it, to a skeleton and its motion.

A bone has a frame of its own, C (its ``axis``), in which its numbers M are meant: against its parent it
turns by C M C^-1. So every joint, standing where its bone begins, has a frame that is parallel to the world
in the rest pose, and bones that begin at the root stand in one place with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np

from retarget_bench.errors import FileError, some
from retarget_bench.motion import rotation
from retarget_bench.motion.file_kinds import TEXT, check_kind
from retarget_bench.motion.files.acclaim.content import (
    LENGTH,
    ROTATIONS,
    TRANSLATIONS,
    Body,
    Bone,
    Values,
    read_motion,
    read_skeleton,
)
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
    Raises FileError, with the line, for what cannot be read.
    """
    kind = check_kind(path, "AMC", "ASF", text=True)
    if kind.name == "ASF" or (kind is TEXT and _named_asf(path)):
        notes = ["a skeleton alone: one frame, the pose at rest"]
        return _recorded(read_skeleton(path), {}, 1.0, notes)
    asf = beside(path) if skeleton is None else Path(skeleton)
    body = read_skeleton(asf)
    widths = {bone.name: len(bone.dof) for bone in body.bones if bone.dof}
    values, radians = read_motion(path, widths, asf)
    notes = [f"bones from {asf.name}"]
    if missing := [name for name in widths if name not in values]:
        notes.append(f"the motion has no numbers for {some(missing)}: they stay as at rest")
    return _recorded(body, values, radians or body.radians, notes)


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
        there = [each for each in sorted(path.parent.iterdir()) if _named_asf(each)]
    except OSError:
        there = []
    in_other_capitals = (each for stem in stems for each in there if each.stem.lower() == stem.lower())
    if found := next(in_other_capitals, there[0] if len(there) == 1 else None):
        return found
    names = " or ".join(dict.fromkeys(f"{stem}{_SUFFIX}" for stem in (stems[0], stems[-1])))
    held = f"beside it are {', '.join(each.name for each in there)}" if there else "none is there"
    raise FileError(path, f"needs its skeleton, {names} in its folder ({held}): say skeleton=FILE")


def needed(path: Path) -> tuple[Path, ...]:
    """The files that the motion of an AMC file depends on, as far as they are there."""
    try:
        return () if _named_asf(path) else (beside(path),)
    except FileError:
        return ()


def _named_asf(path: Path) -> bool:
    return path.suffix.lower() == _SUFFIX and not path.name.startswith(".")


# ------------------------------------------------------------------------------------------- the motion
def _recorded(body: Body, values: Values, radians: float, notes: list[str]) -> Recording:
    """The body in motion, or at rest without ``values``. radians: of one unit of their angles."""
    frames = max(map(len, values.values()), default=1)
    skeleton = _at_rest(body)
    rotations, root = (
        rotation.identity(frames, len(skeleton)),
        np.repeat(body.position[None], frames, axis=0),
    )
    rotations[:, 0] = _turn(body.bones[0])
    steps: dict[int, np.ndarray] = {}
    for joint, bone in enumerate(body.bones):
        if (numbers := values.get(bone.name)) is not None:
            frame, turned = _turn(bone)[None], _turned(numbers, bone.dof, radians)
            shift = _columns(numbers, bone.dof, TRANSLATIONS)
            if joint == 0:
                root += shift
                rotations[:, 0] = rotation.multiply(turned, frame)
                continue
            rotations[:, joint] = rotation.multiply(
                rotation.multiply(frame, turned), rotation.conjugate(frame)
            )
            if set(bone.dof) & set(TRANSLATIONS):
                steps[joint] = skeleton.offsets[joint] + rotation.rotate(frame, shift)
        above = body.bones[bone.parent]
        if joint and LENGTH in above.dof and above.name in values:
            longer = values[above.name][:, [above.dof.index(LENGTH)]]
            steps[joint] = steps.get(joint, skeleton.offsets[joint]) + longer * above.direction
    skeleton, places = _with_steps(skeleton, steps, frames)
    if body.left_out:
        notes.append(f"bones that hang on nothing are left out: {', '.join(body.left_out[:6])}")
    if body.bones[0].axis.any() or body.position.any():
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


def _at_rest(body: Body) -> Skeleton:
    """The joints, each where its bone begins: at the end of its parent's."""
    parents = np.array([bone.parent for bone in body.bones])
    tips = np.array([bone.direction * bone.length for bone in body.bones])
    offsets = tips[parents]
    offsets[0] = body.position
    leaves = sorted({*range(1, len(parents))} - {*parents.tolist()})
    sites = tuple(EndSite(joint, tuple(tips[joint].tolist())) for joint in leaves)
    return Skeleton(unique_names(tuple(bone.name for bone in body.bones)), parents, offsets, sites)


def _with_steps(
    skeleton: Skeleton, steps: Mapping[int, np.ndarray], frames: int
) -> tuple[Skeleton, np.ndarray | None]:
    """The joints where they mostly are, and ``(frames, joints, 3)`` places where they truly move.

    steps: joint -> ``(frames, 3)`` its place in its parent's frame, where bones shift or stretch.
    """
    size, moved = reach(skeleton), list(steps)
    offsets, places = np.array(skeleton.offsets), np.repeat(skeleton.offsets[None], frames, axis=0)
    for joint, positions in steps.items():
        places[:, joint] = positions
    if any(np.ptp(positions, axis=0).max() > _STILL * size for positions in steps.values()):
        offsets[moved] = resting(offsets[moved], places[:, moved], _SAME * size)
        return replace(skeleton, offsets=offsets), places
    offsets[moved] = np.median(places[:, moved], axis=0)
    return replace(skeleton, offsets=offsets), None


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
    return _fixed(radians * _columns(values, dof, order), "".join(name[1].upper() for name in order))


def _turn(bone: Bone) -> np.ndarray:
    """``(4,)`` of the frame of a bone, or of the root at rest."""
    return _fixed(bone.axis[["XYZ".index(axis) for axis in bone.axis_order]], bone.axis_order)


def _fixed(angles: np.ndarray, order: str) -> np.ndarray:
    """Turns by ``angles`` ``(..., 3)`` about the fixed axes of ``order``, the first before the others."""
    return rotation.from_euler(np.ascontiguousarray(angles[..., ::-1]), order[::-1])
