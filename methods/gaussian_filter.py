"""Averages every joint's place over time with Gaussian weights; for source and target of one body."""

import math
from typing import Literal

import numpy as np

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character, Positions
from retarget_bench.motion.smoothing import averaged

AUTO: Literal["auto"] = "auto"
WIDTH = 0.058
"""Seconds at 1 cm of noise and 30 frames per second, chosen on the puppets' validation part."""
_SHARE = 0.6745
"""The median size of a normal variable, in standard deviations."""


class GaussianFilter(Method):
    """A moving average. Wide ones remove more noise and more motion.

    sigma: seconds, standard deviation of the weights; 0 gives the source back. ``auto`` takes it from the
    noise to the power 2/5, which balances the two for smooth motion; the noise is estimated from the median
    size of the source's third differences over time. Beyond its ends a clip goes on as its mirror image
    through the end points, so that steady motion stays as it is.
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
        return transfer.another_skeleton("filters the source", source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        places = source.positions
        if isinstance(self.sigma, str):
            seconds = float(WIDTH * (100.0 * noise(places)) ** 0.4 * (30.0 / source.fps) ** 0.2)
        else:
            seconds = self.sigma
        return target.positions(averaged(places, seconds * source.fps), source.fps)


def noise(places: np.ndarray) -> float:
    """Metres: the standard deviation of what changes from frame to frame without any rule; 0 for clips of
    less than four frames."""
    if len(places) < 4:
        return 0.0
    third = np.diff(places, n=3, axis=0)  # of white noise: its variance times 1 + 9 + 9 + 1
    return float(np.median(np.abs(third)) / (_SHARE * math.sqrt(20.0)))


plugin = GaussianFilter
