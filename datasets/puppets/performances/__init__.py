"""The kinds of performance: each turns a stream of random numbers and a length into a Score."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..randomness import Stream
from ..score import Score
from .squatting import squat
from .walking import walk
from .waving import wave

KINDS: Mapping[str, Callable[[Stream, int], Score]] = {"walk": walk, "wave": wave, "squat": squat}
"""Kind -> the function that draws one performance of so many frames."""
