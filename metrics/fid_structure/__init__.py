"""FID, KID, coverage and density of a whole set of results against real motion."""

import math
from functools import lru_cache
from pathlib import Path

import numpy as np

from retarget_bench.api import CaseFeatures, MetricCard, Prediction, Sample, SetMetric, Value
from retarget_bench.api.comparison import Comparison
from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.training.features import network, windows
from retarget_bench.training.features.network import Network

from .frechet import Frechet
from .pairs import NEIGHBOURS, Fits, Kid

SHIPPED = Path(__file__).with_name("networks")
PER_DIMENSION = 4
"""Windows per feature dimension below which only KID, which has no bias, is given."""
FEW = 32
"""Windows below which no value of a set is given."""
SMALL = f"left out below {PER_DIMENSION} windows per dimension of the features"

SETS = (
    "windows of 64 frames at 30 per second, one every 8 frames, of all cases of one split and one target "
    "structure; features: 256 of that structure's convolutional autoencoder (bench train fid), each "
    "with mean 0 and deviation 1 over its training windows; the clips are dealt into two halves by a hash, "
    "and the real windows of one half are compared with the generated windows of the other, both ways, and "
    "averaged; from either half the same number n of windows, at most 1,200, is drawn as evenly over the "
    "root speed of the real motion as they allow, one per target, clip and frame; the floor is the same "
    "with the references of the generated windows in their place, so that the references themselves score "
    "exactly the floor; the interval is a delete-a-group jackknife over clips, withheld below 10"
)
SOURCE = (
    "PAN eq. 21 and section 7.2.1 in kind: windows, sampling and distance are theirs, features and numbers "
    "are not, since their network was never published; {}"
)

LABELS = {"fid.structure": "FID, by structure", "kid": "KID"}
"""Labels that are not the ids. *FID* alone is that of all two-legged bodies, ``fid``."""


def _value(name: str, meaning: str, formula: str, source: str, **others: str | float) -> Value:
    return Value(
        id=name,
        label=LABELS.get(name, name),
        meaning=meaning,
        unit="1",
        formula=f"{formula}; {SETS}",
        source=SOURCE.format(source),
        **others,  # type: ignore[arg-type]
    )


class FidStructure(SetMetric):
    """Distances between the distribution of results and that of real motion of the same structure.

    The references of the very clips that were retargeted are right answers, and a distance to them would
    measure accuracy too, with 0 for the references. So results are compared with real motion of *other*
    clips. What the references score against those is the floor, and a value is read against it: no method
    can be expected below it. networks: a folder of feature networks that is looked through first.
    """

    card = MetricCard(
        name="fid_structure",
        kind="set",
        summary="distances of the distribution of results to that of real motion",
        version="1",
        values=(
            _value(
                "fid.structure",
                "Fréchet distance from real motion of the target's structure",
                "|m_r - m_g|^2 + tr(C_r + C_g - 2 (C_r C_g)^(1/2)) of means and covariances of features; "
                + SMALL,
                "Heusel et al. 2017",
                better="lower",
                tolerance=1e-2,
            ),
            _value(
                "kid",
                "kernel distance from real motion, unbiased: 0 on average for real motion",
                "mean k(r, r') + mean k(g, g') - 2 mean k(r, g) with k(x, y) = (x y / 256 + 1)^3, over "
                "pairs of windows of different clips",
                "Binkowski et al. 2018; pairs of one clip are left out: they are no independent draws",
                better="lower",
                tolerance=1e-3,
                least=-math.inf,
            ),
            _value(
                "coverage",
                "share of real motion with a result near it: low where results lack variety",
                f"share of real windows with a generated one nearer than the real window's {NEIGHBOURS}th "
                f"nearest real one of another clip; {SMALL}",
                "Naeem et al. 2020; neighbours of the own clip are left out since windows overlap",
                better="higher",
                tolerance=2e-2,
            ),
            _value(
                "density",
                "density of real motion around the results: low where they do not resemble real motion",
                "mean over generated windows of the number of real windows that have it nearer than their "
                f"{NEIGHBOURS}th nearest real one of another clip, over {NEIGHBOURS}; {SMALL}",
                "Naeem et al. 2020; balls and neighbours as for coverage",
                better="higher",
                tolerance=2e-2,
                most=math.inf,
            ),
        ),
    )

    def __init__(self, networks: str = "") -> None:
        extra = (Path(networks),) if networks else ()
        self._folders = (*extra, SHIPPED, network.own_folder())
        self._real = lru_cache(maxsize=2)(self._encoded)
        self._frechet, self._kid, self._fits = Frechet(), Kid(), Fits()

    def network(self, target: Character) -> str:
        return self._network(target).hash

    def features(self, comparison: Comparison) -> CaseFeatures:
        floor = comparison.case.ground.height
        encoder = self._network(comparison.target)
        generated = encoder.features(comparison.prediction, floor)[0]
        if comparison.case.reference is None:
            # what a method made of the root decides nothing: the windows are drawn by the source's
            source = windows.channels(comparison.case.source)
            return CaseFeatures(generated, generated[:0], windows.speeds(source).astype(np.float32))
        return CaseFeatures(generated, *self._real(comparison.case.reference, floor))

    def least(self, value_id: str) -> int:
        return FEW if value_id == "kid" else PER_DIMENSION * network.OF_STRUCTURE.features

    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        if value_id == "fid.structure":
            return self._frechet(real, generated)
        if value_id == "kid":
            return self._kid(real, generated)
        return float(getattr(self._fits(real, generated), value_id))

    def _encoded(self, reference: Prediction, floor: float) -> tuple:
        return self._network(reference.character).features(reference, floor)

    def _network(self, target: Character) -> Network:
        for folder in self._folders:
            encoder = network.find(folder, target.structure)
            if encoder is not None:
                if reason := encoder.unfit(target):
                    raise NotSupported(reason)
                return encoder
        raise NotSupported(
            f"no feature network for structure {target.structure}; bench train fid makes one"
        )


plugin = FidStructure
