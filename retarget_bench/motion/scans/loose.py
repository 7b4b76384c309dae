"""Things in a file that are no part of the body: floors and walls, stray points, small things far away."""

from dataclasses import replace

import numpy as np

from retarget_bench.motion.scans.checks import merged, parts
from retarget_bench.motion.scans.reading import Frame
from retarget_bench.motion.surface_sampling import sampled, uniform

_SPOTS, _GUESSES, _NEIGHBOURS = 4096, 128, 12
"""Points that are looked at, planes that are tried, and the neighbours of a point that show how the surface
lies there."""
_MOST_PLANES = 6
_THICK = 0.012
"""Half the thickness of a plane, as a share of how far anything is from it."""
_IN_PLANE, _BEHIND = 0.02, 0.03
"""Share of all points from which a plane is one, and share of the others that may be behind it."""
_BEYOND, _MARGIN = 0.5, 0.05
"""Share of a plane that is not under the body, and what counts as under it, in extents of the body."""
_STANDS = 0.5
"""Extent of a body from a plane that it stands on, over its largest extent along the plane."""
_GAP, _SMALL = 0.1, 0.5
"""Sizes of the body from which a part is far away, and up to which it is small."""
_SPARSE_GAP, _SPACED = 0.05, 5.0
"""The gap around stray points of a cloud: sizes of the body, and distances that one in twenty points is
from its neighbour; the larger of both."""
_STRAY, _FEW = 0.01, 0.1
"""Share of a cloud's points that are stray together, at most, and share of the surface, or of a cloud's
points, of all stray ones."""


def without_loose_parts(frame: Frame) -> tuple[Frame, tuple[str, ...], int]:
    """A frame without planes that the body stands on or before, and without what is small and far from it;
    notes on these; and the number of other things that are as large as a body, and apart from it.

    A frame without any is returned as it is.
    """
    a, b, c = (frame.vertices[frame.faces[:, corner]] for corner in range(3))
    if len(frame.faces) and not np.cross(b - a, c - a).any():
        return frame, (), 0
    notes = list[str]()
    planes = 0
    for _ in range(_MOST_PLANES):
        if not (plane := _plane(frame)).any():
            break
        planes += int(plane.sum())
        frame = _kept(frame, ~plane)
    if planes:
        kind = "faces" if len(frame.faces) else "points"
        notes.append(f"has a floor or a wall, which is left out: {planes} {kind}")
    stray, others = _far(frame)
    if stray.any():
        notes.append(f"has loose parts far from the body, which are left out: {int(stray.sum())} vertices")
        vertices = ~stray
        faces = vertices[frame.faces].all(axis=1)
        frame = replace(
            frame, vertices=frame.vertices[vertices], faces=_renumbered(frame.faces[faces], vertices)
        )
    return frame, tuple(notes), others


def _kept(frame: Frame, kept: np.ndarray) -> Frame:
    """Those faces, or points of a cloud; vertices of other faces alone go with them."""
    if not len(frame.faces):
        return replace(frame, vertices=frame.vertices[kept])
    used, before = (np.zeros(len(frame.vertices), bool) for _ in range(2))
    used[frame.faces[kept]] = True
    before[frame.faces] = True
    vertices = used | ~before
    return replace(frame, vertices=frame.vertices[vertices], faces=_renumbered(frame.faces[kept], vertices))


def _renumbered(faces: np.ndarray, kept: np.ndarray) -> np.ndarray:
    return np.asarray((np.cumsum(kept) - 1)[faces])


# ------------------------------------------------------------------------------------------------ planes
def _plane(frame: Frame) -> np.ndarray:
    """``(F,)`` bool: the faces in a plane that is no part of the body; of a cloud ``(V,)`` its points."""
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    vertices, faces = frame.vertices, frame.faces
    points = _looked_at(frame)
    chosen = points[np.floor(uniform(1, _GUESSES) * len(points)).astype(int)]
    around = points[cKDTree(points).query(chosen, min(_NEIGHBOURS, len(points)))[1].reshape(_GUESSES, -1)]
    starts = around.mean(axis=1)
    normals = np.linalg.svd(around - starts[:, None])[2][:, -1]
    best, most = None, _IN_PLANE * len(points)
    for start, normal in zip(starts, normals, strict=True):
        away = (points - start) @ normal
        thick = _THICK * float(np.abs(away).max())
        near = np.abs(away) <= thick
        if near.sum() > most and _is_no_part(points, away, near, normal):
            best, most = (start, normal, thick), float(near.sum())
    if best is None:
        return np.zeros(len(faces) or len(vertices), bool)
    start, normal, thick = best
    near = np.abs((vertices - start) @ normal) <= thick
    if len(faces):
        in_plane = near[faces].all(axis=1)
        part = parts(merged(frame)[1])
        flat = ~np.isin(part, part[~in_plane])  # of parts that are nothing but plane
        near = flat if flat.any() else in_plane
    return np.asarray(near & ~near.all())  # beside a floor there is a body


