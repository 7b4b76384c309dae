"""Self-penetration: share of the limbs' surface that lies inside the rest of the body.

Of no plain run of the main task: it takes some 170 ms a clip of three seconds, beside the skinning, and all
values of joints together 2 to 7. ``bench run --metrics self_penetration`` computes it.

Winding numbers are our own, in NumPy. On puppets libigl's exact ones agree to 1e-9 and are slower where few
points are asked about, which boxes see to; its fast ones were off by up to 0.003. Both need the cuts closed
as ours do: across an open cut the number fades from 1 to 0, and skin at the cut would count.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api import Metric, MetricCard, Prediction, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.api.comparison import vertices as vertices_of
from retarget_bench.motion.character import Character
from retarget_bench.motion.penetration import Limb, inside, inside_at_rest, limbs
from retarget_bench.motion.penetration.distances import deepest

from . import nearest_normal

RATE = 10.0
"""Frames per second that are looked at: what lasts less than a tenth of a second may be missed."""

SHARE = (
    "share: area of the vertices of forearms, hands, shanks and feet (each a third of the faces around it, "
    "mesh as drawn) with w > 1/2, over the area of them all; w: generalised winding number of the body "
    "without that whole limb, from shoulder or hip on, each cut closed by triangles to the middle of its "
    "rim; a vertex belongs to a limb where more than half of its weights do; frames: "
    f"{RATE:g} per second; left out for bodies without roles of limbs"
)
WINDING = (
    "the project's definition; generalised winding numbers after Jacobson et al. 2013 (Robust inside-"
    "outside segmentation using generalized winding numbers)"
)
STAR = (
    "vertices of a limb (arm without shoulder, leg without thigh), each of the joint of its largest "
    f"weight; n: nearest vertex of the body without that limb; N: normal at n; frames: {RATE:g} per second"
)
_value = partial(Value, better="lower", needs=("mesh",), tolerance=1e-2)
_share = partial(_value, unit="% of limb area", source=WINDING, most=100.0)


class SelfPenetration(Metric):
    """Limbs in the rest of the body, by winding number; and the published test, which errs at rest.

    Upper arms and thighs are never tested, and no limb is tested against itself: skin that folds at a
    shoulder, hip, elbow or knee is no penetration.
    """

    card = MetricCard(
        name="self_penetration",
        summary="self-penetration: limbs inside the rest of the body",
        version="1",
        tasks=("points",),
        values=(
            _share(
                "self_penetration",
                "self-penetration",
                "share of the surface of the lower limbs inside the rest of the body",
                formula=f"100 * mean over frames of share; {SHARE}",
            ),
            _share(
                "self_penetration.over_rest",
                "self-penetration over rest",
                "the same without the vertices that are inside in the T-pose already",
                formula="as self_penetration, of vertices with w <= 1/2 in the common reference pose",
            ),
            _share(
                "self_penetration.over_reference",
                "self-penetration over reference",
                "by how much more of the lower limbs is inside the body than of the reference's",
                formula="100 * mean over frames of max(0, share of the prediction - share of the "
                f"reference); {SHARE}",
                needs=("reference", "mesh"),
            ),
            _value(
                "self_penetration.depth_h",
                "self-penetration depth",
                "depth of the deepest limb vertex in the rest of the body, mean over frames",
                unit="% of height",
                formula="100 * mean over frames of depth / h; depth: distance from the surface of the rest "
                "of the body of the vertex with w > 1/2 that is farthest from it, 0 where none is inside; "
                "vertices, w and frames as in self_penetration",
                source=WINDING,
            ),
            _value(
                "star_penetration",
                "penetration rate by normals",
                "share of limb vertices behind the nearest body vertex's tangent plane; wrong at rest",
                unit="% of limb vertices",
                formula=f"100 * share of limb vertices v and frames with (n - v) . N > 0; {STAR}",
                source="STaR's penetration rate. Not to be read alone: next to a limb the nearest vertex "
                "often faces away from it, so that bodies at rest have up to 58 %",
                most=100.0,
            ),
            _value(
                "star_penetration.rest",
                "penetration rate by normals, T-pose",
                "the same test on the target's T-pose, where nothing is inside",
                unit="% of limb vertices",
                better="none",
                formula="as star_penetration, of the target in the common reference pose",
                source="what star_penetration says where no limb is near the body",
                least=0.0,
                most=100.0,
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out where vertices are not known, and for bodies without limbs."""
        body, predicted = comparison.target, comparison.predicted_vertices
        if predicted is None:
            return {}
        step = max(round(comparison.fps / RATE), 1)
        values = _legacy(body, predicted[::step])
        parts = limbs(body)
        if not parts:
            return values
        masks = inside(body, predicted[::step])
        share = _shares(parts, masks)
        beyond = [each & ~rest for each, rest in zip(masks, inside_at_rest(body), strict=True)]
        depth = float(np.mean(_depths(parts, masks, predicted[::step])))
        values |= {
            "self_penetration": float(share.mean()),
            "self_penetration.over_rest": float(_shares(parts, beyond).mean()),
            "self_penetration.depth_h": 100.0 * depth / comparison.height,
        }
        true = _reference_shares(comparison, step)
        if true is not None:
            values["self_penetration.over_reference"] = float(np.maximum(share - true, 0.0).mean())
        return values


def _shares(parts: Sequence[Limb], masks: Sequence[np.ndarray]) -> np.ndarray:
    """``(frames,)`` per cent of the area of all limbs that is inside."""
    areas = np.concatenate([limb.areas for limb in parts])
    return np.asarray(100.0 * (np.concatenate(masks, axis=1) @ areas) / areas.sum())


def _depths(parts: Sequence[Limb], masks: Sequence[np.ndarray], vertices: np.ndarray) -> np.ndarray:
    """``(frames,)`` metres from the surface to the deepest vertex that is inside."""
    depths = np.zeros(len(vertices))
    for limb, hits in zip(parts, masks, strict=True):
        for frame in np.flatnonzero(hits.any(axis=1)):
            points = vertices[frame, limb.tested[hits[frame]]]
            depths[frame] = max(depths[frame], deepest(points, vertices[frame], limb.faces))
    return depths


@lru_cache(maxsize=256)
def _standing(body: Character) -> np.ndarray:
    """``(1, V, 3)`` the vertices in the common reference pose."""
    vertices = vertices_of(body.motion(body.reference_pose[None], np.zeros((1, 3)), RATE), body)
    assert vertices is not None
    return vertices


_cache: WeakKeyDictionary[Prediction, np.ndarray] = WeakKeyDictionary()
"""Shares of references, which all methods are compared with."""


def _reference_shares(comparison: Comparison, step: int) -> np.ndarray | None:
    """``(frames,)`` per cent, of the reference; None without one."""
    reference = comparison.case.reference
    if reference is None:
        return None
    if (shares := _cache.get(reference)) is None:
        vertices, body = comparison.expected_vertices, comparison.target
        if vertices is None:
            return None
        shares = _shares(limbs(body), inside(body, vertices[::step]))
        _cache[reference] = shares
    return shares


def _legacy(body: Character, vertices: np.ndarray) -> dict[str, float]:
    rate, rest = nearest_normal.rate(body, vertices), _rate_at_rest(body)
    if rate is None or rest is None:
        return {}
    return {"star_penetration": 100.0 * rate, "star_penetration.rest": 100.0 * rest}


@lru_cache(maxsize=256)
def _rate_at_rest(body: Character) -> float | None:
    return nearest_normal.rate(body, _standing(body))


plugin = SelfPenetration
