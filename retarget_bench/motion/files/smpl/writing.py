"""Motions as AMASS archives: ``poses``, ``trans``, ``betas``, ``gender`` and the rate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.files.gltf.writing import check_frames
from retarget_bench.motion.files.smpl import amass, skeletons
from retarget_bench.motion.files.smpl.skeletons import BODY, FAMILIES, SMPL, SMPLH, SMPLX
from retarget_bench.motion.importer import Imported, as_stated
from retarget_bench.motion.roles import is_finger
from retarget_bench.motion.up_axis import UP_AXES

_UP = "z"
"""The up axis of AMASS."""
_PARTS = {"root_orient": 1, "pose_body": 21, "pose_jaw": 1, "pose_eye": 2, "pose_hand": 30}
"""Parts of the poses of SMPL-X, and of how many joints they are."""
_BETAS = 16
"""As many as most of its releases have."""


def write_into(path: Path, motion: Motion, like: Imported) -> tuple[str, ...]:
    """Write a motion of the body of ``like``, which was read from an archive, with its betas and gender and
    in its axes; returns what could not be kept. Raises FileError."""
    source = amass.parameters(like.findings.path, like.reading.rate)
    moved = replace(motion, root=motion.root - motion.skeleton.offsets[0])
    _save(path, as_stated(moved, like), source.betas, source.gender, source.model, like.findings.up)
    return ()


def write(path: Path, motion: Motion) -> tuple[str, ...]:
    """Write a motion of a body that has the joints of the family, by name or by role, in metres and Z up as
    AMASS has it; returns what could not be kept. Raises FileError where its joints are others."""
    skeleton = motion.skeleton
    by_name = next((each for each in FAMILIES if each.joints == skeleton.names), None)
    if by_name is not None and skeleton.parents.tolist() == list(by_name.parents):
        family, turned = by_name, motion
    else:
        fingers = any(map(is_finger, motion.character.roles))
        family = SMPLH if fingers else SMPL
        turned = _by_role(path, motion, Character.of(family.name, skeletons.average(family)))
    if family is BODY:
        family = SMPLH
    missing = len(family) - len(turned.skeleton)
    still = rotation.identity(motion.frames, missing)
    back = rotation.conjugate(rotation.from_rotation_vector(np.array(UP_AXES[_UP])))
    rotations = np.concatenate([turned.rotations, still], axis=1)
    rotations[:, 0] = rotation.multiply(back[None], rotations[:, 0])
    stated = Character.of(family.name, skeletons.average(family)).motion(
        rotations, rotation.rotate(back[None], turned.root), motion.fps
    )
    _save(path, stated, np.zeros(_BETAS), "neutral", family.word, _UP)
    return ("AMASS states no bones: betas are 0, and trans is the place of the pelvis",)


def _by_role(path: Path, motion: Motion, body: Character) -> Motion:
    """The pose on the average skeleton, relative to the common reference pose, the hips where they are."""
    needed = [role for role in body.roles if role is not None and not is_finger(role)]
    own = motion.character.joint_of
    lacks = [role for role in needed if role not in own]
    chains = ("spine", "neck")
    more = [role for role in own if role.startswith(chains) and role not in needed]
    if lacks or more:
        difference = f"lacks {', '.join(lacks[:4])}" if lacks else f"also has {', '.join(more[:4])}"
        raise FileError(
            path,
            "not written: an AMASS file states the joints of SMPL bodies alone, and "
            f"{motion.character.name} {difference}; choose .bvh or .glb, or a target that is an AMASS file",
        )
    return transfer.carry(motion, body, "none")


def _save(path: Path, motion: Motion, betas: np.ndarray, gender: str, model: str, up: str) -> None:
    """The archive of a motion in its file's axes, whose root is at ``trans``."""
    check_frames(path, motion)
    turns = rotation.in_blocks(rotation.to_rotation_vector, motion.rotations)
    arrays: dict[str, Any] = {
        "poses": turns.reshape(motion.frames, -1),
        "trans": motion.root,
        "betas": betas,
        "gender": np.array(gender),
        "mocap_framerate": np.array(motion.fps),
        "mocap_frame_rate": np.array(motion.fps),
        "up_axis": np.array(up),
    }
    if model:
        arrays["surface_model_type"] = np.array(model)
    if len(motion.skeleton) == len(SMPLX):  # whose releases have the parts as well
        ends = np.cumsum([each * 3 for each in _PARTS.values()])[:-1]
        arrays |= dict(zip(_PARTS, np.split(arrays["poses"], ends, axis=1), strict=True))
    with atomic(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)
