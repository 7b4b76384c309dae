"""Hands in the rest of the body, where the character has a mesh.

Inside and outside are asked of a coarse mesh: vertices of a cell of a grid that follow the same joint
become one of them (vertex clustering, Rossignac and Borrel 1993). A closed surface stays closed: faces lose
edges in pairs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.penetration import inside, inside_at_rest, limbs
from retarget_bench.motion.penetration.limbs import below, weld
from retarget_bench.motion.roles import SIDES
from retarget_bench.verification.verdict.defects import Defect, defect, stretches
from retarget_bench.verification.verdict.joints import Pair

SAMPLES = 6.0
"""Frames a second that are tested."""
MOST = 400
"""Frames that are tested at most: of longer motions fewer a second."""
SHARE = 0.3
"""Share of a hand's surface that may be inside."""
CELL = 0.03
"""Side of a cell, body heights."""
_BLOCK = 64


def hands(pair: Pair) -> Iterator[Defect]:
    """Stretches in which more of a hand is inside than ``SHARE``, and than of the source's own."""
    result = pair.result
    step = max(1, round(result.fps / SAMPLES), -(-result.frames // MOST))
    frames = np.arange(0, result.frames, step)
    shares = shares_inside(result, frames)
    usual = shares_inside(pair.source, frames) if shares else {}
    for side, share in shares.items():
        source = usual.get(side)
        limit = SHARE + (np.zeros_like(share) if source is None else source)
        for part in stretches(np.repeat(share > limit, step)[: result.frames], result.fps):
            first = part.start // step
            worst = first + int(np.argmax(share[first : -(-part.stop // step)]))
            before = None if source is None else 100 * source[worst]
            beside = "" if before is None else f"; source {before:.0f} %"
            numbers = 100 * share[worst], before, share[worst] / limit[worst]
            yield defect("inside", f"{side} hand", part, int(frames[worst]), *numbers, beside)


def shares_inside(motion: Prediction, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Side -> ``(frames,)`` share of the hand's surface that is inside the body and was not in the
    reference pose, at some frames of a motion; {} without rotations or a mesh."""
    mesh = motion.character.mesh
    if not isinstance(motion, Motion) or mesh is None or not len(mesh.faces):
        return {}
    body = coarse_body(motion.character)
    motion = replace(motion, character=body)
    assert body.mesh is not None
    shares: dict[str, list[np.ndarray]] = {}
    for first in range(0, len(frames), _BLOCK):
        vertices = body.mesh.skinned(motion.at(frames[first : first + _BLOCK]))
        tested = zip(limbs(body), inside(body, vertices), inside_at_rest(body), strict=True)
        for limb, now, rest in tested:
            side, _, part = limb.name.partition("_")
            if part != "arm" or (hand := body.joint_of.get(f"{side}_hand")) is None:
                continue
            weights = body.mesh.weights[limb.tested][:, below(body.skeleton, hand)].sum(axis=1)
            areas = np.where(weights > 0.5, limb.areas, 0.0)
            if areas.sum() > 0:
                shares.setdefault(side, []).append((now & ~rest) @ areas / areas.sum())
    return {side: np.concatenate(shares[side]) for side in SIDES if side in shares}


@lru_cache(maxsize=16)
def coarse_body(body: Character) -> Character:
    """A character with a mesh, of which the mesh is coarse."""
    mesh = body.mesh
    assert mesh is not None
    coarse = clustered(mesh, CELL * body.height)
    return replace(body, skin=lambda: coarse)


def clustered(mesh: Mesh, cell: float) -> Mesh:
    """The mesh with one vertex for all that lie in a cell of this side, metres, and follow one joint."""
    faces = weld(mesh)
    cells = np.floor((mesh.vertices - mesh.vertices.min(axis=0)) / cell).astype(np.int64)
    key = np.column_stack([cells, mesh.weights.argmax(axis=1)])
    _, group = np.unique(key, axis=0, return_inverse=True)
    group = group.reshape(-1)
    chosen = _nearest_to_mean(mesh.vertices, group)
    corners = group[faces]
    kept = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    used, numbers = np.unique(corners[kept], return_inverse=True)
    one = chosen[used]
    return Mesh(mesh.vertices[one], numbers.reshape(-1, 3), mesh.weights[one], mesh.pose)


def _nearest_to_mean(vertices: np.ndarray, group: np.ndarray) -> np.ndarray:
    """``(groups,)`` of each group the vertex that is nearest to the mean of all its own."""
    count = np.bincount(group)
    mean = np.stack([np.bincount(group, axis) for axis in vertices.T], axis=1) / count[:, None]
    order = np.lexsort((np.linalg.norm(vertices - mean[group], axis=1), group))
    return order[np.concatenate([[0], np.cumsum(count)[:-1]])]
