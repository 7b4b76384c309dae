"""FID of all answers from people to people as one set."""

from functools import lru_cache

import numpy as np

from retarget_bench.api import (
    TWO_LEGS,
    Case,
    CaseFeatures,
    MetricCard,
    Prediction,
    Sample,
    SetMetric,
    Value,
)
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported

from . import features as windows
from .frechet import Frechet

FEATURES = 43
PER_DIMENSION = 4
"""Windows per feature below which no value is given."""

SETS = (
    "windows of 16 frames at 30 per second, one every 4 frames, of all cases of one split {}; features: 43 "
    "kinetic and geometric ones of hips, head, arms and legs, in units that are the same for all data "
    "(metrics/fid/features.py); every clip is cut into an even number of stretches of about two seconds, "
    "which are dealt by turns into two halves; from either half the same number n of windows, at most "
    "1,200, is drawn as evenly over the root speed of the real motion as they allow, one per target, clip "
    "and frame; {}; the interval is that of what lies beyond the floor, by a delete-a-group jackknife over "
    "clips, withheld below 10"
)
DISTANCE = (
    "the value is the distance of the two halves of the real windows, which is the floor and what the "
    "references score, plus that of all generated windows from all real ones; without references, the mean "
    "distance of the generated windows from either half of other real motion"
)
SMALL = f"left out below {PER_DIMENSION} windows per feature"


class Fid(SetMetric):
    """Distance between the distribution of answers and that of real motion, all people together.

    The features are of the joints that all of them have, by role, so a split is one set whatever its
    structures are, and forty short clips are enough. To the distance of answers from all real motion is
    added what two halves of the real motion, stretches of every clip by turns, lie apart: a distance beside
    which others are large or small. Neither says whether an answer is that of its clip.
    """

    card = MetricCard(
        name="fid",
        kind="set",
        summary="distance of the distribution of all results on two legs to that of real motion",
        version="2",
        values=(
            Value(
                id="fid",
                label="FID",
                meaning="Fréchet distance from real motion, people as one set; blind to the source",
                unit="1",
                better="lower",
                formula="|m_r - m_g|^2 + tr(C_r + C_g - 2 (C_r C_g)^(1/2)) of means and covariances; "
                + SETS.format("whose source and target stand on two legs", DISTANCE)
                + f"; {SMALL}",
                source="Heusel et al. 2017, with features after FID_k and FID_g of Li et al. 2021; PAN "
                "eq. 21 in kind: its network was never published; fid.structure is the value per target "
                "structure",
                tolerance=1e-2,
            ),
        ),
    )
    stretches = windows.STRETCHES
    distances = ("fid",)

    def __init__(self) -> None:
        self._real = lru_cache(maxsize=2)(self._seen)
        self._frechet = Frechet()

    def set_of(self, case: Case) -> str:
        strangers = case.source.character.four_legged or case.target.four_legged
        return "" if strangers or windows.unfit(case.target) else TWO_LEGS

    def features(self, comparison: Comparison) -> CaseFeatures:
        """Raises NotSupported where the target's hips, head, arms and legs are not known."""
        case = comparison.case
        if reason := windows.unfit(case.target):
            raise NotSupported(reason)
        generated = windows.features(comparison.prediction, case.ground.height)[0]
        if case.reference is None:
            # what a method made of the root decides nothing: the windows are drawn by the source's
            return CaseFeatures(generated, generated[:0], windows.speeds(case.source))
        return CaseFeatures(generated, *self._real(case.reference, case.ground.height))

    def least(self, value_id: str) -> int:
        del value_id
        return PER_DIMENSION * FEATURES

    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        del value_id
        return self._frechet(real, generated)

    def _seen(self, reference: Prediction, floor: float) -> tuple[np.ndarray, np.ndarray]:
        return windows.features(reference, floor)


plugin = Fid
