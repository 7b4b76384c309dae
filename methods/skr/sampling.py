"""Skinned bodies in single frames, from whose surface points are drawn."""

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
    """A body's mesh with its 22 joints, in the poses of single frames.

    vertices: ``(V, 4)`` single precision, the fourth 1. faces: ``(F, 3)``. weights: ``(V, joints)``.
    resting:  ``(22, 3)`` metres: the joints in the mesh's own pose.
    """

    vertices: np.ndarray
    faces: np.ndarray
    weights: np.ndarray
    resting: np.ndarray

    @classmethod
    def of(cls, character: Character) -> Self:
        mesh = mesh_of(character)
        vertices = np.concatenate([mesh.vertices, np.ones((len(mesh.vertices), 1))], axis=1)
        places = mesh.bound(character.skeleton)[0]
        return cls(
            vertices.astype(np.float32),
            mesh.faces,
            mesh.weights.astype(np.float32),
            places[list(Body22(character).joints)],
        )

    @cached_property
    def joints(self) -> int:
        """Number of the rig's joints."""
        return self.weights.shape[1]

    def posed(self, turns: np.ndarray, shifts: np.ndarray) -> np.ndarray:
        """``(V, 3)`` metres, the vertices in one frame of ``transforms``."""
        matrices = np.concatenate([rotation.to_matrix(turns), shifts[..., None]], axis=-1)
        blended = (self.weights @ matrices.reshape(-1, 12).astype(np.float32)).reshape(-1, 3, 4)
        found: np.ndarray = (blended @ self.vertices[..., None])[..., 0]
        return found


def mesh_of(character: Character) -> Mesh:
    """Its mesh, which it has to have."""
    mesh = character.mesh
    assert mesh is not None, f"{character.name} was found unfit"
    return mesh


def transforms(motion: Motion) -> dict[str, np.ndarray]:
    """What moves the mesh of a motion's character, with the hips at the origin in every frame, as arrays
    ``(frames, ...)``.

    turns: ``(joints, 4)`` and shifts: ``(joints, 3)`` metres: a point that follows a joint is turned, then
    shifted. joints: ``(22, 3)`` metres.
    """
    body = Body22(motion.character)
    places, turned = mesh_of(motion.character).bound(motion.skeleton)
    turns = rotation.multiply(motion.global_rotations, rotation.conjugate(turned))
    positions = motion.positions - motion.positions[:, [body.joints[0]]]
    return {
        "turns": turns,
        "shifts": positions - rotation.rotate(turns, np.broadcast_to(places, positions.shape)),
        "joints": positions[:, list(body.joints)],
    }
