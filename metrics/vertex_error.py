"""Vertex errors: distances between the surfaces of a prediction and of its reference, vertex by vertex.

Of no plain run of the main task: comparing 2,000 vertices takes some 110 ms a clip of three seconds, and
all values of joints together 2 to 7. ``bench run --metrics vertex_error`` computes them.
"""

from collections.abc import Mapping
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api import Metric, MetricCard, Prediction, Value
from retarget_bench.api.comparison import RATE, Comparison, squared_length
from retarget_bench.motion.alignment import RIGID, SIMILAR, fits, residuals

NEIGHBOURS = 6
"""Of every vertex: the edges of MEDL."""

POINTS = "p and g: vertices of the target's mesh in the prediction and in the reference, by number"
EDGES = (
    f"E(t): pairs of a vertex and each of its {NEIGHBOURS} nearest vertices in frame t of the reference, "
    "found anew in every frame; left out for meshes of fewer than 7 vertices"
)
ACCELERATION = "D(x) = x(t+1) - 2 x(t) + x(t-1); left out for clips of fewer than three frames"
PAPER = "Correspondence-free online human motion retargeting (2023), section 4"

_value = partial(Value, better="lower", needs=("reference", "mesh"))


def _distance(id_: str, label: str, meaning: str, mean: str, why: str) -> Value:
    """A mean distance in per cent of the height."""
    return _value(id_, label, meaning, "% of height", formula=f"100 * {mean} / h; {POINTS}", source=why)


class VertexError(Metric):
    """Errors of surfaces. Vertices correspond by number; every vertex counts alike."""

    card = MetricCard(
        name="vertex_error",
        summary="vertex errors: MPVD, PA-MPVD, edge lengths, accelerations",
        version="1",
        tasks=("points",),
        values=(
            _distance(
                "mpvd_h",
                "MPVD",
                "mean distance of the mesh's vertices from the reference's, with root translation",
                "mean over frames and vertices of |p - g|",
                f"MPVD: {PAPER}",
            ),
            _distance(
                "pa_mpvd.rigid",
                "PA-MPVD, rigid",
                "mean vertex distance after a rigid alignment of each frame",
                f"mean over frames and vertices of |R p + t - g|, {RIGID}, chosen in every frame for the "
                "least sum of squares",
                f"PA-MPVD: {PAPER}, where rigid or similar is not said",
            ),
            _distance(
                "pa_mpvd.similarity",
                "PA-MPVD",
                "mean vertex distance after a similarity alignment (with scale) of each frame",
                f"mean over frames and vertices of |s R p + t - g|, {SIMILAR}, chosen in every frame for "
                "the least sum of squares",
                f"PA-MPVD: {PAPER}, where rigid or similar is not said",
            ),
            _distance(
                "medl_h",
                "MEDL",
                "mean difference of the distances between neighbouring vertices from the reference's",
                f"mean over frames t and (i, j) in E(t) of ||p_i - p_j| - |g_i - g_j||; {EDGES}",
                f'MEDL: {PAPER} ("the {NEIGHBOURS} closest neighbors of every point in the ground truth"; '
                "we read this as the frame of the ground truth, since its points are scans without a "
                "T-pose; where body parts touch, edges run between them)",
            ),
            _value(
                "vertex_acc",
                "vertex acceleration error",
                "mean difference of vertex accelerations from the reference's",
                "m/frame^2",
                formula=f"mean over frames and vertices of |D(p) - D(g)| * (fps / 30)^2; {ACCELERATION}; "
                f"{POINTS}",
                source="acc of joints, over vertices",
            ),
            _value(
                "pa_vertex_acc.rigid",
                "PA vertex acceleration error, fit per frame",
                "mean difference of vertex accelerations after a rigid alignment of each frame",
                "m/frame^2",
                formula="mean over frames and vertices of |D(R p + t) - D(g)| * (fps / 30)^2, R and t of "
                f"each frame as in pa_mpvd.rigid; {ACCELERATION}; {POINTS}",
                source="pa_acc.rigid of joints, over vertices",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out without a reference, and where vertices of either side are not known."""
        predicted, expected = comparison.predicted_vertices, comparison.expected_vertices
        if predicted is None or expected is None:
            return {}
        rigid, similar = residuals(predicted, expected)
        metres = {
            "mpvd_h": _mean_length(predicted - expected),
            "pa_mpvd.rigid": rigid,
            "pa_mpvd.similarity": similar,
        }
        reference = comparison.case.reference
        if predicted.shape[1] > NEIGHBOURS and reference is not None:
            metres["medl_h"] = _edge_difference(predicted, expected, _neighbours(reference, expected))
        values = {id_: 100.0 * distance / comparison.height for id_, distance in metres.items()}
        if comparison.frames > 2:
            scale = (comparison.fps / RATE) ** 2
            values["vertex_acc"] = _acceleration(predicted - expected) * scale
            values["pa_vertex_acc.rigid"] = _acceleration(_fitted(predicted, expected) - expected) * scale
        return values


def _mean_length(vectors: np.ndarray) -> float:
    """Mean length of vectors ``(frames, V, 3)``."""
    return float(np.sqrt(squared_length(vectors)).mean())


def _acceleration(error: np.ndarray) -> float:
    """Mean length of second differences of vectors ``(frames, V, 3)``."""
    return _mean_length(error[2:] - 2.0 * error[1:-1] + error[:-2])


def _fitted(moving: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """Each frame's vertices ``(frames, V, 3)`` where its best rigid fit puts them."""
    turn, _ = fits(moving, fixed)
    centred = moving - moving.mean(axis=1, keepdims=True)
    return centred @ turn.transpose(0, 2, 1) + fixed.mean(axis=1, keepdims=True)


def _edge_difference(predicted: np.ndarray, expected: np.ndarray, neighbours: np.ndarray) -> float:
    """Metres: mean difference of edge lengths, from every vertex to its neighbours ``(frames, V, 6)``."""
    total = 0.0
    for p, g, near in zip(predicted, expected, neighbours, strict=True):
        lengths = [np.sqrt(squared_length(x[near] - x[:, None])) for x in (p, g)]
        total += float(np.abs(lengths[0] - lengths[1]).mean())
    return total / len(predicted)


_cache: WeakKeyDictionary[Prediction, np.ndarray] = WeakKeyDictionary()
"""Neighbours in a reference, which all methods are compared with."""


def _neighbours(reference: Prediction, vertices: np.ndarray) -> np.ndarray:
    """``(frames, V, 6)`` the nearest other vertices of every vertex ``(frames, V, 3)``."""
    if (neighbours := _cache.get(reference)) is None:
        neighbours = np.stack([_nearest(frame) for frame in vertices])
        _cache[reference] = neighbours
    return neighbours


def _nearest(points: np.ndarray) -> np.ndarray:
    """``(V, 6)`` the nearest others of points ``(V, 3)``, by number; of points that coincide too."""
    # not imported with the metric: every run lists all metrics
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    near = cKDTree(points).query(points, k=NEIGHBOURS + 1)[1]
    own = near == np.arange(len(points))[:, None]
    # among points that coincide a point need not be its own first neighbour, nor among the first at all
    own[~own.any(axis=1), NEIGHBOURS] = True
    return near[~own].reshape(len(points), NEIGHBOURS).astype(np.int32)


plugin = VertexError
