"""How far to the side the hips are."""

import numpy as np

from retarget_bench.api import MetricCard, Value


class Lean:
    card = MetricCard(
        name="lean",
        summary="Sideways distance of the hips from the reference's",
        version="1",
        values=(
            Value(
                id="lean.mean",
                label="lean",
                meaning="how far the hips are to the side of where they should be",
                unit="% of height",
                better="lower",
                formula="100 * mean over frames of |p_x - g_x| / h at the hips",
                source="this package",
            ),
        ),
    )

    def compute(self, comparison):
        if comparison.offsets is None:
            return {}
        apart = np.abs(comparison.offsets[:, comparison.hips, 0])
        return {"lean.mean": 100 * float(apart.mean()) / comparison.height}
