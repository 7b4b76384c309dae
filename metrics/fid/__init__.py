"""FID of all answers from people to people as one set, by one small feature network."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from retarget_bench.api import (
    TWO_LEGS,
    Case,
    CaseFeatures,
    MetricCard,
    Prediction,
    Sample,
    SetMetric,
    Stretches,
    Value,
)
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.training.features import network, windows
from retarget_bench.training.features.network import Network

from ..fid_structure.frechet import Frechet

SHIPPED = Path(__file__).with_name("networks")
PER_DIMENSION = 4
"""Windows per feature dimension below which no value is given."""
DESIGN = network.OF_TWO_LEGS
STRETCH = 60
"""Frames of a stretch at 30 per second, about."""

SETS = (
    "windows of 16 frames at 30 per second, one every 4 frames, of all cases of one split whose source "
    "and target stand on two legs; features: 32 of one convolutional autoencoder (bench train fid) "
    "that sees hips, head, arms and legs, each with mean 0 and deviation 1 over its training windows; "
    "every clip is cut into an even number of stretches of about two seconds, which are dealt by turns "
    "into two halves, and the real windows of one half are compared with the generated windows of the "
    "other, both ways, and averaged; from either half the same number n of windows, at most 1,200, is "
    "drawn as evenly over the root speed of the real motion as they allow, one per target, clip and "
    "frame; the floor is the same with the references of the generated windows in their place, so that "
    "the references themselves score exactly the floor; the interval is a delete-a-group jackknife over "
    f"clips, withheld below 10; left out below {PER_DIMENSION} windows per dimension of the features"
)


class Fid(SetMetric):
    """Distance between the distribution of answers and that of real motion, all people together.

    The features are of the joints that all of them have, by role, so a split is one set whatever its
    structures are, and forty short clips are enough. Answers are compared with real motion of other
    stretches of the same clips (``Stretches``). networks: a folder that is looked through first.
    """

    card = MetricCard(
        name="fid",
        kind="set",
        summary="distance of the distribution of all results on two legs to that of real motion",
        version="1",
        values=(
            Value(
                id="fid",
                label="FID",
                meaning="Fréchet distance from real motion, people as one set; blind to the source",
                unit="1",
                better="lower",
                formula="|m_r - m_g|^2 + tr(C_r + C_g - 2 (C_r C_g)^(1/2)) of means and covariances; "
                + SETS,
                source="Heusel et al. 2017; PAN eq. 21 in kind: features, windows and halves are not "
                "theirs; fid.structure is the value per target structure, each with a network of its own",
                tolerance=1e-2,
            ),
        ),
    )
    stretches = Stretches(overlap=DESIGN.frames // DESIGN.hop, length=STRETCH // DESIGN.hop)

    def __init__(self, networks: str = "") -> None:
        self._folders = (*([Path(networks)] if networks else ()), SHIPPED)
        self._real = lru_cache(maxsize=2)(self._encoded)
        self._frechet = Frechet()

    def set_of(self, case: Case) -> str:
        return "" if case.source.character.four_legged or network.stranger(case.target) else TWO_LEGS

    def network(self, target: Character) -> str:
        if reason := self._network.unfit(target):
            raise NotSupported(f"{reason}; FID of people needs hips, head, arms and legs")
        return self._network.hash

    def features(self, comparison: Comparison) -> CaseFeatures:
        self.network(comparison.target)
        floor = comparison.case.ground.height
        generated = self._network.features(comparison.prediction, floor)[0]
        if comparison.case.reference is None:
            source = windows.channels(comparison.case.source)
            speed = windows.speeds(source, DESIGN.hop, DESIGN.frames)
            return CaseFeatures(generated, generated[:0], speed.astype(np.float32))
        return CaseFeatures(generated, *self._real(comparison.case.reference, floor))

    def least(self, value_id: str) -> int:
        del value_id
        return PER_DIMENSION * DESIGN.features

    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        del value_id
        return self._frechet(real, generated)

    def _encoded(self, reference: Prediction, floor: float) -> tuple[np.ndarray, np.ndarray]:
        return self._network.features(reference, floor)

    @property
    def _network(self) -> Network:
        for folder in self._folders:
            if (trained := network.find(folder, TWO_LEGS)) is not None:
                return trained
        raise NotSupported(f"no feature network of bodies on {TWO_LEGS}; bench train fid makes one")


plugin = Fid
