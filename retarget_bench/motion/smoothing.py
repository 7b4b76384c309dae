"""Moving averages over time."""

import math

import numpy as np

REACH = 4.0
"""Standard deviations after which weights are left out."""


def averaged(values: np.ndarray, width: float) -> np.ndarray:
    """``(frames, ...)`` values averaged over frames with Gaussian weights of standard deviation ``width``.

    Beyond the ends they go on as their mirror image through the first and the last.
    """
    from scipy.ndimage import gaussian_filter1d  # type: ignore[import-untyped]

    reach = math.ceil(REACH * width)
    if reach < 1 or len(values) < 2:
        return values
    around = ((reach, reach), *((0, 0) for _ in values.shape[1:]))
    longer = np.pad(values, around, mode="reflect", reflect_type="odd")
    smooth = gaussian_filter1d(longer, width, axis=0, mode="nearest", truncate=REACH)
    return np.asarray(smooth[reach:-reach])
