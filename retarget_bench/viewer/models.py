"""Triangle meshes of bodies per frame: bones as rounded tubes, skins as they are."""

from dataclasses import dataclass

import numpy as np

from retarget_bench.viewer.bodies import Solid
from retarget_bench.viewer.colours import Colour, tints

AROUND = 8
"""Corners of a tube."""
PROFILE = ((-1.0, 0.0), (-0.7, 0.71), (0.0, 1.0), (0.0, 1.0), (0.7, 0.71), (1.0, 0.0))
"""Rings of a tube, the first half at its one end: radii beyond that end, and how wide, in radii."""


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one colour. faces: ``(faces, 3)`` indices, counter-clockwise seen from outside."""

    colour: Colour
    faces: np.ndarray


class Model:
    """A figure as parts (middle, left, right) that share no vertices; parts that the body lacks are left
    out."""

    def __init__(self, solid: Solid) -> None:
        self.solid = solid
        mesh = solid.body.mesh if solid.skinned else None
        sides = solid.bones(0)[2] if mesh is None else solid.face_sides
        self._sides: list[int] = np.unique(sides).tolist()
        self._used: list[np.ndarray] = []
        """The skin's vertices in every part."""
        faces = []
        for side in self._sides:
            if mesh is None:
                faces.append(tube_faces(int((sides == side).sum())))
                continue
            own = mesh.faces[sides == side]
            self._used.append(np.unique(own))
            faces.append(np.searchsorted(self._used[-1], own).astype(np.uint32))
        colours = tints(solid.colour)
        self.parts = [Part(colours[side], own) for side, own in zip(self._sides, faces, strict=True)]

    def vertices(self, frame: int) -> list[np.ndarray]:
        """``(vertices, 3)`` metres of every part at a frame."""
        if self.solid.skinned:
            skin = self.solid.skin_at(frame).astype(np.float32)
            return [skin[used] for used in self._used]
        ends, radii, sides = self.solid.bones(frame)
        return [tubes(ends[sides == side], radii[sides == side]) for side in self._sides]


def tubes(ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """``(n * 6 * AROUND, 3)`` vertices of rounded tubes between ends ``(n, 2, 3)``, radii ``(n, 2)``."""
    way = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(way, axis=1, keepdims=True)
    axis = np.where(length > 1e-9, way / np.maximum(length, 1e-9), (0.0, 1.0, 0.0))
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    first = np.cross(axis, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axis, first)
    turn = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)
    circle = np.cos(turn)[:, None] * first[:, None] + np.sin(turn)[:, None] * second[:, None]
    rings = []
    for number, (beyond, wide) in enumerate(PROFILE):
        end = int(number >= len(PROFILE) // 2)
        radius = radii[:, end, None]
        middle = ends[:, end] + beyond * radius * axis
        rings.append(middle[:, None] + wide * radius[:, None] * circle)
    return np.stack(rings, axis=1).reshape(-1, 3).astype(np.float32)


def tube_faces(count: int) -> np.ndarray:
    """``(faces, 3)`` of the vertices of so many tubes."""
    ring = np.arange(AROUND)
    following = np.roll(ring, -1)
    one = []
    for number in range(len(PROFILE) - 1):
        low, high = number * AROUND, (number + 1) * AROUND
        one.append(np.stack([low + ring, low + following, high + following], axis=1))
        one.append(np.stack([low + ring, high + following, high + ring], axis=1))
    faces = np.concatenate(one)
    every = faces[None] + np.arange(count)[:, None, None] * AROUND * len(PROFILE)
    return every.reshape(-1, 3).astype(np.uint32)
