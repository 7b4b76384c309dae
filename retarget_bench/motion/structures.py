"""Reduced bodies: the joint sets that papers and metrics work on.

- ``body22``: the 22 joints of NKN, PMnet and R2ET, for any skeleton with roles, in their order.
  Where a body has more spine or neck joints, three and one of them are kept; where it lacks one of those,
  a collar bone or a toe, the set is smaller.
- ``S23``, ``S28``: the two Mixamo structures of SAN and PAN, by joint names, whatever the prefix. SAN's
  code re-roots S23 at ``Pelvis`` with ``Hips`` below it; here ``Hips`` stays the root and ``Pelvis`` its
  child, as in the files: same joints, same places.

Joints that are left out are taken to stay at rest relative to their parents; kept joints then keep their
places.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.role_aliases import strip_prefix
from retarget_bench.motion.roles import ancestors, chain
from retarget_bench.motion.skeleton import EndSite, Skeleton
from retarget_bench.motion.transfer import shares

_LEG = ("UpLeg", "Leg", "Foot", "ToeBase")
_ARM = ("Shoulder", "Arm", "ForeArm", "Hand")


def _sided(*parts: str) -> tuple[str, ...]:
    return tuple(f"{side}{part}" for side in ("Left", "Right") for part in parts)


S23 = ("Hips", "Pelvis", *_sided(*_LEG), "Spine", "Spine1", "Spine2", "Neck", "Head", *_sided(*_ARM))
S28 = (
    "Hips",
    *_sided(*_LEG, "Toe_End"),
    *("Spine", "Spine1", "Spine1_split", "Spine2", "Neck", "Head", "HeadTop_End"),
    *_sided("Shoulder", "Shoulder_split", "Arm", "ForeArm", "Hand"),
)
BODY22 = (
    *("hips", "spine_1", "spine_2", "spine_3", "neck", "head"),
    *(f"{side}_{part}" for side in ("left", "right") for part in ("up_leg", "leg", "foot", "toe")),
    *(f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "arm", "forearm", "hand")),
)
"""Roles, in the order of NKN's 22 joints."""
STRUCTURES = ("body22", "S23", "S28")

_NEEDED = tuple(
    role
    for role in BODY22
    if not role.startswith(("spine", "neck")) and not role.endswith(("shoulder", "toe"))
)
_TIPS = {"head_top": "head", "left_toe_end": "left_toe", "right_toe_end": "right_toe"}


@dataclass(frozen=True, eq=False)
class Reduction:
    """From a body to one with fewer joints.

    source:    the body as it is.
    character: the reduced one, with the source's name, structure, measures and reference pose.
    joints:    the source joint of every reduced joint.
    """

    name: str
    source: Character
    character: Character
    joints: tuple[int, ...]

    def apply(self, motion: Motion) -> Motion:
        """The motion on the kept joints: their world orientations and the place of the first are kept.

        Raises SkeletonError when the motion is of another skeleton.
        """
        if not motion.skeleton.same_as(self.source.skeleton):
            raise SkeletonError(
                f"a reduction of {self.source.name} to {self.name} cannot be applied to a motion of "
                f"{motion.character.name}: the skeletons differ"
            )
        joints = list(self.joints)
        if joints[0] == 0:
            root, turned = motion.root, self._locals(motion.rotations)
        else:
            root = motion.positions[:, joints[0]]
            turned = kinematics.local_from_global(
                self.character.skeleton, motion.global_rotations[:, joints]
            )
        return self.character.motion(turned, root, motion.fps)

    def _locals(self, rotations: np.ndarray) -> np.ndarray:
        """Local rotations; untouched where no joint was left out above, so that nothing is rounded."""
        local, parents = np.array(rotations[:, list(self.joints)]), self.source.skeleton.parents.tolist()
        for index, joint in enumerate(self.joints):
            above = parents[joint]
            while above >= 0 and above not in self.joints:
                local[:, index] = rotation.multiply(rotations[:, above], local[:, index])
                above = parents[above]
        return local


