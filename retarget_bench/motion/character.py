"""Characters (a skeleton, what its joints mean, the pose it is compared in) and their motions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Self, cast

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import hinges, kinematics, rotation
from retarget_bench.motion.joint_regression import joint_positions
from retarget_bench.motion.measures import Measures, measure
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.reference_pose import reference_pose
from retarget_bench.motion.role_finding import find as find_roles
from retarget_bench.motion.roles import stands_on_four
from retarget_bench.motion.skeleton import Skeleton, frozen

_THICKEST = 0.05
"""Body heights: a rest pose higher above y = 0 than any sole is thick does not stand on it."""


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
    guessed:        roles that neither a file nor the names of joints say (``role_structure.py``).

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
    guessed: tuple[str, ...] = ()

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

        roles:  by joint names when None (``role_finding.find``).
        sample: ``(frames, joints, 4)`` local rotations of any motion of this body. They show how bones are
                twisted where the rest pose does not (all along one axis), and how elbows bend.
        """
        joint_roles = tuple(roles) if roles is not None else find_roles(skeleton)
        pose = reference_pose(skeleton, joint_roles, sample)
        return cls(
            name=name,
            skeleton=skeleton,
            structure=structure or skeleton.topology_id,
            roles=joint_roles,
            reference_pose=pose,
            measures=measure(skeleton, joint_roles, pose),
            hinges={} if sample is None else hinges.measured(skeleton, joint_roles, pose, sample),
        )

    @cached_property
    def joint_of(self) -> Mapping[str, int]:
        """Role -> joint index."""
        return {role: joint for joint, role in enumerate(self.roles) if role is not None}

    def joints(self, roles: Sequence[str]) -> list[int]:
        """The joints that have one of these roles, in their order, missing ones left out."""
        return [self.joint_of[role] for role in roles if role in self.joint_of]

    def hinge(self, role: str) -> np.ndarray | None:
        """``(3,)`` the axis, in the reference pose, of a turn that folds the limb from this role on."""
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
    def reference_places(self) -> np.ndarray:
        """``(joints, 3)`` metres: the reference pose with its root at the origin."""
        places = kinematics.forward(self.skeleton, self.reference_pose, np.zeros(3))[0]
        return frozen(places, np.float64)

    @cached_property
    def standing_places(self) -> np.ndarray:
        """``(joints, 3)`` metres: the reference pose with its soles on y = 0 and the hips above the origin.

        Soles thicker than the lowest joint of the feet is high are known where the file's rest pose stands
        on y = 0.
        """
        hips, height = self.joint_of.get("hips", 0), self.measures.hip_height
        sole = self.measures.root_offset - height
        if hips != 0 or not 0.0 < sole < _THICKEST * self.height:
            sole = 0.0
        places = self.reference_places - self.reference_places[hips]
        return frozen(places + np.array([0.0, height + sole, 0.0]), np.float64)

    @cached_property
    def four_legged(self) -> bool:
        """True where the reference pose stands on four legs; fore legs have the roles of arms."""
        return stands_on_four(self.reference_places, self.roles)

    def motion(self, rotations: np.ndarray, root: np.ndarray, fps: float) -> Motion:
        """A motion of this character: local rotations ``(frames, joints, 4)``, root ``(frames, 3)``."""
        return Motion(self, rotations, root, fps)

    def positions(self, positions: np.ndarray, fps: float) -> Positions:
        """A motion of this character known by joint positions ``(frames, joints, 3)`` only."""
        return Positions(self, positions, fps)

    def surface(self, vertices: np.ndarray, fps: float) -> Surface:
        """A motion of this character known by its mesh's vertices ``(frames, V, 3)`` only."""
        return Surface(self, vertices, fps)


class _Frames:
    """Frames of a character at a rate: ``Motion``, ``Positions`` and ``Surface``."""

    character: Character
    fps: float
    arrays: ClassVar[tuple[str, ...]]
    """The fields with a row for every frame."""
    kind: ClassVar[str]
    """The kind of the motion, in the word of cards."""

    def _check(self, **shapes: tuple[int, ...]) -> None:
        """Make the arrays double precision; raises SkeletonError where fps or a shape is wrong."""
        _check_fps(self.fps)
        for name, shape in shapes.items():
            array = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, array)
            if array.shape != (expected := (*getattr(self, self.arrays[0]).shape[:1], *shape)):
                raise SkeletonError(
                    f"{self.character.name} has {len(self.skeleton)} joints: {name} must be {expected}, "
                    f"got {array.shape}"
                )

    @property
    def skeleton(self) -> Skeleton:
        return self.character.skeleton

    @property
    def frames(self) -> int:
        return len(getattr(self, self.arrays[0]))

    def copy(self) -> Self:
        """The same motion with arrays of its own."""
        return self._changed(np.array)

    def at(self, frames: slice | np.ndarray) -> Self:
        """The chosen frames, at the same rate."""
        return self._changed(lambda values: values[frames])

    def resample(self, fps: float) -> Self:
        """The same motion at another rate: slerp for rotations, linear for places.

        An integer ratio keeps every n-th frame untouched; the first frame always stays.
        """
        if (step := _whole_step(self.fps, fps)) is not None:
            return self._changed(lambda values: values[::step], fps)
        return self.between(*_grid(self.frames, self.fps, fps), fps)

    def between(self, low: np.ndarray, share: np.ndarray, fps: float) -> Self:
        """Frames at ``share`` ``(n,)`` of the way from the frames ``low`` ``(n,)`` to the next ones."""
        return self._changed(lambda values: interpolated(values, low, share, values.shape[2:] == (4,)), fps)

    def _changed(self, change: Callable[[np.ndarray], np.ndarray], fps: float | None = None) -> Self:
        arrays = {name: change(getattr(self, name)) for name in self.arrays}
        return cast(Self, replace(cast(Any, self), **arrays, fps=self.fps if fps is None else fps))


