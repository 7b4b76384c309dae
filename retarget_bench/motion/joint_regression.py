"""Joints of a body whose surface alone is known: rigid motions of its vertices, by skinning backwards."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton

_SHARPNESS = 4
"""Power of the skinning weights at first: vertices that a joint moves alone show where it is."""
_FEWEST = 1e-3
"""Sum of squared weights below which a joint has no vertices of its own, and follows its parent."""
_HOLD, _ROUNDS = 0.05, 6
"""Weight of the rigid motions found so far, against vertices that nearby joints share; and rounds. Of the
puppets' own surfaces, joints are then found within a millimetre; with less weight, surfaces that no
skinning gives bring joints far away."""


def joint_positions(mesh: Mesh, skeleton: Skeleton, vertices: np.ndarray) -> np.ndarray:
    """``(frames, joints, 3)`` metres: the joints under moving vertices ``(frames, V, 3)`` of a mesh.

    First each joint's vertices are fitted rigidly (Kabsch 1976), by powers of the skinning weights. Then,
    by turns, the transforms that bring linear blend skinning nearest to the vertices are solved for, all
    joints together and held near the rigid ones, and each is made rigid again. A joint is midway between
    where its own vertices and its parent's carry it. One without vertices follows its parent.
    """
    regression = _regression(mesh, skeleton)
    middle = vertices.mean(axis=1, keepdims=True)
    moved = (vertices - middle).transpose(1, 0, 2).reshape(len(mesh.vertices), -1)  # (V, frames * 3)
    transforms = _rigid(_by_frame(regression.sharp.T @ moved), regression.sharp_sums)
    moments = regression.shares.T @ moved
    for _ in range(_ROUNDS):
        held = transforms.transpose(1, 2, 0, 3).reshape(moments.shape)
        free = _by_frame(regression.solved @ (moments + regression.hold @ held))
        transforms = _rigid(regression.sums @ free, regression.sums)
    own, above = (
        np.einsum("jb,fjbc->fjc", of.places, transforms[:, of.carriers]) for of in regression.carried
    )
    return middle + (own + above) / 2


@dataclass(frozen=True, eq=False)
class _Carried:
    """carriers: ``(joints,)`` whose vertices carry each joint; places: ``(joints, 4)`` in its frame."""

    carriers: np.ndarray
    places: np.ndarray


@dataclass(frozen=True, eq=False)
class _Regression:
    """The parts of the regression that no motion changes, of ``k`` joints with vertices of their own.

    Points are ``(x, y, z, 1)`` around the middle of each joint's vertices: a transform is ``(4, 3)``.
    shares, sharp: ``(V, 4k)`` points times weights, and times weights to the power ``_SHARPNESS``.
    sums, sharp_sums: ``(k, 4, 4)`` sums of the points' products, by squared weights and by such powers.
    solved: ``(4k, 4k)`` the inverse of all products, with what holds the transforms. hold: that.
    carried: by a joint's own vertices, and by its parent's.
    """

    shares: np.ndarray
    sharp: np.ndarray
    sums: np.ndarray
    sharp_sums: np.ndarray
    solved: np.ndarray
    hold: np.ndarray
    carried: tuple[_Carried, _Carried]


@lru_cache(maxsize=16)
def _regression(mesh: Mesh, skeleton: Skeleton) -> _Regression:
    carriers = _carriers(mesh, skeleton)
    unique, of = np.unique(carriers, return_inverse=True)
    weights = np.zeros((len(mesh.weights), len(unique)))
    np.add.at(weights.T, of, mesh.weights.T)
    squares = weights**2
    middles = (squares.T @ mesh.vertices) / np.maximum(squares.sum(axis=0), _FEWEST)[:, None]
    points = np.concatenate(
        [mesh.vertices[:, None] - middles, np.ones((*weights.shape, 1))], axis=2
    )  # (V, k, 4)
    shares = (weights[..., None] * points).reshape(len(weights), -1)
    sharp = weights[..., None] ** _SHARPNESS * points
    sums = np.einsum("vka,vkb->kab", squares[..., None] * points, points, optimize=True)
    hold = np.zeros((4 * len(unique),) * 2)
    for k, each in enumerate(sums):
        hold[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = _HOLD * (each + 1e-9 * np.trace(each) * np.eye(4))
    bound = mesh.bound(skeleton)[0]
    above = of[np.maximum(skeleton.parents, 0)]
    return _Regression(
        shares,
        sharp.reshape(len(weights), -1),
        sums,
        np.einsum("vka,vkb->kab", sharp, points, optimize=True),
        np.linalg.inv(shares.T @ shares + hold),
        hold,
        (_carried(bound, middles, of), _carried(bound, middles, above)),
    )


def _carried(bound: np.ndarray, middles: np.ndarray, carriers: np.ndarray) -> _Carried:
    places = np.concatenate([bound - middles[carriers], np.ones((len(bound), 1))], axis=1)
    return _Carried(carriers, places)


def _carriers(mesh: Mesh, skeleton: Skeleton) -> np.ndarray:
    """``(joints,)`` the joint whose vertices each moves with: itself, or the next one above that has some;
    of a root without any, the first one."""
    has_vertices = (mesh.weights**2).sum(axis=0) >= _FEWEST
    first = int(np.argmax(has_vertices))
    carriers = np.arange(len(skeleton))
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if not has_vertices[joint]:
            carriers[joint] = carriers[parent] if parent >= 0 else first
    return carriers


def _by_frame(columns: np.ndarray) -> np.ndarray:
    """``(frames, k, 4, 3)`` of ``(4k, frames * 3)``."""
    return columns.reshape(len(columns) // 4, 4, -1, 3).transpose(2, 0, 1, 3)


def _rigid(moments: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """``(frames, k, 4, 3)`` the rigid transforms nearest to moments ``(frames, k, 4, 3)`` of points with
    their images, where ``sums`` ``(k, 4, 4)`` are those of the points with themselves."""
    total = np.maximum(sums[:, 3, 3], 1e-300)
    middles = sums[:, :3, 3] / total[:, None]  # of the points
    images = moments[:, :, 3] / total[:, None]
    around = moments[:, :, :3] - sums[:, :3, 3, None] * images[:, :, None]
    turns = _rotations(around)
    transforms = np.empty_like(moments)
    transforms[:, :, :3] = np.swapaxes(turns, -1, -2)
    transforms[:, :, 3] = images - np.einsum("fkab,kb->fka", turns, middles)
    return transforms


def _rotations(moments: np.ndarray) -> np.ndarray:
    """``(..., 3, 3)`` the proper rotations R that bring x nearest to y, of sums of x y'."""
    u, _, vt = np.linalg.svd(moments)
    flip = np.linalg.det(u) * np.linalg.det(vt)
    u[..., :, 2] *= flip[..., None]
    return np.swapaxes(u @ vt, -1, -2)
