"""Faults of a mesh: those that cannot be repaired are refused, the rest is noted."""

from dataclasses import dataclass

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.motion.scans.reading import Frame

_APART = 0.25
"""Share of the smaller one's ground plan that two bodies may have in common; clothes, hair and eyes are
within that of the body."""
_AS_LARGE = 0.5
"""Size beside the largest part's from which a part can be another body."""
_MERGED = 1e-5
"""Vertices closer than this share of the mesh's size are one: STL files repeat them for each triangle."""


@dataclass(frozen=True)
class Topology:
    """parts: connected ones. open_edges: with one face. crowded_edges: with more than two."""

    parts: int
    open_edges: int
    crowded_edges: int

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on its faults."""
        notes = []
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


def topology(frame: Frame) -> Topology:
    """The parts and edges of a mesh with faces. Raises FileError where there are two bodies, or no area."""
    from scipy.sparse import coo_array  # type: ignore[import-untyped]
    from scipy.sparse.csgraph import connected_components  # type: ignore[import-untyped]

    grid = _MERGED * float(np.ptp(frame.vertices, axis=0).max())
    points, same = np.unique(np.round(frame.vertices / grid), axis=0, return_inverse=True)
    faces = same.reshape(-1)[frame.faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    if not len(faces):
        raise FileError(frame.path, "has faces without area only")
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(len(points), len(points)))
    part = connected_components(graph, directed=False)[1][faces[:, 0]]
    names = np.unique(part)
    boxes = [_box(points[faces[part == name]].reshape(-1, 3) * grid) for name in names]
    _check_one_body(frame, boxes)
    return Topology(len(names), int((uses == 1).sum()), int((uses > 2).sum()))


def _box(points: np.ndarray) -> np.ndarray:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _check_one_body(frame: Frame, boxes: list[np.ndarray]) -> None:
    """Raises FileError where two large parts stand beside each other."""
    sizes = [float(np.linalg.norm(high - low)) for low, high in boxes]
    large = [box for box, size in zip(boxes, sizes, strict=True) if size >= _AS_LARGE * max(sizes)]
    apart = [box for box in large[1:] if _common(large[0], box) < _APART]
    if apart:
        raise FileError(
            frame.path,
            f"holds {1 + len(apart)} bodies beside each other; give each in a file of its own",
        )


def _common(one: np.ndarray, other: np.ndarray) -> float:
    """The share of the smaller box that lies within the other: the least over the axes."""
    within = np.minimum(one[1], other[1]) - np.maximum(one[0], other[0])
    smaller = np.minimum(np.ptp(one, axis=0), np.ptp(other, axis=0))
    return float((np.maximum(within, 0.0) / np.maximum(smaller, 1e-12)).min())