@dataclass(frozen=True, eq=False)
class Motion(_Frames):
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
    arrays = ("rotations", "root")
    kind = "motion"

    def __post_init__(self) -> None:
        self._check(rotations=(len(self.skeleton), 4), root=(3,))

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


@dataclass(frozen=True, eq=False)
class Positions(_Frames):
    """A motion known by joint positions only.

    positions: ``(frames, joints, 3)`` metres in the world (Y up), joints in skeleton order.
    """

    character: Character
    positions: np.ndarray
    fps: float
    arrays = ("positions",)
    kind = "positions"

    def __post_init__(self) -> None:
        self._check(positions=(len(self.skeleton), 3))

    @property
    def root(self) -> np.ndarray:
        """``(frames, 3)`` metres: the root joint."""
        return self.positions[:, 0]


@dataclass(frozen=True, eq=False)
class Surface(_Frames):
    """A motion known by the vertices of the character's mesh only.

    vertices: ``(frames, V, 3)`` metres in the world (Y up), in the order of the mesh.
    notes:    sentences on how it was made, such as another pose of the mesh.

    Raises SkeletonError where the character has no mesh, or one of another number of vertices.
    """

    character: Character
    vertices: np.ndarray
    fps: float
    notes: tuple[str, ...] = ()
    arrays = ("vertices",)
    kind = "surface"

    def __post_init__(self) -> None:
        if self.character.mesh is None:
            raise SkeletonError(f"{self.character.name} has no mesh to give the vertices of")
        self._check(vertices=self.character.mesh.vertices.shape)

    @cached_property
    def positions(self) -> np.ndarray:
        """``(frames, joints, 3)`` metres: the joints under this surface (``joint_regression.py``)."""
        mesh = cast(Mesh, self.character.mesh)
        return joint_positions(mesh, self.skeleton, self.vertices)

    @property
    def root(self) -> np.ndarray:
        """``(frames, 3)`` metres: the root joint."""
        return self.positions[:, 0]


Prediction = Motion | Positions | Surface
"""An answer of a method, or a source."""


def interpolated(
    values: np.ndarray, low: np.ndarray, share: np.ndarray, turning: bool = False
) -> np.ndarray:
    """Values ``(frames, ...)`` at ``share`` ``(n,)`` of the way from the frames ``low`` ``(n,)`` to the
    next
    ones: quaternions ``(frames, joints, 4)`` with ``turning`` by slerp, all else linear."""
    if not share.any():
        return values[low]
    high = np.minimum(low + 1, len(values) - 1)
    if turning:
        return rotation.slerp(values[low], values[high], share[:, None])
    way = share.reshape(-1, *[1] * (values.ndim - 1))
    blend: np.ndarray = values[low] + way * (values[high] - values[low])
    return blend


def resampled_frames(frames: int, fps: float, new_fps: float) -> int:
    """The number of frames that ``resample`` makes of so many."""
    if step := _whole_step(fps, new_fps):
        return len(range(0, frames, step))
    return len(_grid(frames, fps, new_fps)[0]) if frames else 0


def _check_fps(fps: float) -> None:
    if not (np.isfinite(fps) and fps > 0):
        raise SkeletonError(f"frames per second must be positive, got {fps}")


def _whole_step(fps: float, new_fps: float) -> int | None:
    """The step in frames when the rates differ by a whole factor, else None.

    Frame times in files are rounded (0.016667, .0083333), so 0.1 % counts as whole.
    """
    _check_fps(new_fps)
    step = round(fps / new_fps)
    return step if step >= 1 and abs(fps / new_fps - step) < 1e-3 * step else None


def _grid(frames: int, fps: float, new_fps: float) -> tuple[np.ndarray, np.ndarray]:
    """For every new frame: the old frame at or before it, and the share of the way to the next."""
    length = int(np.floor((frames - 1) * new_fps / fps + 1e-6)) + 1
    at = np.arange(length) * (fps / new_fps)
    low = np.minimum(np.floor(at + 1e-9).astype(int), frames - 1)
    return low, np.clip(at - low, 0.0, 1.0)
