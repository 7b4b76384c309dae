"""Small bodies with a mesh: an octahedron around each joint, which it moves alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import method_bodies
import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion, PointSets
from retarget_bench.motion.point_sets import unknown_body
from retarget_bench.motion.surface_sampling import sampled

_BALL = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_FACES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])


@cache
def skinned_body(name: str, spines: int = 3, **sizes: float) -> Character:
    character: Any = method_bodies.body(name, spines=spines, **sizes)
    return replace(character, skin=lambda: _mesh(character))


def _mesh(body: Character) -> Mesh:
    places, count = body.skeleton.rest_positions, len(body.skeleton)
    vertices = places[:, None] + 0.05 * body.height * _BALL
    faces = _FACES[None] + 6 * np.arange(count)[:, None, None]
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), np.repeat(np.eye(count), 6, axis=0))


def scan(motion: Motion, count: int = 300, seed: int = 0) -> PointSets:
    """Points on the skin of a motion."""
    mesh = motion.character.mesh
    assert mesh is not None
    numbers = np.random.default_rng(seed).random((motion.frames, 3, count))
    points = sampled(mesh.skinned(motion), mesh.faces, numbers)
    return PointSets(unknown_body("scan"), tuple(points), motion.fps)
