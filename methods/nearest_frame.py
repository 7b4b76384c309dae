"""Baseline for points: the training pose, copied on the target, whose surface is nearest to the points."""

from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, PointSets, Surface
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import completion, facing, scan_path
from retarget_bench.motion.character import Character

_TURNS = 32
"""Directions that a pose may face."""
_RADII = (0.2, 0.55)
_LEVELS = np.linspace(-0.5, 0.5, 7)
"""Places, statures from the middle of the body, whose distances from the surface describe a pose."""
_BODIES = 8
"""Of the latest so many bodies the poses are kept."""


class NearestFrame(Method):
    """A frame of the training motion for each frame of points, without any model of a body.

    Training motion is copied onto the target (as ``nearest_pose`` does) and skinned. A pose is described by
    the distances from its surface to places on rings around the middle of the body (a basis point set,
    Prokudin et al., ICCV 2019, on rings, so that a pose turned about the vertical axis has the same
    numbers in another order). Of the ``best`` poses and directions by these, the one is taken whose
    vertices are nearest to the points on average. Points are made as tall as the target before; frames are
    independent of each other. Path and height are the points' own, by the ratio of sizes
    (``motion/scan_path.py``).

    poses: how many there are to choose from, evenly over the training clips.
    best:  how many of them are compared point by point.
    """

    def __init__(self, poses: int = 600, best: int = 8) -> None:
        for name, number in (("poses", poses), ("best", best)):
            if number < 1:
                raise BenchError(f"nearest_frame: {name} is one or more; got {number}")
        self.poses, self.best = poses, best
        self._cast: completion.Cast | None = None
        self._albums: OrderedDict[bytes, _Album] = OrderedDict()
        self.card = MethodCard(
            name="nearest_frame",
            summary="The training pose, copied on the target, whose surface is nearest to the points",
            version="1",
            accepts=("points",),
            uses=("training",),
            tasks=("points",),
            parameters={
                "poses": "how many training poses there are to choose from",
                "best": "how many of the nearest by description are compared point by point",
            },
        )

    def supports(self, source: Character, target: Character) -> str | None:
        return None if target.skin is not None else f"{target.name} has no mesh to answer with"

    def retarget(self, source: PointSets, target: Character, *, context: Context) -> Surface:
        """Raises NotSupported where the data set has no training motion that the target could copy."""
        album = self._album(target, context.training)
        ratio = scan_path.ratio(source.points, target)
        poses = np.stack([album.nearest(ratio * frame, self.best) for frame in source.points])
        return target.surface(scan_path.along(poses, source.points, ratio), source.fps)

    def _album(self, target: Character, cast: completion.Cast | None) -> "_Album":
        if cast is not self._cast:  # other motion to choose from
            self._cast = cast
            self._albums.clear()
        body = target.skeleton.offsets.tobytes() + "\n".join((target.name, *target.skeleton.names)).encode()
        if body not in self._albums:
            self._albums[body] = _Album.of(cast, target, self.poses)
        self._albums.move_to_end(body)
        while len(self._albums) > _BODIES:
            self._albums.popitem(last=False)
        return self._albums[body]


@dataclass(frozen=True, eq=False)
class _Album:
    """Poses of one body, facing +Z, their middles at the origin.

    vertices: ``(poses, V, 3)`` metres, single precision. stature: metres.
    described: ``(poses, rings, directions)`` see ``_described``.
    """

    vertices: np.ndarray
    stature: float
    described: np.ndarray

    @classmethod
    def of(cls, cast: completion.Cast | None, target: Character, most: int) -> Self:
        """Raises NotSupported, also where the target has no facing direction."""
        if target.mesh is None or facing.unknown(target):
            raise NotSupported(facing.unknown(target) or f"{target.name} has no mesh to answer with")
        standing = scan_path.standing(target)
        stature, shares = float(np.ptp(standing[:, 1])), _shares(standing, target.mesh.faces)
        chunks = []
        for motion in completion.copied(cast, target, most):
            turn = facing.facing(motion.positions, target)[:, None]
            turned = facing.seen(target.mesh.skinned(motion), turn)
            chunks.append((turned - _middle(turned, shares)[:, None]).astype(np.float32))
        vertices = np.concatenate(chunks)
        return cls(vertices, stature, np.stack([_described(each, stature) for each in vertices]))

    def nearest(self, points: np.ndarray, best: int) -> np.ndarray:
        """``(V, 3)`` metres: the pose, turned, nearest to points ``(points, 3)``."""
        points = points - _middle(points, np.full(len(points), 1.0 / len(points)))
        spectrum = np.fft.rfft(_described(points, self.stature))
        # of a pose turned by k steps the numbers are k places on: all turns by one product of spectra
        each = np.fft.irfft((spectrum * self._spectra.conj()).sum(axis=1), n=_TURNS)
        off = self._squares[:, None] - 2.0 * each
        order = np.argsort(off, axis=None, kind="stable")[:best]
        tried = [self._turned(*divmod(int(at), _TURNS)) for at in order]
        return min(tried, key=lambda vertices: _apart(points, vertices))

    @cached_property
    def _spectra(self) -> np.ndarray:
        return np.fft.rfft(self.described)

    @cached_property
    def _squares(self) -> np.ndarray:
        """``(poses,)``"""
        return np.asarray((self.described**2).sum(axis=(1, 2)))

    def _turned(self, pose: int, step: int) -> np.ndarray:
        return facing.placed(self.vertices[pose], np.exp(2j * np.pi * step / _TURNS))


def _middle(points: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """``(..., 3)`` the middle of points ``(..., n, 3)`` with shares ``(n,)`` of the surface, which turns
    with them about the vertical axis: on the level their mean, in the vertical half way up."""
    mean = np.einsum("...na,n->...a", points, shares)
    mean[..., 1] = scan_path.centre(points)[..., 1]
    return np.asarray(mean)


def _shares(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``(V,)`` each vertex's share of a surface: a third of every triangle around it."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.repeat(np.linalg.norm(np.cross(b - a, c - a), axis=-1), 3)
    shares = np.bincount(faces.ravel(), weights=areas, minlength=len(vertices))
    return np.asarray(shares / shares.sum())


def _described(points: np.ndarray, stature: float) -> np.ndarray:
    """``(rings, directions)`` metres from each place of the rings to the nearest of points ``(points, 3)``
    around the origin."""
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    about = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    rings = [
        np.stack([radius * np.sin(about), np.full(_TURNS, level), radius * np.cos(about)], axis=-1)
        for level in _LEVELS
        for radius in _RADII
    ]
    return np.asarray(cKDTree(points).query(stature * np.stack(rings))[0])


def _apart(points: np.ndarray, vertices: np.ndarray) -> float:
    """Metres from the points to their nearest vertices, on average."""
    from scipy.spatial import cKDTree

    return float(cKDTree(vertices).query(points)[0].mean())


plugin = NearestFrame
