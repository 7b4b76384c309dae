"""Characters (a skeleton, what its joints mean, the pose it is compared in) and their motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import hinges, kinematics, rotation
from retarget_bench.motion.measures import Measures, measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.reference_pose import reference_pose
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
                    pose (T-pose, Y up, facing +Z; see ``reference_pose.py``).
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


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of a character, as rotations.

    rotations: ``(frames, joints, 4)`` local unit quaternions, w first.
    root:      ``(frames, 3)`` metres, the root joint's place in the world (Y up).
    fps:       frames per second.

    Raises SkeletonError when the shapes do not fit the character's skeleton or fps is not positive.
    """

    character: Character
    rotations: np.ndarray
    root: np.ndarray
    fps: float

    def __post_init__(self) -> None:
        rotations = np.asarray(self.rotations, dtype=np.float64)
        root = np.asarray(self.root, dtype=np.float64)
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "root", root)
        joints = len(self.character.skeleton)
        if rotations.ndim != 3 or rotations.shape[1:] != (joints, 4):
            raise SkeletonError(
                f"{self.character.name} has {joints} joints: rotations must be "
                f"(frames, {joints}, 4), got {rotations.shape}"
            )
        if root.shape != (rotations.shape[0], 3):
            raise SkeletonError(
                f"{rotations.shape[0]} frames of rotations need a root of "
                f"({rotations.shape[0]}, 3), got {root.shape}"
            )
        _check_fps(self.fps)

    @property
    def skeleton(self) -> Skeleton:
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return self.rotations.shape[0]

    @cached_property
    def _world(self) -> tuple[np.ndarray, np.ndarray]:
        return kinematics.forward(self.skeleton, self.rotations, self.root)

    @property
    def positions(self) -> np.ndarray:
        """``(frames, joints, 3)`` metres in the world; computed once."""
        return self._world[0]

    @property
    def global_rotations(self) -> np.ndarray:
        """``(frames, joints, 4)`` world orientations of the joints; computed once."""
        return self._world[1]

    def copy(self) -> Motion:
        """The same motion with arrays of its own."""
        return replace(self, rotations=np.array(self.rotations), root=np.array(self.root))

    def at(self, frames: slice | np.ndarray) -> Motion:
        """The chosen frames, at the same rate."""
        return replace(self, rotations=self.rotations[frames], root=self.root[frames])

    def resample(self, fps: float) -> Motion:
        """The same motion at another rate: slerp for rotations, linear for the root.

        An integer ratio keeps every n-th frame untouched; the first frame always stays.
        """
        if (frames := _whole_step(self.fps, fps)) is not None:
            return replace(self, rotations=self.rotations[::frames], root=self.root[::frames], fps=fps)
        low, share = _grid(self.frames, self.fps, fps)
        high = np.minimum(low + 1, self.frames - 1)
        turned = rotation.slerp(
            self.rotations[low],
            self.rotations[high],
            share[:, None],  # share: (frames', 1)
        )
        root = self.root[low] + share[:, None] * (self.root[high] - self.root[low])
        return Motion(self.character, turned, root, fps)


@dataclass(frozen=True, eq=False)
class Positions:
    """A motion known by joint positions only.

    positions: ``(frames, joints, 3)`` metres in the world (Y up), joints in skeleton order.
    """

    character: Character
    positions: np.ndarray
    fps: float

    def __post_init__(self) -> None:
        positions = np.asarray(self.positions, dtype=np.float64)
        object.__setattr__(self, "positions", positions)
        joints = len(self.character.skeleton)
        if positions.ndim != 3 or positions.shape[1:] != (joints, 3):
            raise SkeletonError(
                f"{self.character.name} has {joints} joints: positions must be "
                f"(frames, {joints}, 3), got {positions.shape}"
            )
        _check_fps(self.fps)

    @property
    def skeleton(self) -> Skeleton:
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return self.positions.shape[0]

    @property
    def root(self) -> np.ndarray:
        """``(frames, 3)`` metres: the root joint."""
        return self.positions[:, 0]

    def copy(self) -> Positions:
        """The same motion with an array of its own."""
        return replace(self, positions=np.array(self.positions))

    def at(self, frames: slice | np.ndarray) -> Positions:
        """The chosen frames, at the same rate."""
        return replace(self, positions=self.positions[frames])

    def resample(self, fps: float) -> Positions:
        """The same motion at another rate, linear in every coordinate."""
        if (frames := _whole_step(self.fps, fps)) is not None:
            return replace(self, positions=self.positions[::frames], fps=fps)
        low, share = _grid(self.frames, self.fps, fps)
        high = np.minimum(low + 1, self.frames - 1)
        first, second = self.positions[low], self.positions[high]
        return replace(self, positions=first + share[:, None, None] * (second - first), fps=fps)


def resampled_frames(frames: int, fps: float, wanted: float) -> int:
    """The number of frames that ``resample`` makes of so many."""
    if step := _whole_step(fps, wanted):
        return len(range(0, frames, step))
    return len(_grid(frames, fps, wanted)[0]) if frames else 0


def _check_fps(fps: float) -> None:
    if not (np.isfinite(fps) and fps > 0):
        raise SkeletonError(f"frames per second must be positive, got {fps}")


def _whole_step(fps: float, wanted: float) -> int | None:
    """The step in frames when the rates differ by a whole factor, else None.

    Frame times in files are rounded (0.016667, .0083333), so 0.1 % counts as whole.
    """
    _check_fps(wanted)
    step = round(fps / wanted)
    return step if step >= 1 and abs(fps / wanted - step) < 1e-3 * step else None


def _grid(frames: int, fps: float, wanted: float) -> tuple[np.ndarray, np.ndarray]:
    """For every new frame: the old frame at or before it, and the share of the way to the next."""
    length = int(np.floor((frames - 1) * wanted / fps + 1e-6)) + 1
    at = np.arange(length) * (fps / wanted)
    low = np.minimum(np.floor(at + 1e-9).astype(int), frames - 1)
    return low, np.clip(at - low, 0.0, 1.0)


Prediction = Motion | Positions
"""An answer of a method, or a source."""
