"""Generalised winding numbers of surfaces (Jacobson et al. 2013): how often a surface is around a point.

Of a closed surface it is a whole number, 1 inside and 0 outside, and is counted where a ray from the point
leaves and enters. Of an open one it is the sum of solid angles over a full sphere's, and fades across the
holes. Both are exact, in NumPy alone: tests compare them with libigl's.
"""

import numpy as np

INSIDE = 0.5
"""Winding number above which a point counts as inside."""
_PAIRS = 1_000_000
"""Points times triangles at a time, so that many points do not fill the memory."""
_HAIR = 1e-9
_VIEW = np.linalg.qr(np.array([[0.61, 0.35, -0.71], [-0.23, 0.93, 0.29], [0.76, -0.02, 0.65]]))[0]
"""Axes along the ray and across it: along no axis of the world, which flat soles and planes of symmetry
lie along."""


def is_closed(triangles: np.ndarray) -> bool:
    """True where every edge of triangles ``(F, 3)`` is met by as many from either side."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    order = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, number = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return not np.bincount(number.reshape(-1), order).any()


def winding_numbers(
    points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray, closed: bool = False
) -> np.ndarray:
    """``(points,)`` the winding number of triangles ``(F, 3)`` of vertices ``(V, 3)`` around points
    ``(points, 3)``.

    closed: whether ``is_closed`` of the triangles, if that is known; open surfaces take longer.
    """
    if not len(points) or not len(triangles):
        return np.zeros(len(points))
    middle = points.mean(axis=0)
    points, vertices = points - middle, vertices - middle
    if closed:
        return _crossings(points, vertices, triangles)
    step = max(_PAIRS // len(triangles), 1)
    return np.concatenate(
        [_solid_angles(points[k : k + step], vertices, triangles) for k in range(0, len(points), step)]
    )


def _solid_angles(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """By the formula of van Oosterom and Strackee (1983)."""
    used, place = np.unique(triangles, return_inverse=True)
    sides = place.reshape(triangles.shape).T
    vertices = vertices[used]
    offsets = vertices - points[:, None]
    lengths = np.sqrt(np.einsum("pvc,pvc->pv", offsets, offsets))
    a, b, c = (vertices[side] for side in sides)
    normals = np.cross(b - a, c - a)
    # the triple product of the three offsets is the normal's product with any one of them
    volume = np.einsum("fc,fc->f", normals, a) - points @ normals.T
    to_a, to_b, to_c = (lengths[:, side] for side in sides)
    below = to_a * to_b * to_c
    for one, other, third, edge in (
        (to_a, to_b, to_c, a - b),
        (to_b, to_c, to_a, b - c),
        (to_c, to_a, to_b, c - a),
    ):
        # by the law of cosines, the product of two offsets from the lengths of three sides
        below += 0.5 * (one**2 + other**2 - np.einsum("fc,fc->f", edge, edge)) * third
    return np.asarray(np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi))


def _crossings(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """By a ray along the first axis of ``_VIEW``: +1 for every triangle that it leaves through, -1 for
    every one that it enters through. A ray through an edge meets just one of its two triangles."""
    points, vertices = points @ _VIEW, vertices @ _VIEW
    corners = vertices[triangles]
    # boxes are a hair too large: rounding must not leave out one of two triangles at an edge
    hair = _HAIR * np.abs(vertices).max()
    low, high = corners.min(axis=1) - hair, corners.max(axis=1) + hair
    point, triangle = _under(points[:, 1:], low[:, 1:], high[:, 1:])
    near = points[point, 0] <= high[triangle, 0]
    point, triangle = point[near], triangle[near]
    turns = np.zeros(len(point))
    for k in range(3):
        turns += _passes(points[point], vertices, triangles[triangle, k], triangles[triangle, (k + 1) % 3])
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[triangle]
    ahead = (
        np.einsum("nc,nc->n", corners[triangle, 0] - points[point], normal) * np.sign(normal[:, 0]) > 0.0
    )
    return np.bincount(point, turns * ahead, minlength=len(points))


def _under(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of points ``(points, 2)`` and boxes ``(F, 2)`` that hold them, by number.

    Boxes are listed in the cells of a grid that they touch, of which a point asks its own alone.
    """
    start, end = low.min(axis=0), high.max(axis=0)
    kept = np.flatnonzero(((points >= start) & (points <= end)).all(axis=1))
    side = max(int(np.sqrt(len(low))), 1)
    cell = np.maximum((end - start) / side, np.finfo(float).tiny)

    def cells(places: np.ndarray) -> np.ndarray:
        return np.clip(((places - start) / cell).astype(np.int64), 0, side - 1)

    first, last = cells(low), cells(high)
    across, up = (last - first + 1).T
    boxes = np.repeat(np.arange(len(low)), across * up)
    place = _counted(across * up)
    column, row = first[boxes, 0] + place // up[boxes], first[boxes, 1] + place % up[boxes]
    listed = np.argsort(column * side + row, kind="stable")
    counts = np.bincount(column * side + row, minlength=side * side)
    own = cells(points[kept]) @ np.array([side, 1])
    begins = np.cumsum(counts) - counts
    point = np.repeat(kept, counts[own])
    box = boxes[listed[np.repeat(begins[own], counts[own]) + _counted(counts[own])]]
    held = ((points[point] >= low[box]) & (points[point] <= high[box])).all(axis=1)
    return point[held], box[held]


def _counted(counts: np.ndarray) -> np.ndarray:
    """0, 1, ... anew for each of these counts."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


def _passes(points: np.ndarray, vertices: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """``(n,)`` +1 where an edge passes a point upwards on its right, -1 where downwards on its left.

    Summed over the edges of a triangle: how often it goes round the point, seen along the ray. An edge
    counts with its lower end alone, and is measured from the vertex of the lower number, so that both its
    triangles find the same.
    """
    up = (vertices[start, 2] <= points[:, 2]) & (vertices[end, 2] > points[:, 2])
    down = (vertices[end, 2] <= points[:, 2]) & (vertices[start, 2] > points[:, 2])
    first, second = vertices[np.minimum(start, end)], vertices[np.maximum(start, end)]
    line, offset = second - first, points - first
    left = line[:, 1] * offset[:, 2] - line[:, 2] * offset[:, 1] > 0.0
    # seen from the lower end of the edge
    left ^= (start > end) ^ down
    return np.asarray(np.where(left, up.astype(float) - down, 0.0))


def in_boxes(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """``(frames, points)`` bool: points ``(frames, points, 3)`` in any of the boxes of their frame, whose
    corners are ``(frames, boxes, 3)``."""
    inside = np.zeros(points.shape[:2], dtype=bool)
    for box in range(low.shape[1]):
        above, under = points >= low[:, box, None], points <= high[:, box, None]
        inside |= (above & under).all(axis=-1)
    return inside


def boxes(vertices: np.ndarray, order: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners ``(frames, boxes, 3)`` of the boxes around parts of vertices ``(frames, V, 3)``.

    order: the numbers of the vertices of one part after the other. starts: where each part begins in it.
    """
    chosen = vertices[:, order]
    return np.minimum.reduceat(chosen, starts, axis=1), np.maximum.reduceat(chosen, starts, axis=1)
