"""Surfaces as NPT sees them: skins that follow transforms, points on them, and a common size."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.motion.scan_path import centre, standing
from retarget_bench.motion.surface_sampling import sampled

STATURE = 1.7
"""Units that every target is tall in its T-pose: the network answers at most 2 units (``REACH``)."""

POINTS = 2048
"""Of each frame, where the source is a motion with a mesh."""


def unfit(character: Character) -> str:
    """Reason why a character cannot be a target, as a sentence; "" where it can."""
    if character.skin is None:
        return f"npt moves the vertices of a mesh, and {character.name} has none"
    if character.four_legged:
        return f"npt learns people's poses, and {character.name} stands on four legs"
    return ""


@dataclass(frozen=True, eq=False)
class Identity:
    """A target's vertices in the T-pose.

    vertices: ``(V, 3)`` metres, centred. scale: units per metre.
    """

    vertices: np.ndarray
    scale: float

    @classmethod
    def of(cls, character: Character) -> Self:
        vertices = standing(character)
        return cls(vertices - centre(vertices), STATURE / float(np.ptp(vertices[:, 1])))


def transforms(mesh: Mesh, motion: Motion) -> np.ndarray:
    """``(frames, joints, 12)`` of every joint the three rows of the matrix that moves what is rigidly with
    it, single precision; metres."""
    places, turned = mesh.bound(motion.skeleton)
    matrices = rotation.to_matrix(rotation.multiply(motion.global_rotations, rotation.conjugate(turned)))
    shifts = motion.positions - np.einsum("fjab,jb->fja", matrices, places)
    rows = np.concatenate([matrices, shifts[..., None]], axis=-1)
    return rows.reshape(*shifts.shape[:2], 12).astype(np.float32)


class Skin:
    """A body's mesh in single precision, for drawing many poses of it."""

    def __init__(self, character: Character) -> None:
        mesh = character.mesh
        assert mesh is not None
        self.identity = Identity.of(character)
        self.weights = mesh.weights.astype(np.float32)
        corners = np.concatenate([mesh.vertices, np.ones((len(mesh.vertices), 1))], axis=-1)
        self._corners = corners.astype(np.float32)
        self.faces = mesh.faces

    @cached_property
    def edges(self) -> np.ndarray:
        """``(edges, 2)`` vertices, each edge once."""
        pairs = np.sort(
            np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        )
        return np.unique(pairs, axis=0)

    def posed(self, moved: np.ndarray) -> np.ndarray:
        """``(V, 3)`` metres: the vertices moved by transforms ``(joints, 12)`` of one frame."""
        blended = (self.weights @ moved).reshape(-1, 3, 4)
        return np.asarray((blended @ self._corners[:, :, None])[..., 0])


def on_mesh(numbers: np.random.Generator, motion: Motion, mesh: Mesh) -> PointSets:
    """``POINTS`` points on the skin of a moving body, new ones in each frame."""
    drawn = sampled(mesh.skinned(motion), mesh.faces, numbers.random((motion.frames, 3, POINTS)))
    return PointSets(unknown_body(motion.character.name), tuple(drawn), motion.fps)


def drawn(numbers: np.random.Generator, frames: Sequence[np.ndarray], count: int) -> np.ndarray:
    """``(frames, count, 3)``: of the points of each frame so many in random order; where it has fewer, some
    of them more than once."""
    chosen = [frame[np.resize(numbers.permutation(len(frame)), count)] for frame in frames]
    return np.stack(chosen)
