"""Position errors per second of a clip: whether the error of a method grows with time."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison

SECONDS = (
    "of every whole second the mean over its frames: frame t lasts from t / fps to (t + 1) / fps and "
    "belongs to the second that its middle is in; what follows the last whole second is left out; the "
    "index is the second's end, 1 being the first"
)


def _value(kind: str, label: str, meaning: str) -> Value:
    return Value(
        id=f"growth.{kind}",
        label=label,
        meaning=meaning,
        unit="% of height",
        better="lower",
        formula=f"mpjpe_h.{'root' if kind == 'pose' else kind}, {SECONDS}",
        source="ours: papers on recurrent methods say that errors accumulate, and print no curve",
        index="second",
    )


class Growth(Metric):
    """The primary position errors as curves over time."""

    card = MetricCard(
        name="growth",
        summary="position errors over time, as curves over the seconds of a clip",
        version="1",
        values=(
            _value(
                "world",
                "MPJPE over time",
                "mean joint position error in each second, with root translation",
            ),
            _value(
                "pose",
                "MPJPE over time, root-aligned",
                "mean joint position error in each second, relative to the root",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, Mapping[str, float]]:
        """Left out without a reference, and for clips shorter than a second."""
        by_id = {"growth.world": comparison.distances, "growth.pose": comparison.centred_distances}
        scale = 100.0 / comparison.height
        curves = {
            id_: by_second(scale * distances[:, comparison.joints].mean(axis=1), comparison.fps)
            for id_, distances in by_id.items()
            if distances is not None
        }
        return {id_: curve for id_, curve in curves.items() if curve}


def by_second(numbers: np.ndarray, fps: float) -> dict[str, float]:
    """End of the second -> mean of the numbers ``(frames,)`` of its frames, for every whole second.

    A second that holds no frame's middle (below one frame per second) is left out.
    """
    at = np.floor((np.arange(len(numbers) + 1) + 0.5) / fps).astype(int)
    seconds = int(at[-1])  # where a frame more would be: the seconds before it have all their frames
    inside = at[:-1] < seconds
    counts = np.bincount(at[:-1][inside], minlength=seconds).tolist()
    totals = np.bincount(at[:-1][inside], numbers[inside], seconds).tolist()
    pairs = enumerate(zip(totals, counts, strict=True), 1)
    return {str(second): total / count for second, (total, count) in pairs if count}


plugin = Growth
