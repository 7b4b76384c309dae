"""A body's skin: a triangle mesh that follows the joints by linear blend skinning."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.skeleton import Skeleton

_BLOCK = 64
"""Frames skinned at a time: the vertices of so many stay in the processor's cache."""


class MovingJoints(Protocol):
    """The part of a motion that a mesh needs."""

    @property
    def skeleton(self) -> Skeleton: ...
    @property
    def frames(self) -> int: ...
    @property
    def positions(self) -> np.ndarray: ...
    @property
    def global_rotations(self) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Mesh:
    """The surface of a body, and which joints it follows.

    vertices: ``(vertices, 3)`` metres, with the root joint at its rest offset.
    faces:    ``(faces, 3)`` vertex indices, counter-clockwise seen from outside.
    weights:  ``(vertices, joints)`` shares of the joints in each vertex, summing to 1.
    pose:     ``(joints, 4)`` local rotations of the joints for which the vertices are given; None: the rest
              pose of the skeleton.

    Raises SkeletonError when the shapes do not fit each other, or a number is not finite.
    """

    vertices: np.ndarray
    faces: np.ndarray
    weights: np.ndarray
    pose: np.ndarray | None = None

    def __post_init__(self) -> None:
        vertices, faces, weights = self.vertices.shape, self.faces.shape, self.weights.shape
        sound = vertices[1:] == (3,) and faces[1:] == (3,) and weights[:1] == vertices[:1]
        if not sound or len(weights) != 2:
            raise SkeletonError(
                f"a mesh needs vertices (V, 3), faces (F, 3) and weights (V, J); got {vertices}, {faces} "
                f"and {weights}"
            )
        if len(self.faces) and not 0 <= int(self.faces.min()) <= int(self.faces.max()) < vertices[0]:
            raise SkeletonError(f"a mesh of {vertices[0]} vertices has faces with other indices")
        if self.pose is not None and self.pose.shape != (weights[1], 4):
            raise SkeletonError(f"a mesh on {weights[1]} joints has a pose of shape {self.pose.shape}")
        for name in ("vertices", "weights", "pose"):
            if (array := getattr(self, name)) is not None and not np.isfinite(array).all():
                raise SkeletonError(f"a mesh has {name} that are not finite")

    def scaled(self, by: float) -> "Mesh":
        """The same mesh, so many times as large."""
        return replace(self, vertices=self.vertices * by)

    def skinned(self, motion: MovingJoints) -> np.ndarray:
        """``(frames, vertices, 3)`` metres: the vertices during a motion (linear blend skinning, Magnenat-
        Thalmann et al. 1988). Raises SkeletonError when the motion has another number of joints.
        """
        skeleton = motion.skeleton
        if len(skeleton) != self.weights.shape[1]:
            raise SkeletonError(
                f"a mesh on {self.weights.shape[1]} joints cannot follow a body of {len(skeleton)} joints"
            )
        places, turned = self.bound(skeleton)
        vertices = np.empty((motion.frames, *self.vertices.shape))
        for first in range(0, motion.frames, _BLOCK):
            block = slice(first, first + _BLOCK)
            turns = rotation.multiply(motion.global_rotations[block], rotation.conjugate(turned))
            matrices = rotation.to_matrix(turns)
            shifts = motion.positions[block] - np.einsum("fjab,jb->fja", matrices, places)
            moves = np.concatenate([matrices, shifts[..., None]], axis=-1).swapaxes(1, 2)
            coordinates = moves.reshape(-1, 4 * len(skeleton)) @ self._shares
            vertices[block] = coordinates.reshape(len(shifts), 3, -1).swapaxes(1, 2)
        return vertices

    @cached_property
    def _shares(self) -> np.ndarray:
        """``(4 joints, V)`` the vertices ``(x, y, z, 1)`` times the weight of each joint. Skinning is
        linear in the transforms: one product of matrices moves all vertices, and none has a transform of
        its own."""
        points = np.concatenate([self.vertices, np.ones((len(self.vertices), 1))], axis=1)
        shares = self.weights[:, :, None] * points[:, None]
        return np.ascontiguousarray(shares.reshape(len(points), -1).T)

    def bound(self, skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
        """Places ``(joints, 3)`` and orientations ``(joints, 4)`` of the joints in the mesh's own pose."""
        pose = rotation.identity(len(skeleton)) if self.pose is None else self.pose
        return kinematics.forward(skeleton, pose, skeleton.offsets[0])
