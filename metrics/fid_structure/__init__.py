"""FID, KID, coverage and density of results on one structure of targets against real motion."""

import math

from retarget_bench.api import MetricCard, Sample, SetMetric, Value

from ..fid import DISTANCE, FEATURES, PER_DIMENSION, SETS, SMALL, Fid
from .pairs import NEIGHBOURS, Fits, Kid

FEW = 32
"""Windows below which no value of a set is given."""
SOURCE = (
    "PAN eq. 21 and section 7.2.1 in kind: sampling and distance are theirs, windows, features and numbers "
    "are not, since their network was never published; {}"
)

HALVES = (
    "the real windows of one half are compared with the generated windows of the other, both ways, and "
    "averaged; the floor is the same with the references of the generated windows in their place"
)
LABELS = {"fid.structure": "FID, by structure", "kid": "KID"}
"""Labels that are not the ids. *FID* alone is that of all two-legged bodies, ``fid``."""


def _value(name: str, meaning: str, formula: str, source: str, **others: str | float) -> Value:
    return Value(
        id=name,
        label=LABELS.get(name, name),
        meaning=meaning,
        unit="1",
        formula=f"{formula}; "
        + SETS.format("and one target structure", DISTANCE if name == "fid.structure" else HALVES),
        source=SOURCE.format(source),
        **others,  # type: ignore[arg-type]
    )


class FidStructure(Fid):
    """Distances between the distribution of results and that of real motion of the same structure, also
    where cases have no references and the data set has other real motion."""

    card = MetricCard(
        name="fid_structure",
        kind="set",
        summary="distances of the distribution of results to that of real motion",
        version="2",
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
                "unbiased kernel distance: about 0 for real motion, less for real windows of other clips",
                "mean k(r, r') + mean k(g, g') - 2 mean k(r, g) with k(x, y) = (x y / 43 + 1)^3, over "
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

    set_of = SetMetric.set_of
    distances = ("fid.structure",)
    unbiased = ("kid",)

    def __init__(self) -> None:
        super().__init__()
        self._kid, self._fits = Kid(), Fits()

    def least(self, value_id: str) -> int:
        return FEW if value_id == "kid" else PER_DIMENSION * FEATURES

    def value(self, value_id: str, real: Sample, generated: Sample) -> float:
        if value_id == "fid.structure":
            return super().value(value_id, real, generated)
        if value_id == "kid":
            return self._kid(real, generated)
        return float(getattr(self._fits(real, generated), value_id))


plugin = FidStructure
