"""A body as learned methods see it: some of its joints, at rest in the common reference pose.

In this form every body rests in the same T-pose with all joint frames along the world's axes, whatever its
file's rest pose: local rotations mean the same on all bodies, and bones are what differs between them.

Some methods learn what a skeleton is from a *neutral pose*, standing with the arms along the body (HuMoT,
section 3.2, whose authors set one by hand for every data set). Roles and the reference pose give one for
any body.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation, transfer
from retarget_bench.motion.body import DOWN, PosedBody
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.roles import SIDES, ancestors
from retarget_bench.motion.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Aligned:
    """Some joints of a body, the hips first, parents before children.

    character: the body itself. joints: indices of its joints; all of them hang below the first.

    Raises SkeletonError where the first joint is not the hips, or a joint does not hang below it.
    """

    character: Character
    joints: tuple[int, ...]

    def __post_init__(self) -> None:
        if not self.joints or self.joints[0] != self.character.joint_of.get("hips", -1):
            raise SkeletonError(f"{self.character.name}: the first joint that is seen has to be its hips")
        self.skeleton  # noqa: B018 - raises where joints do not hang together

    @cached_property
    def skeleton(self) -> Skeleton:
        """The joints seen, with the bones of the reference pose as offsets; the hips are the root."""
        places = self.character.reference_places[list(self.joints)]
        parents = [self._parent(joint) for joint in self.joints]
        offsets = places - places[parents]
        offsets[0] = 0.0
        names = self.character.skeleton.names
        return Skeleton(tuple(names[joint] for joint in self.joints), np.array(parents), offsets)

    @property
    def offsets(self) -> np.ndarray:
        """``(joints, 3)`` metres: the bone to each joint in the reference pose; zero for the hips."""
        return self.skeleton.offsets

    @property
    def roles(self) -> tuple[str | None, ...]:
        return tuple(self.character.roles[joint] for joint in self.joints)

    def see(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Local rotations ``(frames, joints, 4)`` of the joints in this form, signs continuous along time,
        and ``(frames, 3)`` metres where the hips are."""
        turned = transfer.relative(motion)[:, list(self.joints)]
        local = rotation.normalise(kinematics.local_from_global(self.skeleton, turned))
        return rotation.continuous(local), transfer.hips(motion)

    def motion(self, rotations: np.ndarray, hips: np.ndarray, fps: float) -> Motion:
        """The whole body's motion; joints that are not seen keep the reference pose relative to their
        parent, so that the seen ones are where forward kinematics in this form has them.

        rotations: ``(frames, joints, 4)`` unit, in this form. hips: ``(frames, 3)`` metres.
        """
        _, global_rotations = kinematics.forward(self.skeleton, rotations, np.zeros((len(rotations), 3)))
        parents = self.character.skeleton.parents.tolist()
        turned = rotation.identity(len(rotations), len(parents))
        above = set(ancestors(self.character.skeleton, self.joints[0]))
        for joint, parent in enumerate(parents):
            if joint in above:
                turned[:, joint] = global_rotations[:, 0]
            elif joint in self._rank:
                turned[:, joint] = global_rotations[:, self._rank[joint]]
            elif parent >= 0:
                turned[:, joint] = turned[:, parent]
        local = transfer.from_relative(self.character, turned)
        return self.character.motion(local, transfer.root_from_hips(self.character, local, hips), fps)

    @cached_property
    def _rank(self) -> dict[int, int]:
        return {joint: rank for rank, joint in enumerate(self.joints)}

    def _parent(self, joint: int) -> int:
        """The index in ``joints`` of the nearest one above; -1 for the hips."""
        if joint == self.joints[0]:
            return -1
        for above in ancestors(self.character.skeleton, joint):
            if above in self._rank:
                return self._rank[above]
        name = self.character.skeleton.names[joint]
        raise SkeletonError(f"{self.character.name}: joint {name!r} does not hang below the hips")


def neutral_pose(character: Character) -> np.ndarray:
    """``(joints, 4)`` local rotations: the reference pose with both arms hanging straight down.

    Hands and what has no role keep to their parents. On four legs it is the reference pose.
    """
    pose = np.array(character.reference_pose)
    if character.four_legged:
        return pose
    body = PosedBody(character.skeleton, character.roles)
    for side in SIDES:
        joints = body.joints(*(f"{side}_{part}" for part in ("arm", "forearm", "hand")))
        for joint, child in pairwise(joints):
            body.swing(pose, joint, child, DOWN)
    return pose


def template(character: Character) -> np.ndarray:
    """``(joints, 3)`` metres: the neutral pose with the hips at the origin, Y up, facing +Z, left is +X.

    Of a part of a body, the whole body's at its joints. Raises SkeletonError where there are no hips.
    """
    if character.whole is not None:
        names = character.whole.skeleton.names
        return template(character.whole)[[names.index(name) for name in character.skeleton.names]]
    hips = character.joint_of.get("hips", -1)
    if hips < 0:
        raise SkeletonError(f"no joint of {character.name} is known as hips; name it in a roles file")
    places = kinematics.forward(character.skeleton, neutral_pose(character), np.zeros(3))[0]
    return np.asarray(places - places[hips])
