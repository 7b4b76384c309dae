"""Distances from points to triangles, exact, of those pairs that may be the nearest."""

import numpy as np

_AT_A_TIME = 8


def to_triangles(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """``(n,)`` metres from points ``(n, 3)`` to triangles ``(n, 3, 3)``, pair by pair.

    The nearest point is the foot of the perpendicular where that is inside the triangle, else on an edge.
    """
    a, b, c = (corners[:, k] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.einsum("nc,nc->n", normal, normal)
    inside = size > 0.0
    nearest = np.full(len(points), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        line, offset = end - start, points - start
        square = np.einsum("nc,nc->n", line, line)
        along = np.einsum("nc,nc->n", offset, line) / np.where(square > 0.0, square, 1.0)
        foot = offset - np.clip(along, 0.0, 1.0)[:, None] * line
        nearest = np.minimum(nearest, np.einsum("nc,nc->n", foot, foot))
        inside &= np.einsum("nc,nc->n", np.cross(line, offset), normal) >= 0.0
    height = np.einsum("nc,nc->n", points - a, normal) ** 2 / np.where(size > 0.0, size, 1.0)
    return np.sqrt(np.where(inside, height, nearest))


def to_surface(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """``(points,)`` metres from points ``(points, 3)`` to the surface of triangles ``(F, 3)`` of vertices
    ``(V, 3)``; infinite where there are none."""
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    if not len(points) or not len(triangles):
        return np.full(len(points), np.inf)
    reach = cKDTree(vertices[np.unique(triangles)]).query(points)[0]
    distances = np.full(len(points), np.inf)
    point, _, metres = within(points, vertices[triangles], reach * (1.0 + 1e-9))
    np.minimum.at(distances, point, metres)
    return distances


def within(
    points: np.ndarray, corners: np.ndarray, reach: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of points ``(points, 3)`` and triangles ``(F, 3, 3)`` that may be within reach, a distance or
    one for each point: the points and the triangles by number, and how far they are apart, metres.

    Those are the triangles with a sphere around them that reaches into the one around the point.
    """
    from scipy.spatial import cKDTree

    centres = corners.mean(axis=1)
    radius = float(np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=-1)).max(initial=0.0))
    near = cKDTree(centres).query_ball_point(points, reach + radius)
    point = np.repeat(np.arange(len(points)), [len(each) for each in near])
    triangle = np.fromiter((k for each in near for k in each), dtype=np.int64, count=len(point))
    return point, triangle, to_triangles(points[point], corners[triangle])


def deepest(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Metres from the surface of the point that is farthest from it, as ``to_surface``.

    No point is farther than its nearest vertex: those that are farthest by that are measured first.
    """
    from scipy.spatial import cKDTree

    reach = cKDTree(vertices[np.unique(triangles)]).query(points)[0]
    order, depth = np.argsort(-reach), 0.0
    for first in range(0, len(points), _AT_A_TIME):
        chosen = order[first : first + _AT_A_TIME]
        if reach[chosen[0]] <= depth:
            break
        depth = max(depth, float(to_surface(points[chosen], vertices, triangles).max()))
    return depth
