"""One line that says what the metric measures; bench list shows it."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison


class MyMetric(Metric):
    """Height of the head, compared with the reference."""

    card = MetricCard(
        name="my_metric",
        summary="How far the head is above or below the reference's",
        version="1",
        values=(
            Value(
                id="my_metric.mean",
                label="head height",
                meaning="how far the head is above or below where it should be",
                unit="% of height",
                better="lower",
                formula="100 * mean over frames of |p_y - g_y| / h; p, g: the head, h: target's height",
                source="where the definition was published",
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Value id -> number (or index -> number, where the card declares an index).

        comparison.predicted and .expected are positions (frames, joints, 3) in metres; values that do not
        apply to a case are left out. Nothing of the comparison may be modified.
        """
        head = comparison.target.joints(["head"])
        if comparison.offsets is None or not head:
            return {}
        apart = np.abs(comparison.offsets[:, head, 1])
        return {"my_metric.mean": 100 * float(apart.mean()) / comparison.height}


plugin = MyMetric