def reduce(character: Character, name: str) -> Reduction:
    """The reduction of a body to ``body22``, ``S23`` or ``S28``.

    Raises NotSupported for other names, SkeletonError when the body lacks a joint that it needs.
    """
    if name == "body22":
        joints, roles = _body22(character)
    elif name in ("S23", "S28"):
        joints, roles = _by_names(character, name, S23 if name == "S23" else S28)
    else:
        raise NotSupported(f"no structure {name!r}; structures are {', '.join(STRUCTURES)}")
    skeleton = _reduced(character, joints)
    pose = kinematics.local_from_global(skeleton, character.reference_globals[joints])
    reduced = replace(
        character, skeleton=skeleton, roles=tuple(roles), reference_pose=pose, skin=None, whole=None
    )
    return Reduction(name, character, reduced, tuple(joints))


def _body22(character: Character) -> tuple[list[int], list[str | None]]:
    """Joints and roles in the order of the 22."""
    if missing := [role for role in _NEEDED if role not in character.joint_of]:
        raise SkeletonError(
            f"{character.name} cannot be reduced to body22: no joint is known as {', '.join(missing)}; "
            "name them in a roles file"
        )
    joint_of = dict(character.joint_of)
    spine, neck = chain(character.roles, "spine"), chain(character.roles, "neck")
    if len(spine) > 3:
        spine = [spine[k] for k in shares(3, len(spine))]
    joint_of |= {f"spine_{rank}": joint for rank, joint in enumerate(spine, 1)}
    if neck:
        joint_of["neck"] = neck[0]
    roles = [role for role in BODY22 if role in joint_of]
    return [joint_of[role] for role in roles], list(roles)


def _by_names(character: Character, name: str, names: Sequence[str]) -> tuple[list[int], list[str | None]]:
    """Joints and roles of one of SAN's structures."""
    bare = {
        strip_prefix(joint): index for index, joint in reversed(list(enumerate(character.skeleton.names)))
    }
    if missing := [joint for joint in names if joint not in bare]:
        raise SkeletonError(
            f"{character.name} has no {', '.join(missing)}, which {name} needs; body22 takes any skeleton "
            "with roles"
        )
    joints = [bare[joint] for joint in names]
    return joints, [character.roles[joint] for joint in joints]


def _reduced(character: Character, joints: list[int]) -> Skeleton:
    """The skeleton of the kept joints at rest; left-out ends of head and toes become tips."""
    full, place = character.skeleton, character.skeleton.rest_positions
    parents = [_parent(full, joints, joint) for joint in joints]
    offsets = np.stack(
        [
            full.offsets[j]
            if full.parents[j] == (joints[p] if p >= 0 else -1)
            else place[j] - (place[joints[p]] if p >= 0 else 0.0)
            for j, p in zip(joints, parents, strict=True)
        ]
    )
    tips = [
        EndSite(joints.index(site.parent), site.offset) for site in full.end_sites if site.parent in joints
    ]
    for role, below in _TIPS.items():
        joint, end = character.joint_of.get(below), character.joint_of.get(role)
        if joint in joints and end is not None and end not in joints:
            x, y, z = (place[end] - place[joint]).tolist()
            tips.append(EndSite(joints.index(joint), (x, y, z)))
    return Skeleton(tuple(full.names[joint] for joint in joints), np.array(parents), offsets, tuple(tips))


def _parent(skeleton: Skeleton, joints: Sequence[int], joint: int) -> int:
    """The index in ``joints``, those that are kept, of the nearest one above; -1 for the first."""
    above = next((j for j in ancestors(skeleton, joint) if j in joints), None)
    if above is None and joint != joints[0]:
        raise SkeletonError(
            f"{skeleton.names[joint]!r} does not hang below {skeleton.names[joints[0]]!r}, the root of the "
            "reduced body"
        )
    return -1 if above is None else joints.index(above)