def _looked_at(frame: Frame) -> np.ndarray:
    """``(n, 3)`` points on a frame's surface; of a cloud some of its own."""
    if not len(frame.faces):
        return frame.vertices[:: 1 + (len(frame.vertices) - 1) // _SPOTS]
    numbers = uniform(2, 3 * _SPOTS).reshape(1, 3, _SPOTS)
    return np.asarray(sampled(frame.vertices[None], frame.faces, numbers)[0])


def _is_no_part(points: np.ndarray, away: np.ndarray, near: np.ndarray, normal: np.ndarray) -> bool:
    """Whether points in a plane are a floor or a wall: the body is on one side, stands on it or is in front
    of it, and most of the plane is not under the body."""
    rest = ~near
    if not rest.any() or min((away[rest] > 0).mean(), (away[rest] < 0).mean()) > _BEHIND:
        return False
    level = points @ np.linalg.svd(normal[None])[2][1:].T
    body = level[rest]
    level = (level - body.mean(axis=0)) @ np.linalg.svd(body - body.mean(axis=0), full_matrices=False)[2].T
    low, high = level[rest].min(axis=0), level[rest].max(axis=0)
    margin = _MARGIN * float((high - low).max())
    flat = level[near]
    beyond = ((flat < low - margin) | (flat > high + margin)).any(axis=1).mean()
    stands = float(np.ptp(away[rest])) >= _STANDS * float((high - low).max())
    before = ((flat.min(axis=0) <= low) & (flat.max(axis=0) >= high)).all()
    return bool(beyond >= _BEYOND and (stands or before))


# ------------------------------------------------------------------------------------------- loose parts
def _far(frame: Frame) -> tuple[np.ndarray, int]:
    """``(V,)`` bool: vertices of what is small and far from the largest part; and how many others are
    far."""
    vertices, count = frame.vertices, len(frame.vertices)
    points = _looked_at(frame)
    size = 2.0 * float(np.percentile(np.linalg.norm(points - np.median(points, axis=0), axis=1), 90.0))
    cloud = not len(frame.faces)
    if cloud:
        cluster = _clusters(vertices, frame.faces, max(_SPARSE_GAP * size, _SPACED * _spacing(points)))
        of_points = cluster
    else:
        cluster = _clusters(np.concatenate([vertices, points]), frame.faces, _GAP * size)
        cluster, of_points = cluster[:count], cluster[count:]
    sizes = np.bincount(of_points, minlength=int(cluster.max()) + 1) / len(of_points)
    body = int(sizes.argmax())
    full = _diagonal(vertices[cluster == body])
    others = [each for each in np.unique(cluster) if each != body]
    large = [each for each in others if _diagonal(vertices[cluster == each]) >= _SMALL * full]
    small = [each for each in others if each not in large and (not cloud or sizes[each] < _STRAY)]
    stray = np.isin(cluster, small)
    if np.isin(of_points, small).mean() > _FEW:  # a body of loose parts
        stray[:] = False
    return stray, len(large)


def _spacing(points: np.ndarray) -> float:
    from scipy.spatial import cKDTree

    return float(np.percentile(cKDTree(points).query(points, 2)[0][:, 1], 95.0)) if len(points) > 1 else 0.0


def _clusters(points: np.ndarray, faces: np.ndarray, gap: float) -> np.ndarray:
    """``(n,)`` numbers of clusters: what is in the same or in neighbouring cells as wide as the gap, or in
    one face, is together."""
    from scipy.sparse import coo_array  # type: ignore[import-untyped]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]
    from scipy.spatial import cKDTree

    places = np.floor((points - points.min(axis=0)) / max(gap, 1e-12))
    cells, of = np.unique(places, axis=0, return_inverse=True)
    of = of.reshape(-1)
    pairs = cKDTree(cells).query_pairs(1.5, p=np.inf, output_type="ndarray")
    edges = np.concatenate([pairs, of[faces[:, [0, 1]]], of[faces[:, [1, 2]]]])
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(len(cells),) * 2)
    return np.asarray(connected_components(graph, directed=False)[1][of])


def _diagonal(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))
