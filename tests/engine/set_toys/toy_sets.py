"""A set metric of toys: windows of 4 frames, their mean places as features, distance of the set means."""

import numpy as np

from retarget_bench.api import CaseFeatures, MetricCard, Value
from retarget_bench.errors import NotSupported

FRAMES = 4


class ToySets:
    """structures: those that it knows, or ``all``."""

    def __init__(self, structures: str = "all") -> None:
        self.structures = structures

    card = MetricCard(
        "toy_sets",
        "toys",
        "1",
        (
            Value(
                "toy_gap", "gap", "distance of means", "m", "lower", "|m_r - m_g|", "toys", tolerance=1e-3
            ),
            Value(
                "toy_many", "many", "needs more than there is", "m", "lower", "-", "toys", tolerance=1e-3
            ),
        ),
    )

    def features(self, comparison):
        if self.structures not in ("all", comparison.target.structure):
            raise NotSupported(f"no toy features of structure {comparison.target.structure}")
        pieces = _pieces(comparison.prediction.positions)
        if comparison.case.reference is None:
            return CaseFeatures(pieces, pieces[:0], np.linspace(0, 1, len(pieces), dtype=np.float32))
        real = _pieces(comparison.case.reference.positions)
        return CaseFeatures(pieces, real, np.linspace(0, 1, len(real), dtype=np.float32))

    def least(self, value_id):
        return 10**6 if value_id == "toy_many" else 1

    def value(self, value_id, real, generated):
        return float(np.linalg.norm(real.features.mean(axis=0) - generated.features.mean(axis=0)))


def _pieces(places):
    cut = [
        places[at : at + FRAMES].mean(axis=0).ravel() for at in range(0, len(places) - FRAMES + 1, FRAMES)
    ]
    return np.array(cut, dtype=np.float32)


plugin = ToySets
