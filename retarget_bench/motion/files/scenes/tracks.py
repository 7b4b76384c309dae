"""The change of one property of one node over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import rotation


@dataclass(frozen=True, eq=False)
class Track:
    """The values of one property of one node over time (interpolation as in glTF 2.0, appendix C).

    path:   translation, rotation (w first) or scale.
    times:  ``(keys,)`` seconds, ascending.
    values: ``(keys, width)``; with CUBICSPLINE ``(keys, 3, width)``: in-tangent, value, out-tangent.
    """

    node: int
    path: str
    times: np.ndarray
    values: np.ndarray
    interpolation: str

    @property
    def keyed(self) -> np.ndarray:
        """``(keys, width)`` the values at the keys."""
        return self.values[:, 1] if self.interpolation == "CUBICSPLINE" else self.values

    def at(self, times: np.ndarray) -> np.ndarray:
        """``(frames, width)`` at times ``(frames,)``; beyond the keys the first and last value."""
        if self.interpolation != "CUBICSPLINE" and np.array_equal(times, self.times):
            return self._normalised(self.values)
        low = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 1)
        if self.interpolation == "STEP":
            return self._normalised(self.values[low])
        high = np.minimum(low + 1, len(self.times) - 1)
        span = self.times[high] - self.times[low]
        share = np.clip((times - self.times[low]) / np.where(span > 0, span, 1.0), 0.0, 1.0)
        if self.interpolation == "CUBICSPLINE":
            return self._normalised(self._spline(low, high, share[:, None], span[:, None]))
        if self.path == "rotation":
            values = self._normalised(self.values)
            return rotation.slerp(values[low], values[high], share)
        return self.values[low] + share[:, None] * (self.values[high] - self.values[low])

    def _spline(self, low: np.ndarray, high: np.ndarray, t: np.ndarray, span: np.ndarray) -> np.ndarray:
        """Appendix C.4: a cubic Hermite spline with tangents per second."""
        square, cube = t * t, t * t * t
        values: np.ndarray = (
            (2 * cube - 3 * square + 1) * self.values[low, 1]
            + span * (cube - 2 * square + t) * self.values[low, 2]
            + (3 * square - 2 * cube) * self.values[high, 1]
            + span * (cube - square) * self.values[high, 0]
        )
        return values

    def _normalised(self, values: np.ndarray) -> np.ndarray:
        return rotation.normalise(values) if self.path == "rotation" else values
