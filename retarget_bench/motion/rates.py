"""Other rates than the 30 frames per second of learned methods: there, up to a clip's end, and back."""

import numpy as np

from retarget_bench.motion.character import Motion, Prediction

FPS = 30.0
ROUNDED = 1e-3 * (1 + 1e-6)
"""Rates in files are rounded, 29.97 for 30: ratios this close to a whole one, 0.1 %, are taken to be it."""


def at_thirty(source: Prediction) -> Prediction:
    """A source at 30 frames per second, up to its last frame or just beyond it, where it stands still."""
    return at(source, covering(source.frames, source.fps), FPS)


def at(source: Prediction, frames: int, fps: float) -> Prediction:
    """A number of frames of a source at another rate: slerp for rotations, linear for places."""
    return source.between(*between(frames, fps, source.fps, source.frames), fps)


def back(motion: Motion, source: Prediction) -> Motion:
    """A motion at 30 frames per second with the source's rate and number of frames."""
    if source.fps == FPS and motion.frames == source.frames:
        return motion
    return motion.between(*between(source.frames, source.fps, FPS, motion.frames), source.fps)


def covering(frames: int, fps: float) -> int:
    """The number of frames at 30 per second that reach the end of so many at ``fps``."""
    return int(np.ceil((frames - 1) * _ratio(FPS, fps) - 1e-6)) + 1


def between(frames: int, fps: float, of: float, available: int) -> tuple[np.ndarray, np.ndarray]:
    """For every frame at rate ``fps``: the last of the ``available`` frames at rate ``of`` that is not
    after it, and the share of the way to the next."""
    place = np.minimum(np.arange(frames) * _ratio(of, fps), available - 1)
    low = np.floor(place + 1e-9).astype(int)
    share = place - low
    return low, np.where(share > 1e-9, share, 0.0)


def _ratio(a: float, b: float) -> float:
    """a / b, or the whole ratio that it is close to."""
    for ratio in (a / b, b / a):
        if abs(ratio - round(ratio)) <= ROUNDED * round(ratio):
            return float(round(ratio)) if ratio == a / b else 1.0 / round(ratio)
    return a / b
