"""Foot contacts over a sweep of speed thresholds: PAN's recall, with precision and F1 beside it."""

from collections.abc import Mapping, Sequence

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison, squared_length, steps

EPSILONS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Squared displacements per frame at 30 frames per second, cm^2."""
SHARES = (0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.01)
"""Displacements per frame at 30 frames per second, in heights."""

KINDS = {
    "pan_recall": (
        "PAN contact recall, by speed",
        "share of the reference's contacts that are found",
        "both / reference's",
    ),
    "pan_contact_precision": (
        "PAN contact precision, by speed",
        "share of the contacts found that the reference has too",
        "both / prediction's (0 where it has none)",
    ),
    "pan_contact_f1": (
        "PAN contact F1, by speed",
        "harmonic mean of contact recall and precision",
        "2 * both / (prediction's + reference's)",
    ),
}
TESTS = {
    "": f"|d|^2 < e with |d| in cm and e = {', '.join(map(str, EPSILONS))} cm^2",
    "_h": f"|d| < e h with e = {', '.join(map(str, SHARES))}",
}


def _value(kind: str, suffix: str) -> Value:
    label, meaning, share = KINDS[kind]
    return Value(
        id=kind + suffix,
        label=f"{label}, by height" if suffix else label,
        meaning=f"{meaning}, as a curve over the speed threshold",
        unit="1",
        better="higher",
        formula=(
            f"for every threshold e: {share}, counting pairs of frame and joint in contact: "
            f"{TESTS[suffix]}, d = (p(t) - p(t-1)) * fps / 30, t from the second frame on; joints: foot "
            "and toe of both sides, where present, and the fore paws of four-legged targets; a threshold "
            "at which the reference has no contact is left out"
        ),
        source="PAN (Hu et al. 2023), eqs 17-19 (recall only); unit, rate, joints, thresholds are ours",
        tolerance=1e-3,
        index="threshold",
    )


class PanContact(Metric):
    """The same speed test on prediction and reference, at many thresholds."""

    card = MetricCard(
        name="pan_contact",
        summary="foot contacts kept, as curves over the speed threshold",
        version="1",
        values=tuple(_value(kind, suffix) for suffix in TESTS for kind in KINDS),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, Mapping[str, float]]:
        """Left out without a reference, and where the target has no feet or nothing is ever slow enough."""
        joints = comparison.target.joints(comparison.contact_roles)
        if comparison.expected is None or not joints:
            return {}
        predicted, expected = (
            squared_length(steps(side[:, joints], comparison.fps)).ravel()
            for side in (comparison.predicted, comparison.expected)
        )
        curves = {
            **_curves(predicted, expected, np.array(EPSILONS) * 1e-4, EPSILONS, ""),
            **_curves(predicted, expected, (np.array(SHARES) * comparison.height) ** 2, SHARES, "_h"),
        }
        return {id_: curve for id_, curve in curves.items() if curve}


def _curves(
    predicted: np.ndarray, expected: np.ndarray, limits: np.ndarray, labels: Sequence[float], suffix: str
) -> dict[str, dict[str, float]]:
    """Value id -> threshold's name -> share, from squared displacements ``(samples,)`` m^2."""
    curves: dict[str, dict[str, float]] = {kind + suffix: {} for kind in KINDS}
    recall, precision, f1 = curves.values()
    for limit, label in zip(limits.tolist(), labels, strict=True):
        positive, true = predicted < limit, expected < limit
        want, claim, both = int(true.sum()), int(positive.sum()), int((positive & true).sum())
        if want:
            name = f"{label:g}"
            recall[name], precision[name] = both / want, both / claim if claim else 0.0
            f1[name] = 2 * both / (want + claim)
    return curves


plugin = PanContact
