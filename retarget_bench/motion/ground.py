"""The floor of a case, its height under a place, and the floor that a motion shows."""

from dataclasses import dataclass

import numpy as np

from retarget_bench.errors import BenchError
from retarget_bench.motion import contact

_DEEP = 0.15
"""Body heights that nobody is in the floor: one that is deeper stands on another."""


@dataclass(frozen=True)
class Ground:
    """The floor of a case: flat at ``height`` metres, or a height field.

    A height field is ``heights`` ``(rows, columns)`` metres over a grid with ``spacing`` metres between
    samples, whose first sample lies at ``origin`` = (x, z); rows run along z, columns along x.
    """

    height: float = 0.0
    heights: np.ndarray | None = None
    origin: tuple[float, float] = (0.0, 0.0)
    spacing: float = 1.0


FLAT = Ground()
"""The floor at height 0."""


def ground_height(ground: Ground, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """``(...)`` metres: the floor under the places x, z ``(...)`` metres.

    A height field is read bilinearly between its samples; beyond its edge the nearest edge goes on.
    Raises BenchError when the field is not a grid of finite numbers with a positive spacing.
    """
    if ground.heights is None:
        return np.full(np.broadcast_shapes(np.shape(x), np.shape(z)), float(ground.height))
    heights = np.asarray(ground.heights, dtype=np.float64)
    if heights.ndim != 2 or heights.size == 0 or not np.isfinite(heights).all() or not ground.spacing > 0:
        raise BenchError(
            f"a height field needs finite heights (rows, columns) and a positive spacing; "
            f"got {heights.shape} and {ground.spacing}"
        )
    column, right = _cell(x, ground.origin[0], ground.spacing, heights.shape[1])
    row, up = _cell(z, ground.origin[1], ground.spacing, heights.shape[0])
    next_row = np.minimum(row + 1, heights.shape[0] - 1)
    next_column = np.minimum(column + 1, heights.shape[1] - 1)
    near = heights[row, column] * (1 - right) + heights[row, next_column] * right
    far = heights[next_row, column] * (1 - right) + heights[next_row, next_column] * right
    return np.asarray(near * (1 - up) + far * up)


def lower(level: float, soles: np.ndarray, height: float) -> np.ndarray:
    """``(frames,)`` bool: where feet are so far below a level that they stand, or land, on another floor.

    level: metres, of the floor that they stand on otherwise. soles: ``(frames,)`` metres, their lowest.
    height: metres, of the body.
    """
    return np.asarray(soles < level - _DEEP * height)


def shown(level: float, soles: np.ndarray, elsewhere: np.ndarray) -> np.ndarray:
    """``(frames,)`` metres: the floor that feet show, at one level, and elsewhere as deep as they come.

    So it is below a ledge on which somebody stands and from which he jumps, however briefly he lands.
    level, soles: as of ``lower``. elsewhere: ``(frames,)`` bool, of the source, what that gives.
    """
    floor = np.full(len(soles), level)
    for first, past in contact.runs(elsewhere).tolist():
        floor[first:past] = soles[first:past].min()
    return floor


def _cell(at: np.ndarray, origin: float, spacing: float, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """The sample at or before a place, and the share of the way to the next."""
    place = np.clip((np.asarray(at, dtype=np.float64) - origin) / spacing, 0.0, samples - 1)
    sample = np.floor(place).astype(int)
    return sample, place - sample
