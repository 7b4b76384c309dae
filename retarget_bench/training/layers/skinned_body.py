"""Skinned bodies in single frames, as methods that learn from surfaces draw them."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.mesh import Mesh


@dataclass(frozen=True, eq=False)
class SkinnedBody:
    """A body's mesh in single precision, for drawing many single poses of it.

    vertices: ``(V, 4)``, the fourth 1. faces: ``(F, 3)``. weights: ``(V, joints)``.
    """

    character: Character
    vertices: np.ndarray
    faces: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, character: Character) -> Self:
        mesh = mesh_of(character)
        vertices = np.concatenate([mesh.vertices, np.ones((len(mesh.vertices), 1))], axis=1)
        return cls(character, vertices.astype(np.float32), mesh.faces, mesh.weights.astype(np.float32))

    @property
    def joints(self) -> int:
        """Number of the rig's joints."""
        return self.weights.shape[1]

    @cached_property
    def resting(self) -> np.ndarray:
        """``(22, 3)`` metres: the joints of ``body22`` in the mesh's own pose."""
        places = mesh_of(self.character).bound(self.character.skeleton)[0]
        return np.asarray(places[list(Body22.of(self.character).joints)])

    def posed(self, turns: np.ndarray, shifts: np.ndarray) -> np.ndarray:
        """``(V, 3)`` metres, the vertices in one frame of ``moves``."""
        return self.blended(np.concatenate([rotation.to_matrix(turns), shifts[..., None]], axis=-1))

    def blended(self, matrices: np.ndarray) -> np.ndarray:
        """``(V, 3)`` metres, the vertices moved by each joint's ``(joints, 3, 4)``."""
        shares = (self.weights @ matrices.reshape(-1, 12).astype(np.float32)).reshape(-1, 3, 4)
        moved: np.ndarray = (shares @ self.vertices[..., None])[..., 0]
        return moved


def mesh_of(character: Character) -> Mesh:
    """Its mesh, which it has to have."""
    mesh = character.mesh
    assert mesh is not None, f"{character.name} was found unfit"
    return mesh


def moves(motion: Motion, origin: np.ndarray) -> dict[str, np.ndarray]:
    """The arrays that move the mesh of a motion's character, seen from ``origin`` ``(frames, 3)``, as
    arrays ``(frames, ...)``.

    turns: ``(joints, 4)`` and shifts: ``(joints, 3)`` metres: a point that follows a joint is turned, then
    shifted.
    """
    places, turned = mesh_of(motion.character).bound(motion.skeleton)
    turns = rotation.multiply(motion.global_rotations, rotation.conjugate(turned))
    rotated = rotation.rotate(turns, np.broadcast_to(places, motion.positions.shape))
    return {"turns": turns, "shifts": motion.positions - origin[:, None] - rotated}


def moves_about_hips(motion: Motion) -> dict[str, np.ndarray]:
    """``moves`` seen from the hips; and joints: ``(frames, 22, 3)`` metres, those of ``body22``."""
    places = motion.positions[:, list(Body22.of(motion.character).joints)]
    hips = places[:, 0]
    return moves(motion, hips) | {"joints": places - hips[:, None]}
