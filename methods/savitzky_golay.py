"""Fits a polynomial to every joint's place around each frame; for source and target of one body."""

import math

from retarget_bench.api import Context, Method, MethodCard, Prediction
from retarget_bench.errors import BenchError
from retarget_bench.motion import transfer
from retarget_bench.motion.character import Character, Positions

RATE = 30.0
"""Frames per second that ``window`` is counted at."""


class SavitzkyGolay(Method):
    """Least-squares polynomials over a moving window (Savitzky and Golay 1964): unlike plain averages they
    keep the height of peaks, and leave any polynomial of their order alone, at the ends too.

    window: frames of 30 per second, odd; other rates take as many seconds. A shorter clip is one window.
    order: of the polynomials.
    """

    def __init__(self, window: int = 21, order: int = 2) -> None:
        if window < 1 or window % 2 == 0:
            raise BenchError(f"savitzky_golay: window is an odd number of frames; got {window}")
        if not 0 <= order < window:
            raise BenchError(
                f"savitzky_golay: order is zero or more and less than window ({window}); got {order}"
            )
        self.window, self.order = window, order
        self.card = MethodCard(
            name="savitzky_golay",
            summary="Polynomials fitted to every joint's place over a moving window",
            version="1",
            accepts=("motion", "positions"),
            tasks=("denoise",),
            parameters={
                "window": "frames of 30 per second that each polynomial is fitted to, odd",
                "order": "of the polynomials, less than window",
            },
        )

    def supports(self, source: Character, target: Character) -> str | None:
        return transfer.another_skeleton("filters the source", source, target)

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Positions:
        from scipy.signal import savgol_filter  # type: ignore[import-untyped]

        frames = 2 * math.floor(self.window * source.fps / RATE / 2) + 1  # lasts as long at any rate
        window = min(frames, source.frames - (source.frames + 1) % 2)  # odd
        if window <= self.order:  # any such polynomial goes through all frames
            return target.positions(source.positions, source.fps)
        smooth = savgol_filter(source.positions, window, self.order, axis=0, mode="interp")
        return target.positions(smooth, source.fps)


plugin = SavitzkyGolay
