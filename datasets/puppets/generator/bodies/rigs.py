"""Characters from bodies: rest poses as their authors drew them, and motions in their rotations.

Five ways of drawing a rest pose: ``t_pose`` (every joint's axes along the world's), ``a_pose`` (likewise,
with arms 45 degrees down), ``arms_down`` (80 degrees), ``z_up`` (a T-pose drawn with Z up, as modelling
software has it: the root's own rotation brings it upright) and ``along_x`` (every bone along its parent's X
axis, as motion-capture software writes skeletons).
"""

from functools import cache, partial

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import measure
from retarget_bench.motion.skeleton import EndSite, Skeleton

from ...contract import Surface
from ..conventions import SIDES, sign
from ..matrices import about, unit
from .clothes import clothed
from .meshes import mesh
from .structures import Body

RESTS = ("t_pose", "a_pose", "arms_down", "z_up", "along_x")
_DROP = {"a_pose": np.radians(45.0), "arms_down": np.radians(80.0)}
"""How far below the horizontal the arms are drawn."""
_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Axes of a joint drawn with X to its left, Z up, facing -Y; columns are its axes in the world."""


@cache
def axes(body: Body) -> np.ndarray:
    """``(joints, 3, 3)``: each joint's own axes in the world while the body stands in the T-pose."""
    joints = body.structure.joints
    if body.rest == "along_x":
        return _along_bones(body)
    oriented = np.tile(_Z_UP if body.rest == "z_up" else np.eye(3), (joints, 1, 1))
    if body.rest in _DROP:
        for side in SIDES:
            raised = about(2, np.array(sign(side) * _DROP[body.rest]))
            for part in ("arm", "forearm", "hand"):
                oriented[body.part[f"{side}_{part}"]] = raised
    return oriented


def _along_bones(body: Body) -> np.ndarray:
    """Joints that never turn have their parent's axes, so that their rotation is the identity for good."""
    structure, oriented = body.structure, np.empty((body.structure.joints, 3, 3))
    for joint, part in enumerate(structure.parts[: structure.joints]):
        silent = part in structure.silent
        oriented[joint] = oriented[structure.parents[joint]] if silent else _along_bone(body, part)
    return oriented


def _along_bone(body: Body, part: str) -> np.ndarray:
    """Axes with X along the bone that leaves a joint, and Z to the left (for arms: up)."""
    bone = unit(_leaving(body, part))
    side = np.array([0.0, 1.0, 0.0]) if abs(bone[0]) > 0.5 else np.array([1.0, 0.0, 0.0])
    side = unit(side - bone * float(side @ bone))
    return np.stack([bone, np.cross(side, bone), side], axis=-1)


def _leaving(body: Body, part: str) -> np.ndarray:
    """The bone that leaves a joint: of a joint with several the one up the trunk, of the last the tip's."""
    structure, joint = body.structure, body.part[part]
    children = [child for child in range(structure.joints) if structure.parents[child] == joint]
    upward = [child for child in children if structure.parts[child] in ("spine_1", "neck", "head")]
    if children:
        return body.offsets[(upward or children)[0]]
    return body.tips.get(part, body.offsets[joint])


def character(body: Body, surface: Surface = "bare") -> Character:
    """The body as a character; its roles and reference pose are known, not guessed from names and rest.

    surface: its surface, ``bare`` skin or ``clothed`` (``clothes.py``).
    """
    own, structure = axes(body), body.structure
    joints = structure.joints
    parents = np.array(structure.parents[:joints])
    up = np.where(parents < 0, 0, parents)
    offsets = np.einsum("jba,jb->ja", own[up], body.offsets[:joints])
    offsets[0] = body.offsets[0]
    sites = tuple(
        EndSite(joint, tuple((own[joint].T @ body.tips.get(part, np.zeros(3))).tolist()))
        for joint, part in enumerate(structure.parts[:joints])
        if joint not in parents
    )
    skeleton = Skeleton(structure.names, parents, offsets, sites)
    pose = kinematics.local_from_global(skeleton, rotation.from_matrix(own)[None])[0]
    sizes = measure(skeleton, structure.roles, pose)
    skin = partial(clothed if surface == "clothed" else mesh, body, pose)
    return Character(body.name, skeleton, structure.name, structure.roles, pose, sizes, skin)


def rotations(orientations: np.ndarray, body: Body, of: Character) -> np.ndarray:
    """Local rotations ``(frames, joints, 4)`` of the character, from orientations ``(frames, parts, 3, 3)``
    of its body against the T-pose."""
    world = rotation.from_matrix(orientations[:, : body.structure.joints] @ axes(body))
    local = rotation.normalise(kinematics.local_from_global(of.skeleton, world))
    return rotation.continuous(local)
