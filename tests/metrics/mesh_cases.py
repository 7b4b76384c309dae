"""Bodies whose skin is a few balls, each carried by one joint, and motions of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from metric_cases import HUMAN, Sides, character, motion

from retarget_bench.api.comparison import vertices
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Surface

Balls = Mapping[str, tuple[float, tuple[float, float, float]]]
"""Joint -> radius and middle relative to it, metres."""
BALLS: Balls = {
    "Spine1": (0.15, (0.0, 0.0, 0.0)),
    "Head": (0.1, (0.0, 0.08, 0.0)),
    "LeftHand": (0.06, (0.05, 0.0, 0.0)),
    "RightHand": (0.06, (-0.05, 0.0, 0.0)),
    "LeftFoot": (0.06, (0.0, -0.02, 0.03)),
    "RightFoot": (0.06, (0.0, -0.02, 0.03)),
}


def ball(rounds: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Points ``(V, 3)`` on the unit sphere and triangles ``(F, 3)``, counter-clockwise from outside: an
    octahedron whose triangles are cut in four, some times over."""
    points = [np.array(p, dtype=float) for p in np.vstack([np.eye(3), -np.eye(3)])]
    faces = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    for _ in range(rounds):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                point = points[a] + points[b]
                middles[key] = len(points)
                points.append(point / np.linalg.norm(point))
            return middles[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return np.array(points), np.array(faces)


def body_of(balls: Balls, rounds: int = 2, seed: int | None = None) -> Character:
    """A person with this skin."""
    body = character("Balls", rig=HUMAN, seed=seed)
    names, unit = body.skeleton.names, ball(rounds)
    rest = body.motion(
        np.array([[[1.0, 0, 0, 0]] * len(names)]), body.skeleton.offsets[:1], 30.0
    ).positions[0]
    size = len(unit[0])
    weights = np.zeros((size * len(balls), len(names)))
    skin, faces = [], []
    for k, (name, (radius, middle)) in enumerate(balls.items()):
        joint = names.index(name)
        skin.append(rest[joint] + middle + radius * unit[0])
        faces.append(unit[1] + k * size)
        weights[k * size : (k + 1) * size, joint] = 1.0
    mesh = Mesh(np.concatenate(skin), np.concatenate(faces), weights)
    return replace(body, skin=lambda: mesh)


def sides(frames: int = 12, seed: int = 0, balls: Balls = BALLS, fps: float = 30.0) -> Sides:
    """A random source, and a prediction and a reference of a body with skin."""
    body = body_of(balls, seed=seed + 1)
    moving = [motion(body, frames, seed + k, fps=fps) for k in (2, 3)]
    return Sides(motion(character("A", seed=seed), frames, seed + 2, fps=fps), moving[1], moving[0])


def skin(side: object, body: Character) -> np.ndarray:
    """``(frames, V, 3)`` the vertices of one side."""
    places = vertices(side, body)
    assert places is not None
    return places


def as_surface(case: Sides, predicted: np.ndarray) -> Sides:
    """The case with a prediction known by vertices ``(frames, V, 3)``."""
    return replace(case, predicted=Surface(case.predicted.character, predicted, case.predicted.fps))
