"""Averages every joint's place over time with Gaussian weights; for source and target of one body."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from retarget_bench.api import Context, MethodCard, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions

if TYPE_CHECKING:
    import numpy as np

AUTO: Literal["auto"] = "auto"
REACH = 4.0
"""Standard deviations after which weights are left out."""
WIDTH = 0.058
"""Seconds at 1 cm of noise and 30 frames per second, chosen on the puppets' validation part."""
_SHARE = 0.6745
"""The median size of a normal variable, in standard deviations."""


class GaussianFilter:
    """The plainest filter there is. Wide ones remove more noise and more motion.

    sigma: seconds, standard deviation of the weights; 0 gives the source back. ``auto`` makes it wider
    where there is more noise, by its power 2/5 (what balances the two for smooth motion). The noise is told
    from the source alone, by the median size of the third differences over time. Beyond its ends a clip is
    taken to go on as its mirror image through the end points, so that steady motion stays as it is.
    """

    def __init__(self, sigma: float | Literal["auto"] = AUTO) -> None:
        if isinstance(sigma, str) and sigma != AUTO:
            raise BenchError(f"gaussian_filter: sigma is a number of seconds, or {AUTO}; got {sigma!r}")
        if not isinstance(sigma, str) and not 0.0 <= sigma <= 10.0:
            raise BenchError(f"gaussian_filter: sigma is in seconds, from 0 to 10; got {sigma:g}")
        self.sigma = sigma
        self.card = MethodCard(
            name="gaussian_filter",
            summary="Every joint's place averaged over time with Gaussian weights",
            version="1",
            accepts=("motion", "positions"),
            tasks=("denoise",),
            parameters={"sigma": "standard deviation of the weights in seconds, or auto: by the noise"},
        )

    def supports(self, source: Character, target: Character) -> str | None:
        if source.skeleton.same_as(target.skeleton):
            return None
        return f"filters the source, and {target.name} has another skeleton than {source.name}"

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        import numpy as np
        from scipy.ndimage import gaussian_filter1d  # type: ignore[import-untyped]

        places = source.positions
        seconds = _fitting(places, source.fps) if isinstance(self.sigma, str) else self.sigma
        width = seconds * source.fps
        reach = math.ceil(REACH * width)
        if reach < 1 or source.frames < 2:
            return target.positions(places, source.fps)
        longer = np.pad(places, ((reach, reach), (0, 0), (0, 0)), mode="reflect", reflect_type="odd")
        smooth = gaussian_filter1d(longer, width, axis=0, mode="nearest", truncate=REACH)
        return target.positions(smooth[reach:-reach], source.fps)


def _fitting(places: np.ndarray, fps: float) -> float:
    """Seconds: the width for the noise that these places ``(frames, joints, 3)`` seem to have."""
    return float(WIDTH * (100.0 * noise(places)) ** 0.4 * (30.0 / fps) ** 0.2)


def noise(places: np.ndarray) -> float:
    """Metres: the standard deviation of what changes from frame to frame without any rule; 0 for clips of
    less than four frames."""
    import numpy as np

    if len(places) < 4:
        return 0.0
    third = np.diff(places, n=3, axis=0)  # of white noise: its variance times 1 + 9 + 9 + 1
    return float(np.median(np.abs(third)) / (_SHARE * math.sqrt(20.0)))


plugin = GaussianFilter
