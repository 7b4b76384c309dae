"""Faults of a mesh: those that cannot be repaired are refused, the rest is noted."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.scan_path import half_sphere
from retarget_bench.motion.scans.reading import Frame

_DIRECTIONS, _SLICES = 64, 24
"""Directions in which a second body is looked for, and slices of the points across each."""
_SHARE, _WIDE = 0.33, 0.7
"""Two bodies beside each other have each such a share of the points, and extend across the direction from
one to the other as far as this, over how far each does along it and over what the other does."""
_EMPTY = 0.15
"""Fullness of the slice between two bodies over that of the fullest on either side: 0.00 to 0.15 where
hands touch or overlap, and at least 0.19 within a single body that squats, bows or jumps."""
_SLIM = 5.0
"""How many times as wide as it is long the half may be; legs without a trunk are slimmer."""
_CELL, _SPARSE = 0.03, 0.06
"""Of clouds, whose points may be vertices and lie closer in some places than in others: the size of the
cells that they are thinned to one point of, over the largest extent; and the fullness."""
_SQUARE = 0.2
"""Cosine of directions that count as across another."""
TWO = "holds two bodies beside each other, or something as large; give each in a file of its own"
"""What is wrong with such a file."""
_OPENING, _BEYOND = 0.025, 0.12
"""Area of an opening over that of the surface, and share of the surface beyond it, from and up to which a
part of the body is missing: halves have 0.026 to 0.76 and at most 0.12. Openings of clothes, necks and
soles are smaller, or have legs, arms or a head beyond them (0.22 of the surface and more)."""
_CUT, _END, _PLANE = 0.015, 0.02, 0.03
"""The same of openings in one plane together, such as both thighs of an upper half. Whole bodies have none
with so little beyond. And how far from the plane, in sizes of the body."""
_MERGED = 1e-5
"""Vertices closer than this share of the mesh's size are one: STL files repeat them for each triangle."""


@dataclass(frozen=True)
class Topology:
    """parts: connected ones. open_edges: with one face. crowded_edges: with more than two. opening: share
    of the surface that openings are as large as where they show that a part is missing, else 0."""

    parts: int
    open_edges: int
    crowded_edges: int
    opening: float

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on its faults."""
        notes = []
        if self.opening:
            notes.append(
                "lacks a part of the body, such as its half or its back: it is open for "
                f"{100 * self.opening:.0f} % of its surface, and nothing is beyond"
            )
        if self.open_edges:
            notes.append(f"is open: {self.open_edges} edges have a face on one side only")
        if self.crowded_edges:
            notes.append(f"is not a manifold: {self.crowded_edges} edges have more than two faces")
        if self.parts > 1:
            notes.append(f"has {self.parts} parts that are not connected")
        return tuple(notes)


def check_numbers(frame: Frame) -> None:
    """Raises FileError for vertices that are not finite, or all in one place."""
    bad = ~np.isfinite(frame.vertices).all(axis=1)
    if bad.any():
        raise FileError(
            frame.path,
            f"has {int(bad.sum())} vertices that are not finite, the first being {int(bad.argmax())}",
        )
    if not np.ptp(frame.vertices, axis=0).max() > 0:
        raise FileError(frame.path, "has all its vertices in one place")


def merged(frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the places ``(V,)`` that vertices are at, and faces ``(F, 3)`` by these."""
    grid = _MERGED * float(np.ptp(frame.vertices, axis=0).max())
    same = np.unique(np.round(frame.vertices / grid), axis=0, return_inverse=True)[1].reshape(-1)
    return same, same[frame.faces]


def parts(faces: np.ndarray) -> np.ndarray:
    """``(F,)`` the number of the connected part that each face belongs to."""
    return _components(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]]))[: len(faces)]


def _components(edges: np.ndarray) -> np.ndarray:
    """``(E,)`` the number of the connected part that each edge ``(E, 2)`` belongs to."""
    from scipy.sparse import coo_array  # type: ignore[import-untyped]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]

    graph = coo_array((np.ones(len(edges)), edges.T), shape=(int(edges.max()) + 1,) * 2)
    return np.asarray(connected_components(graph, directed=False)[1][edges[:, 0]])


