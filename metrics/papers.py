"""Position errors as SAN, PAN and HuMoT print them: squared or not, by their heights and joint sets."""

from collections.abc import Mapping
from functools import partial

from retarget_bench.api import Metric, MetricCard, Value, protocol
from retarget_bench.api.comparison import Comparison

JOINTS = (
    "joints: every joint between the root and a joint with a role, tips and split joints included, "
    "fingers, props and 'virtual' joints left out (23 or 28 on the papers' structures); H1: bone lengths "
    "from the left toe end (or toe) up to the root + from the head's end (or head) up to the root"
)
CUT = "the clip cut to a multiple of 4 frames; left out for shorter clips and where H1 is unknown"
SAN = "SAN (Aberman et al. 2020), evaluation code; printed by SAN and PAN"


_value = partial(Value, unit="1e-3", better="lower")
_protocol = partial(protocol, divided_by="H1^2", joints="structure", frames="a multiple of 4")


class Papers(Metric):
    """Legacy protocols on the papers' joint set and H1."""

    card = MetricCard(
        name="papers",
        summary="position errors as the papers on Mixamo print them",
        version="1",
        values=(
            _value(
                "san_code",
                "SAN error",
                "mean squared position error as SAN and PAN print it; self pairs count as intra",
                formula=f"1000 * mean over frames, joints and x, y, z of ((p - g) / H1)^2; {CUT}; {JOINTS}",
                source=SAN,
                with_self=True,
                protocol=_protocol("squared coordinate", self_pairs="in intra"),
            ),
            _value(
                "san_code_noself",
                "SAN error, no self pairs",
                "mean squared position error as SAN prints it, without self pairs",
                formula="per case as san_code; self pairs stay in their own group",
                source=SAN,
                protocol=_protocol("squared coordinate"),
            ),
            _value(
                "sqdist_h2",
                "squared distance",
                "mean squared distance in squared heights: three times the SAN error",
                formula="1000 * mean over frames and joints of (|p - g| / H1)^2; all else as san_code",
                source="bridge between san_code and squared distances",
                protocol=_protocol("squared distance"),
            ),
            _value(
                "pan_eq16_mean",
                "PAN eq. 16",
                "PAN's printed formula, averaged: squared centimetres over one height",
                unit="cm",
                formula=(
                    "mean over frames and joints of |p - g|^2 / H1, lengths in cm (the printed formula has "
                    "no mean, and is not what was run); frames, joints, H1 as san_code"
                ),
                source="PAN (Hu et al. 2023), equation 16 as typed",
                tolerance=1e-5,
                protocol=_protocol("squared distance", divided_by="H1"),
            ),
            _value(
                "humot_mpjpe",
                "HuMoT error",
                "mean position error in heights, as HuMoT prints it, for self, intra and cross",
                unit="heights",
                formula="mean over frames and joints of |p - g| / H1; whole clip, all else as san_code",
                source="HuMoT, retargeting tables 3-5",
                tolerance=1e-8,
                protocol=_protocol(divided_by="H1", frames="all"),
            ),
        ),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float]:
        """Left out without a reference, and where H1 is unknown."""
        squares, distances = comparison.squares, comparison.distances
        h1 = float(comparison.target.measures.h1)
        if squares is None or distances is None or not h1 > 0:
            return {}
        joints = comparison.structure_joints
        values = {"humot_mpjpe": float(distances[:, joints].mean()) / h1}
        if (frames := len(squares) // 4 * 4) > 0:
            square = float(squares[:frames, joints].mean())
            values["sqdist_h2"] = 1000.0 * square / h1**2
            values["san_code"] = values["san_code_noself"] = values["sqdist_h2"] / 3.0
            values["pan_eq16_mean"] = 100.0 * square / h1
        return values


plugin = Papers
