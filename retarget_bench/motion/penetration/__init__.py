"""Flesh inside flesh: vertices of limbs that lie inside the rest of the body (generalised winding number).

What the metric ``self_penetration`` counts, and what pictures light up.
"""

from functools import lru_cache

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.penetration.limbs import Limb, limbs
from retarget_bench.motion.penetration.winding import INSIDE, boxes, in_boxes, winding_numbers

__all__ = ["Limb", "inside", "inside_at_rest", "inside_mask", "limbs"]


def inside(body: Character, vertices: np.ndarray) -> list[np.ndarray]:
    """Of each limb ``(frames, n)`` bool: its tested vertices that are inside the rest of the body, during
    a motion of its vertices ``(frames, V, 3)``."""
    return [_inside(limb, order, starts, vertices) for limb, (order, starts) in _boxed(body)]


def _inside(limb: Limb, order: np.ndarray, starts: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    tested = vertices[:, limb.tested]
    inside = in_boxes(tested, *boxes(vertices, order, starts))
    for frame in np.flatnonzero(inside.any(axis=1)):
        chosen = np.flatnonzero(inside[frame])
        numbers = winding_numbers(tested[frame, chosen], *limb.closed(vertices[frame]), limb.sealed)
        inside[frame, chosen] = numbers > INSIDE
    return inside


@lru_cache(maxsize=256)
def _boxed(body: Character) -> tuple[tuple[Limb, tuple[np.ndarray, np.ndarray]], ...]:
    """The limbs with the parts of the rest of the body, one for each joint, for boxes around them: outside
    of all of them nothing is inside the body."""
    mesh = body.mesh
    assert mesh is not None
    joint = mesh.weights.argmax(axis=1)
    boxed = []
    for limb in limbs(body):
        of = joint[limb.faces]
        parts = [np.unique(limb.faces[(of == each).any(axis=1)]) for each in np.unique(of)]
        starts = np.cumsum([0, *map(len, parts[:-1])])
        boxed.append((limb, (np.concatenate(parts), starts)))
    return tuple(boxed)


@lru_cache(maxsize=256)
def inside_at_rest(body: Character) -> tuple[np.ndarray, ...]:
    """Of each limb ``(n,)`` bool: its tested vertices that are inside in the common reference pose."""
    mesh = body.mesh
    if mesh is None:
        return ()
    still = body.motion(body.reference_pose[None], np.zeros((1, 3)), 1.0)
    return tuple(each[0] for each in inside(body, mesh.skinned(still)))


def inside_mask(body: Character, vertices: np.ndarray) -> np.ndarray:
    """``(frames, V)`` bool: vertices of all limbs that are inside, but were not in the reference pose.

    vertices: ``(frames, V, 3)`` metres, of the character's mesh.
    """
    mask = np.zeros(vertices.shape[:2], dtype=bool)
    hits = zip(limbs(body), inside(body, vertices), inside_at_rest(body), strict=True)
    for limb, now, rest in hits:
        mask[:, limb.tested] = now & ~rest
    return mask
