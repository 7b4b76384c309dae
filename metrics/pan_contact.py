"""Foot contacts over a sweep of speed thresholds: PAN's recall, with precision and F1 beside it."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.api import MetricCard, Value
from retarget_bench.api.comparison import Comparison, squared_length, steps

EPSILONS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Squared displacements per frame at 30 frames per second, cm^2."""
SHARES = (0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.01)
"""Displacements per frame at 30 frames per second, in heights."""

KINDS = {
    "pan_recall": (
        "PAN contact recall",
        "share of the reference's contacts that are found",
        "both / reference's",
    ),
    "pan_contact_precision": (
        "PAN contact precision",
        "share of the contacts found that the reference has too",
        "both / prediction's (0 where it has none)",
    ),
    "pan_contact_f1": (
        "PAN contact F1",
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


class PanContact:
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
        squares = [
            squared_length(steps(side[:, joints], comparison.fps)).ravel()
            for side in (comparison.predicted, comparison.expected)
        ]
        limits = {
            "": np.array(EPSILONS) * 1e-4,
            "_h": (np.array(SHARES) * comparison.height) ** 2,
        }
        labels = {"": EPSILONS, "_h": SHARES}
        curves: dict[str, Mapping[str, float]] = {}
        for suffix, limit in limits.items():
            curves |= _curves(squares[0], squares[1], limit, [f"{e:g}" for e in labels[suffix]], suffix)
        return {id_: curve for id_, curve in curves.items() if curve}


def _curves(
    predicted: np.ndarray, expected: np.ndarray, limits: np.ndarray, names: list[str], suffix: str
) -> dict[str, dict[str, float]]:
    """Value id -> threshold's name -> share, from squared displacements ``(samples,)`` m^2."""
    found, true = predicted < limits[:, None], expected < limits[:, None]
    wanted, claimed = true.sum(axis=1).tolist(), found.sum(axis=1).tolist()
    hits = (found & true).sum(axis=1).tolist()
    rows = [row for row in zip(names, hits, wanted, claimed, strict=True) if row[2] > 0]
    return {
        f"pan_recall{suffix}": {name: both / want for name, both, want, _ in rows},
        f"pan_contact_precision{suffix}": {
            name: both / claim if claim else 0.0 for name, both, _, claim in rows
        },
        f"pan_contact_f1{suffix}": {name: 2 * both / (want + claim) for name, both, want, claim in rows},
    }


plugin = PanContact
