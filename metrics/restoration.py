"""Position errors in centimetres for reconstruction, denoising and joint completion."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import Direction, Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison, squared_length

HUMOT = "HuMoT (Mourot et al. 2023), sections 4.1, 4.3 and 4.4: MPJPE in cm, world, not aligned"
JOINTS = "all joints of the target but 'virtual' copies"
CENTIMETRES = 100.0
DECIMALS = 5
"""Of centimetres: what is smaller is the single precision that answers are kept in."""


def _value(id_: str, label: str, meaning: str, formula: str, better: Direction = "lower") -> Value:
    return Value(id_, label, meaning, "cm", better, formula, HUMOT, 1e-5)


class Restoration(Metric):
    """Distances to the clean motion: of the output, of the input, and of given and missing joints."""

    card = MetricCard(
        name="restoration",
        summary="position errors in centimetres of restored motion, and of the input",
        version="1",
        values=(
            _value(
                "restored_cm",
                "position error",
                "mean distance of joints from the clean motion",
                f"100 * mean over frames and joints of |p - g|, metres, to five decimals; {JOINTS}",
            ),
            _value(
                "given_cm",
                "input error",
                "mean distance of the joints of the source from the clean motion",
                "100 * mean over frames and joints of |s - g| with s the source, over the joints of "
                "restored_cm that the source has; left out where source and target are different bodies",
                better="none",
            ),
            _value(
                "restored_cm.given",
                "position error, given joints",
                "mean position error of the joints that the source has",
                "restored_cm over the joints that the source has; left out where it has all or none",
            ),
            _value(
                "restored_cm.missing",
                "position error, missing joints",
                "mean position error of the joints that the source lacks",
                "restored_cm over the joints that the source does not have; left out where it has all",
            ),
        ),
        tasks=("reconstruct", "denoise", "joint-completion"),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out without a reference; all but ``restored_cm`` where source and target are two bodies."""
        if comparison.distances is None or comparison.expected is None:
            return {}
        distances = comparison.distances[:, comparison.joints]
        values = {"restored_cm": _centimetres(distances)}
        info, source = comparison.case.info, comparison.case.source
        if info.source != info.target:
            return values
        at = {name: joint for joint, name in enumerate(source.skeleton.names)}
        names = [comparison.target.skeleton.names[joint] for joint in comparison.joints]
        there = np.array([name in at for name in names])
        if there.any():
            inputs = source.positions[:, [at[name] for name in names if name in at]]
            expected = comparison.expected[:, comparison.joints[there]]
            values["given_cm"] = _centimetres(np.sqrt(squared_length(inputs - expected)))
        if there.any() and not there.all():
            values["restored_cm.given"] = _centimetres(distances[:, there])
        if not there.all():
            values["restored_cm.missing"] = _centimetres(distances[:, ~there])
        return values


def _centimetres(metres: np.ndarray) -> float:
    return round(CENTIMETRES * float(metres.mean()), DECIMALS)


plugin = Restoration
