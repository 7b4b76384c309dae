"""Unit and up axis of meshes of bodies, which their files lack."""

import math

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.files.reading import UNITS
from retarget_bench.motion.up_axis import UP_AXES

_TALL = 1.7
"""Metres: a usual body, of which frames show the extent along the up axis."""
_LIKELY = {"m": 0.0, "cm": 0.0, "mm": 0.3}
"""Units of scanners and modelling programs; added to the logarithm of a size ratio."""
_SPREAD, _MIRROR = 0.5, 0.02
"""Ratio of the two largest extents from which arms may be spread, and the distance of a body's points from
its mirror image, as a share of its width, below which it is symmetric. Over the puppets' T-poses it is at
most 0.012 along the width, and at least 0.03 along the height in all poses."""
_DOUBTFUL = 0.75
"""Ratio of the two largest extents from which the up axis is a guess where nothing is symmetric."""
_END, _MIDDLE = 0.08, 2.0
"""Share of the height that is feet or the top of a head, and the weight of where half of the surface is."""
_SAMPLE = 500


def unit_of(height: float) -> str:
    """The unit in which a body that is so high in it has a plausible size."""
    cost = {
        unit: abs(math.log(max(height, 1e-12) * UNITS[unit] / _TALL)) + extra
        for unit, extra in _LIKELY.items()
    }
    return min(cost, key=cost.__getitem__)


def up_axis(frames: list[np.ndarray]) -> tuple[str, bool]:
    """The axis that a body stands along, and whether that is clear, from points ``(n, 3)`` of some frames
    that are uniform on its surface.

    Bodies are higher than wide or deep. With spread arms they may be as wide, or wider: then the width is
    the axis along which they are their own mirror image. Feet have more surface than the top of a head, and
    it lies farther apart; and half of a body's surface is above half its height.
    """
    extents = np.median([np.ptp(each, axis=0) for each in frames], axis=0)
    first, second = (int(axis) for axis in np.argsort(-extents)[:2])
    ratio = float(extents[second] / extents[first])
    alike = {
        axis: float(np.median([_mirrored(points, axis) for points in frames])) < _MIRROR * extents[axis]
        for axis in (first, second)
    }
    spread = ratio > _SPREAD and alike[first] != alike[second]
    axis = second if spread and alike[first] else first
    down = np.median([_upside_down(points, axis) for points in frames]) > 0
    return f"{'-' if down else ''}{'xyz'[axis]}", spread or ratio < _DOUBTFUL


def _upside_down(points: np.ndarray, axis: int) -> float:
    """Above 0 where the feet of a body are at the upper end of an axis."""
    heights = points[:, axis] - points[:, axis].min()
    top = heights.max()
    others = np.delete(points, axis, axis=1)
    ends = (others[heights < _END * top], others[heights > (1 - _END) * top])
    feet, head = (len(end) * max(float(np.linalg.norm(end.std(axis=0))), 1e-9) for end in ends)
    return math.log(head / feet) - _MIDDLE * float(np.median(heights) / top - 0.5)


def _mirrored(points: np.ndarray, axis: int) -> float:
    """Mean distance from a body's points to those of its mirror image along an axis."""
    from scipy.spatial import cKDTree  # type: ignore[import-untyped]

    some = points[:: 1 + (len(points) - 1) // _SAMPLE]
    other = some.copy()
    other[:, axis] = points[:, axis].min() + points[:, axis].max() - other[:, axis]
    return float(cKDTree(points).query(other)[0].mean())


def upright(points: np.ndarray, up: str, scale: float) -> np.ndarray:
    """Points ``(n, 3)`` in metres, Y up."""
    if up == "y":
        return points * scale
    turn = rotation.to_matrix(rotation.from_rotation_vector(np.array(UP_AXES[up])))
    rotated: np.ndarray = points @ turn.T * scale
    return rotated
