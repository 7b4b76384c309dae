"""Joints of a body whose surface alone is known: rigid motions of its flesh, by skinning backwards."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton

_SHARPNESS = 4
"""Power of the skinning weights at first: vertices that a joint moves alone show where it is."""
_FEWEST = 1e-3
"""Sum of squared weights below which a joint has no flesh of its own, and follows its parent."""
_HOLD, _ROUNDS = 0.05, 6
"""Weight of the rigid motions found so far, against vertices that nearby joints share; and rounds. Of the
puppets' own surfaces, joints are then found within a millimetre; with less weight, surfaces that no
skinning gives bring joints far away."""


def joint_positions(mesh: Mesh, skeleton: Skeleton, vertices: np.ndarray) -> np.ndarray:
    """``(frames, joints, 3)`` metres: the joints under moving vertices ``(frames, V, 3)`` of a mesh.

    First each joint's flesh is fitted rigidly (Kabsch 1976), by powers of the skinning weights. Then, by
    turns, the transforms that bring linear blend skinning nearest to the vertices are solved for, all
    joints together and held near the rigid ones, and each is made rigid again. A joint is midway between
    where its own flesh and its parent's carry it. One without flesh follows its parent.
    """
    flesh = _flesh(mesh, skeleton)
    middle = vertices.mean(axis=1, keepdims=True)
    moved = (vertices - middle).transpose(1, 0, 2).reshape(len(mesh.vertices), -1)  # (V, frames * 3)
    found = _rigid(_by_frame(flesh.sharp.T @ moved), flesh.sharp_sums)
    wanted = flesh.shares.T @ moved
    for _ in range(_ROUNDS):
        held = found.transpose(1, 2, 0, 3).reshape(wanted.shape)
        free = _by_frame(flesh.solved @ (wanted + flesh.hold @ held))
        found = _rigid(flesh.sums @ free, flesh.sums)
    own, above = (np.einsum("jb,fjbc->fjc", of.places, found[:, of.carriers]) for of in flesh.carried)
    return middle + (own + above) / 2


@dataclass(frozen=True, eq=False)
class _Carried:
    """carriers: ``(joints,)`` whose flesh carries each joint; places: ``(joints, 4)`` in its frame."""

    carriers: np.ndarray
    places: np.ndarray


@dataclass(frozen=True, eq=False)
class _Flesh:
    """What does not depend on the motion, of ``k`` joints with flesh of their own.

    Points are ``(x, y, z, 1)`` around the middle of each joint's flesh, so that a transform is ``(4, 3)``.
    shares, sharp: ``(V, 4k)`` points times weights, and times weights to the power ``_SHARPNESS``.
    sums, sharp_sums: ``(k, 4, 4)`` sums of the points' products, by squared weights and by such powers.
    solved: ``(4k, 4k)`` the inverse of all products, with what holds the transforms. hold: that.
    carried: by a joint's own flesh, and by its parent's.
    """

    shares: np.ndarray
    sharp: np.ndarray
    sums: np.ndarray
    sharp_sums: np.ndarray
    solved: np.ndarray
    hold: np.ndarray
    carried: tuple[_Carried, _Carried]


@lru_cache(maxsize=16)
def _flesh(mesh: Mesh, skeleton: Skeleton) -> _Flesh:
    carriers = _carriers(mesh, skeleton)
    kept, of = np.unique(carriers, return_inverse=True)
    weights = np.zeros((len(mesh.weights), len(kept)))
    np.add.at(weights.T, of, mesh.weights.T)
    squares = weights**2
    middles = (squares.T @ mesh.vertices) / np.maximum(squares.sum(axis=0), _FEWEST)[:, None]
    points = np.concatenate(
        [mesh.vertices[:, None] - middles, np.ones((*weights.shape, 1))], axis=2
    )  # (V, k, 4)
    shares = (weights[..., None] * points).reshape(len(weights), -1)
    sharp = weights[..., None] ** _SHARPNESS * points
    sums = np.einsum("vka,vkb->kab", squares[..., None] * points, points, optimize=True)
    hold = np.zeros((4 * len(kept),) * 2)
    for k, each in enumerate(sums):
        hold[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = _HOLD * (each + 1e-9 * np.trace(each) * np.eye(4))
    bound = mesh.bound(skeleton)[0]
    above = of[np.maximum(skeleton.parents, 0)]
    return _Flesh(
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
    """``(joints,)`` the joint whose flesh each moves with: itself, or the next one above that has flesh;
    of a root without any, the first one."""
    fleshed = (mesh.weights**2).sum(axis=0) >= _FEWEST
    first = int(np.argmax(fleshed))
    found = np.arange(len(skeleton))
    for joint, parent in enumerate(skeleton.parents.tolist()):
        if not fleshed[joint]:
            found[joint] = found[parent] if parent >= 0 else first
    return found


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
    found = np.empty_like(moments)
    found[:, :, :3] = np.swapaxes(turns, -1, -2)
    found[:, :, 3] = images - np.einsum("fkab,kb->fka", turns, middles)
    return found


def _rotations(moments: np.ndarray) -> np.ndarray:
    """``(..., 3, 3)`` the proper rotations R that bring x nearest to y, of sums of x y'."""
    u, _, vt = np.linalg.svd(moments)
    flip = np.linalg.det(u) * np.linalg.det(vt)
    u[..., :, 2] *= flip[..., None]
    return np.swapaxes(u @ vt, -1, -2)
