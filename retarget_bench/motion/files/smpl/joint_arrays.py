"""Motions known by joint positions: arrays ``(frames, joints, 3)``, and the features of HumanML3D.

Features are decoded by their definition (Guo et al. 2022, section 3, and its published code): of 263
numbers a frame, the first four say how the root moves, the next 63 where the other joints are. The rest
(rotations, velocities, contacts) repeats these and is not read; the rotations of published features are
known not to fit the joints.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.files.smpl import average
from retarget_bench.motion.files.smpl.arrays import shape_text
from retarget_bench.motion.files.smpl.families import (
    ABOVE,
    BODY,
    BY_JOINTS,
    FAMILIES,
    H36M,
    SMPL,
    SMPLH,
    SMPLX,
    Family,
    of_joints,
)
from retarget_bench.motion.recording import Recording, of_positions

Joints = str | Sequence[str]
"""A skeleton's name, or names of joints."""
FAMILIES_BY_NAME = {"body": BODY, "smpl": SMPL, "smplh": SMPLH, "smplx": SMPLX, "h36m": H36M}
"""Skeletons whose joints are known by a name."""
FEATURES = 263
RATE = 20.0
"""Frames per second of HumanML3D."""
_FARTHEST = 1e9
_UNEVEN = 0.2
"""Share of its length by which a bone may vary in decoded features, most of the time."""


def recorded(path: Path, array: np.ndarray, rate: float | None = None, joints: Joints = ()) -> Recording:
    """The motion of an array of finite numbers, in metres; its skeleton has the bones that the positions
    show.

    path: what errors call it. rate: frames per second, where they are told: the array does not say them.
    joints: see ``family_of``; none: what its shape says. Raises FileError for other arrays.
    """
    if not len(array.shape) or not len(array):
        raise FileError(path, "has no frames")
    if np.abs(array).max(initial=0.0) > _FARTHEST:
        raise FileError(path, f"holds numbers above {_FARTHEST:g}: it is damaged")
    features = array.ndim == 2 and array.shape[1] == FEATURES
    family, positions = (BODY, from_features(array)) if features else (_family(path, array, joints), array)
    skeleton = average.fitted_to(family, positions)
    if family not in FAMILIES:  # without a collar bone SMPL's left_shoulder would be taken for one
        skeleton = replace(skeleton, names=tuple(_roles()[name] for name in family.joints))
    if float(np.abs(skeleton.offsets).max()) < 1e-9:
        raise FileError(path, "has all joints in one place: it holds no body")
    doubts = []
    if features and _varies(positions, family) > _UNEVEN:
        doubts.append(
            "bones change their length: features that were normalised have to be multiplied by Std and "
            "moved by Mean first"
        )
    if rate is None:
        doubts.append(
            f"the rate is not stated: {RATE:g} frames per second as in HumanML3D; say rate=30 for Motion-X"
        )
    what = (
        f"features of HumanML3D, {FEATURES} a frame" if features else f"positions of {len(family)} joints"
    )
    return of_positions(
        skeleton,
        positions,
        rate or RATE,
        notes=(f"{what}, in the order of {family.name}",),
        doubts=tuple(doubts),
        unit="m",
        up="y" if features else "",
        rate_stated=False,
    )


def _family(path: Path, array: np.ndarray, joints: Joints) -> Family:
    family = family_of(joints) if joints else BY_JOINTS.get(array.shape[1] if array.ndim == 3 else 0)
    if family and array.ndim == 3 and array.shape[1:] == (len(family), 3):
        return family
    if family and joints:
        expected = f"positions of these joints are (frames, {len(family)}, 3)"
    else:
        shapes = ", ".join(f"(frames, {each}, 3)" for each in BY_JOINTS)
        expected = (
            f"joint positions of the SMPL family are {shapes}, and features of HumanML3D "
            f"(frames, {FEATURES})"
        )
    raise FileError(path, f"is of shape {shape_text(array.shape)}; {expected}")


def family_of(joints: Joints) -> Family:
    """A skeleton by its name, or of joints by their names, all roles or all SMPL's. Raises BenchError for
    others."""
    if isinstance(joints, str):
        if (family := FAMILIES_BY_NAME.get(joints.casefold().replace("-", ""))) is None:
            raise BenchError(f"no skeleton is known as {joints!r}; there are {', '.join(FAMILIES_BY_NAME)}")
        return family
    roles = {role: name for name, role in _roles().items()}
    by_name = roles if "hips" in joints else {name: name for name in ABOVE}
    if unknown := [each for each in joints if each not in by_name]:
        near = difflib.get_close_matches(unknown[0], by_name, 3) or list(by_name)[:3]
        raise BenchError(
            f"{unknown[0]!r} is no joint that is known; joints are named by their roles (hips, ...) or as "
            f"in SMPL (pelvis, ...), such as {', '.join(near)}"
        )
    names = [by_name[each] for each in joints]
    if names.count("pelvis") != 1 or len(set(names)) < len(names):
        raise BenchError("joints: each is named once, and the hips (in SMPL pelvis) are among them")
    same = (family for family in FAMILIES if family.joints == tuple(names))
    return next(same, of_joints("the joints named", names))


def _roles() -> dict[str, str]:
    """Joint of the SMPL family -> its role; one without a role -> a name that is none."""
    body = Character.of("body", average.skeleton(SMPLX))
    pairs = zip(SMPLX.joints, body.roles, strict=True)
    return {name: f"{name}_end" for name in ABOVE} | {name: role or name for name, role in pairs}


def from_features(features: np.ndarray) -> np.ndarray:
    """``(frames, 22, 3)`` metres, Y up, of features ``(frames, 263)``; the body begins over the origin and
    faces +Z there.

    A frame's first number is minus half the angle, radians, by which the body turns about Y to the next
    frame; the next two are the root's step to that frame, seen from there, and the fourth is its height.
    The other joints are seen from the root's place on the floor, facing +Z.
    """
    frames = len(features)
    half = np.zeros(frames)
    half[1:] = np.cumsum(features[:-1, 0])
    back = rotation.about(np.array([0.0, -1.0, 0.0]), 2.0 * half)  # from facing +Z to the world
    steps = np.zeros((frames, 3))
    steps[1:, [0, 2]] = features[:-1, 1:3]
    root = np.cumsum(rotation.rotate(back, steps), axis=0)
    root[:, 1] = features[:, 3]
    positions = np.empty((frames, len(BODY), 3))
    positions[:, 0] = root
    others = features[:, 4 : 4 + 3 * (len(BODY) - 1)].reshape(frames, -1, 3)
    positions[:, 1:] = rotation.rotate(back[:, None], others)
    positions[:, 1:, [0, 2]] += root[:, None, [0, 2]]
    return positions


def _varies(positions: np.ndarray, family: Family) -> float:
    """The largest share of its length by which a bone varies in the middle half of all frames."""
    parents = list(family.parents)
    lengths = np.linalg.norm(positions - positions[:, parents], axis=2)[:, 1:]
    low, middle, high = np.quantile(lengths, [0.25, 0.5, 0.75], axis=0)
    return float(((high - low) / np.maximum(middle, 1e-9)).max())
