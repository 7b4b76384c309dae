"""A body: a skeleton, what its joints mean, and the pose it is compared in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import hinges, kinematics
from retarget_bench.motion.alignment import reference_pose
from retarget_bench.motion.measures import Measures, measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion, Positions
from retarget_bench.motion.roles import find as find_roles
from retarget_bench.motion.roles import stands_on_four
from retarget_bench.motion.skeleton import Skeleton, frozen


@dataclass(frozen=True, eq=False)
class Character:
    """A body that can perform motions.

    name:           as the data set calls it.
    skeleton:       joints and rest offsets.
    structure:      the topology id that the data set declares for the *native* skeleton; it decides
                    whether a pair is intra- or cross-structural.
    roles:          per joint its anatomical role or None (see ``roles.py``).
    reference_pose: ``(joints, 4)`` local rotations that bring the rest pose into the common reference
                    pose (T-pose, Y up, facing +Z; see ``alignment.py``).
    measures:       sizes of the native body, kept when joints are left out.
    skin:           makes the body's mesh, when it is first asked for; None: it has none.
    hinges:         axes in the reference pose that this rig's limbs bend about, by role, where its motion
                    shows others than bodies in general (``hinges.measured``).
    whole:          the body of which this one has some joints, by the same names; None: it is whole.

    Raises SkeletonError when these do not fit the skeleton. Use ``Character.of`` to find them.
    """

    name: str
    skeleton: Skeleton
    structure: str
    roles: tuple[str | None, ...]
    reference_pose: np.ndarray
    measures: Measures
    skin: Callable[[], Mesh] | None = field(default=None, repr=False)
    whole: Character | None = field(default=None, repr=False)
    hinges: Mapping[str, np.ndarray] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reference_pose", frozen(self.reference_pose, np.float64))
        joints = len(self.skeleton)
        if len(self.roles) != joints or self.reference_pose.shape != (joints, 4):
            raise SkeletonError(
                f"{self.name}: {joints} joints need as many roles and a reference pose of "
                f"({joints}, 4); got {len(self.roles)} and {self.reference_pose.shape}"
            )

    @classmethod
    def of(
        cls,
        name: str,
        skeleton: Skeleton,
        *,
        structure: str | None = None,
        roles: Sequence[str | None] | None = None,
        sample: np.ndarray | None = None,
    ) -> Character:
        """A character with whatever is not given found from its skeleton.

        roles:  found from joint names when None (``roles.find``).
        sample: ``(frames, joints, 4)`` local rotations of any motion of this body. They tell how bones
                are twisted where the rest pose alone cannot (every bone along one axis), and about which
                axes elbows bend.
        """
        found = tuple(roles) if roles is not None else find_roles(skeleton)
        pose = reference_pose(skeleton, found, sample)
        return cls(
            name=name,
            skeleton=skeleton,
            structure=structure or skeleton.topology_id,
            roles=found,
            reference_pose=pose,
            measures=measure(skeleton, found, pose),
            hinges={} if sample is None else hinges.measured(skeleton, found, pose, sample),
        )

    @cached_property
    def joint_of(self) -> Mapping[str, int]:
        """Role -> joint index."""
        return {role: joint for joint, role in enumerate(self.roles) if role is not None}

    def joints(self, roles: Sequence[str]) -> list[int]:
        """The joints that have one of these roles, in the order asked, missing ones left out."""
        return [self.joint_of[role] for role in roles if role in self.joint_of]

    def hinge(self, role: str) -> np.ndarray | None:
        """``(3,)`` the axis in the reference pose of a turn that folds the limb which begins with the joint
        of this role; None for joints that begin no limb."""
        return self.hinges.get(role, hinges.HINGES.get(role))

    @cached_property
    def mesh(self) -> Mesh | None:
        """The body's surface on its own skeleton, None if the data set gives none."""
        return None if self.skin is None else self.skin()

    @property
    def height(self) -> float:
        """Metres: the height that errors are divided by (``Measures.height``)."""
        return self.measures.height

    @cached_property
    def reference_globals(self) -> np.ndarray:
        """``(joints, 4)`` world orientations of the joints in the reference pose."""
        turned = kinematics.forward(self.skeleton, self.reference_pose, np.zeros(3))[1]
        return frozen(turned, np.float64)

    @cached_property
    def four_legged(self) -> bool:
        """Whether the body stands on four legs in its reference pose; fore legs have the roles of arms."""
        places = kinematics.forward(self.skeleton, self.reference_pose, np.zeros(3))[0]
        return stands_on_four(places, self.roles)

    def motion(self, rotations: np.ndarray, root: np.ndarray, fps: float) -> Motion:
        """A motion of this character: local rotations ``(frames, joints, 4)``, root ``(frames, 3)``."""
        return Motion(self, rotations, root, fps)

    def positions(self, positions: np.ndarray, fps: float) -> Positions:
        """A motion of this character known by joint positions ``(frames, joints, 3)`` only."""
        return Positions(self, positions, fps)