def topology(frame: Frame) -> Topology:
    """The parts and edges of a mesh with faces. Raises FileError where no face has an area."""
    same, faces = merged(frame)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if not len(faces):
        raise FileError(frame.path, "has faces without area only")
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    names, uses = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)[1:]
    places = np.empty((int(same.max()) + 1, 3))
    places[same] = frame.vertices
    opening = _opening(places, faces, edges[uses[names.reshape(-1)] == 1])
    return Topology(len(np.unique(parts(faces))), int((uses == 1).sum()), int((uses > 2).sum()), opening)


def _opening(places: np.ndarray, faces: np.ndarray, edges: np.ndarray) -> float:
    """Area of the largest openings that show that a part is missing, over that of the surface; 0.0 where
    none do.

    places: ``(V, 3)``. faces: ``(F, 3)``. edges: ``(E, 2)`` those of one face, in its order.
    """
    a, b, c = (places[faces[:, corner]] for corner in range(3))
    areas = np.maximum(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), 1e-30)  # a line has none
    surface, middles = float(areas.sum()), (a + b + c) / 3.0
    largest, cuts = 0.0, list[tuple[float, np.ndarray, np.ndarray]]()
    of = _components(edges) if len(edges) else np.zeros(0, int)
    for each in np.unique(of):
        first, last = (places[edges[of == each, end]] for end in range(2))
        middle = first.mean(axis=0)
        normal = 0.5 * np.cross(first - middle, last - middle).sum(axis=0)
        size, side = float(np.linalg.norm(normal)), (middles - middle) @ normal > 0.0
        beyond = min(areas[side].sum(), areas[~side].sum()) / surface
        if size > 0.0 and beyond <= _END:
            cuts.append((size, middle, normal / size))
        largest = max(largest, size) if beyond <= _BEYOND else largest
    thick = _PLANE * float(np.ptp(places, axis=0).max())
    together = max(
        (sum(size for size, other, _ in cuts if abs((other - at) @ way) < thick) for _, at, way in cuts),
        default=0.0,
    )
    missing = together >= _CUT * surface or largest >= _OPENING * surface
    return max(together, largest) / surface if missing else 0.0


def check_one_body(frame: Frame, points: np.ndarray) -> None:
    """Raises FileError where a frame is of two bodies beside each other, whether their hands touch or not.

    points: ``(n, 3)`` on its surface. A single body is fullest in the middle, two are empty there.
    """
    empty = _EMPTY
    if not len(frame.faces):
        cells = np.round(points / max(_CELL * float(np.ptp(points, axis=0).max()), 1e-12))
        points = points[np.sort(np.unique(cells, axis=0, return_index=True)[1])]
        empty = _SPARSE
    ways = half_sphere(_DIRECTIONS)
    for way, along in zip(ways, (points @ ways.T).T, strict=True):
        across = points @ ways[np.abs(ways @ way) < _SQUARE].T
        for cut in _valleys(along, empty):
            sides = along < cut, along >= cut
            lengths = [float(np.ptp(along[side])) for side in sides]
            widths = [float(np.ptp(across[side], axis=0).max()) for side in sides]
            if min(widths) >= _WIDE * max(*lengths, *widths) and max(widths) <= _SLIM * min(lengths):
                raise FileError(frame.path, TWO)


def _valleys(along: np.ndarray, empty: float) -> Iterator[float]:
    """Middles of slices across some direction that are nearly empty, with many points on both sides."""
    counts, edges = np.histogram(along, _SLICES)
    before = np.cumsum(counts) / len(along)
    for slot in range(1, _SLICES - 1):
        fullest = min(counts[:slot].max(), counts[slot + 1 :].max())
        if _SHARE <= before[slot] <= 1.0 - _SHARE and counts[slot] <= empty * fullest:
            yield float(edges[slot] + edges[slot + 1]) / 2.0
