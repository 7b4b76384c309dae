"""The size and the path of a body of which only points are seen, and the same path for another body."""

from collections.abc import Sequence

import numpy as np

from retarget_bench.motion.character import Character

_DIRECTIONS = 64
"""In which the largest extent of points is looked for."""


def centre(points: np.ndarray) -> np.ndarray:
    """``(..., 3)`` metres: the middle of the box around points ``(..., points, 3)``."""
    return np.asarray((points.min(axis=-2) + points.max(axis=-2)) / 2.0)


def standing(character: Character) -> np.ndarray:
    """``(V, 3)`` metres: the vertices of the character's mesh, which it must have, in the T-pose."""
    mesh = character.mesh
    assert mesh is not None
    pose = character.motion(character.reference_pose[None], np.zeros((1, 3)), 30.0)
    return np.asarray(mesh.skinned(pose)[0])


def size(frames: Sequence[np.ndarray]) -> float:
    """Metres: how tall a body is by points of its poses, each ``(points, 3)``: the most that they extend in
    any direction in any frame. Of a body that never stretches it is too small, of one that lifts its arms
    too large.
    """
    ways = half_sphere(_DIRECTIONS)
    return float(max(np.ptp(np.asarray(frame) @ ways.T, axis=0).max() for frame in frames))


def ratio(frames: Sequence[np.ndarray], character: Character) -> float:
    """The height of a character with a mesh over that of the body under these points."""
    return float(np.ptp(standing(character)[:, 1])) / size(frames)


def along(vertices: np.ndarray, frames: Sequence[np.ndarray], ratio: float) -> np.ndarray:
    """Vertices ``(frames, V, 3)`` of poses anywhere, moved to where the points of each frame are: on the
    level to the middle of their box, in the vertical until the lowest vertex is where the lowest point is;
    all times a ratio. The floor is at y = 0."""
    path = ratio * np.stack([centre(frame) for frame in frames])
    path -= centre(vertices)
    lowest = np.array([frame[:, 1].min() for frame in frames])
    path[:, 1] = ratio * lowest - vertices[..., 1].min(axis=1)
    return np.asarray(vertices + path[:, None])


def half_sphere(count: int) -> np.ndarray:
    """``(count, 3)`` unit vectors all over a half sphere (a Fibonacci lattice)."""
    height = (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    level = np.sqrt(1.0 - height**2)
    return np.stack([level * np.cos(turn), height, level * np.sin(turn)], axis=-1)
