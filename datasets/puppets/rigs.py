"""How bodies become characters: rest poses as their authors drew them, and motions in their rotations.

Three ways of drawing a rest pose: ``t_pose`` (every joint's axes along the world's), ``a_pose`` (likewise,
with arms 45 degrees down) and ``along_x`` (every bone along its parent's X axis, as motion-capture
software writes skeletons).
"""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import measure
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import find
from retarget_bench.motion.skeleton import EndSite, Skeleton

from .bodies import Body
from .limbs import about, unit
from .score import FPS, SIDES, sign
from .solver import Solution


def axes(body: Body) -> np.ndarray:
    """``(joints, 3, 3)``: each joint's own axes in the world while the body stands in the T-pose."""
    if body.rest == "along_x":
        return np.stack([_along_bone(body, part) for part in body.structure.parts])
    turned = np.tile(np.eye(3), (len(body.structure.parts), 1, 1))
    if body.rest == "a_pose":
        for side in SIDES:
            raised = about(2, np.array(sign(side) * np.pi / 4.0))
            for part in ("arm", "forearm", "hand"):
                turned[body.part[f"{side}_{part}"]] = raised
    return turned


def _along_bone(body: Body, part: str) -> np.ndarray:
    """Axes with X along the bone that leaves a joint, and Z to the left (for arms: up)."""
    bone = unit(_leaving(body, part))
    side = np.array([0.0, 1.0, 0.0]) if abs(bone[0]) > 0.5 else np.array([1.0, 0.0, 0.0])
    return np.stack([bone, np.cross(side, bone), side], axis=-1)


def _leaving(body: Body, part: str) -> np.ndarray:
    """The bone that leaves a joint: of a joint with several the one up the trunk, of the last the tip's."""
    structure, joint = body.structure, body.part[part]
    children = [child for child, parent in enumerate(structure.parents) if parent == joint]
    upward = [child for child in children if structure.parts[child] in ("spine_1", "neck")]
    if children:
        return body.offsets[(upward or children)[0]]
    return body.tips.get(part, body.offsets[joint])


def character(body: Body) -> Character:
    """The body as a character; its reference pose is known exactly, and not guessed from the rest pose."""
    own = axes(body)
    parents = np.array(body.structure.parents)
    up = np.where(parents < 0, 0, parents)
    offsets = np.einsum("jba,jb->ja", own[up], body.offsets)
    offsets[0] = body.offsets[0]
    sites = tuple(
        EndSite(joint, tuple((own[joint].T @ body.tips.get(part, np.zeros(3))).tolist()))
        for part, joint in body.part.items()
        if joint not in body.structure.parents
    )
    skeleton = Skeleton(body.structure.names, parents, offsets, sites)
    roles = find(skeleton)
    pose = kinematics.local_from_global(skeleton, rotation.from_matrix(own)[None])[0]
    sizes = measure(skeleton, roles, pose)
    return Character(body.name, skeleton, body.structure.name, roles, pose, sizes)


def rotations(solution: Solution, body: Body, of: Character) -> np.ndarray:
    """Local rotations ``(frames, joints, 4)`` of the character for a solution of its body."""
    world = rotation.from_matrix(solution.turned @ axes(body))
    local = rotation.normalise(kinematics.local_from_global(of.skeleton, world))
    return rotation.continuous(local)


def motion(local: np.ndarray, root: np.ndarray, of: Character) -> Motion:
    return of.motion(local, root, FPS)
