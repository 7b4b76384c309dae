"""The measurements behind the thresholds of ``contact`` (``LOW``) and ``joint_speed`` (``SLOW``).

    python benchmarks/metric_thresholds.py

Contacts found in the references of ``puppets[size=tiny]`` against their exact labels, with slow noise on
the feet as recorded motion has it: recall, precision and F1 of the labels by part, a turn about a resting
point counted as a contact. Then how often joints of right answers turn faster than 1.5 times the source's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from retarget_bench.api import Case
from retarget_bench.api.comparison import Comparison
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics import contact as contact_metric
from retarget_bench.metrics import joint_speed

LOWS = (0.0025, 0.005, 0.01, 0.02, 0.03, np.inf)
NOISES = (0.0, 0.001, 0.002, 0.004)
SLOWS = (10.0, 30.0, 60.0, 90.0, 120.0)
WIDTH = 8.0
"""Frames: standard deviation of the Gaussian that smooths the noise."""


def noisy(case: Case, size: float, random: np.random.Generator) -> Case:
    """The case with slow noise of this standard deviation (heights) on the places of the reference."""
    places = case.reference.positions
    noise = gaussian_filter1d(random.normal(size=(len(places) + 80, *places.shape[1:])), WIDTH, axis=0)[
        40:-40
    ]
    noise *= size * case.target.height / noise.std()
    return replace(case, reference=case.target.positions(places + noise, case.reference.fps), contacts=None)


def labels(cases: list[Case], low: float, size: float) -> Iterator[tuple[str, float, float]]:
    """Part, recall and precision of the labels found, with this ``LOW`` and noise; parts "" is all."""
    contact_metric.LOW, random = low, np.random.default_rng(0)
    counts: dict[str, np.ndarray] = {}
    for case in cases:
        exact = Comparison(case, case.reference).contact_labels
        other = noisy(case, size, random)
        predicted = contact_metric.of_reference(Comparison(other, other.reference))
        for column, joint in enumerate(exact.joints.tolist()):
            claimed, true = predicted.planted[:, predicted.joints.index(joint)], exact.planted[:, column]
            right = true | exact.pivoting[:, column]
            add = np.array([(claimed & true).sum(), true.sum(), (claimed & right).sum(), claimed.sum()])
            for part in ("", case.target.roles[joint].partition("_")[2]):
                counts[part] = counts.get(part, 0) + add
    yield from (
        (part, hits / true, right / claimed) for part, (hits, true, right, claimed) in counts.items()
    )


def contacts(cases: list[Case]) -> None:
    """Print how well labels are found."""
    for size in NOISES:
        print(f"\nslow noise of {100 * size:g} % of the height: recall / precision of the labels")
        for low in LOWS:
            parts = {part: (recall, precision) for part, recall, precision in labels(cases, low, size)}
            recall, precision = parts.pop("")
            shown = ", ".join(f"{part} {a:.3f} / {b:.3f}" for part, (a, b) in parts.items())
            f1 = 2 * recall * precision / (recall + precision)
            print(f"  LOW {low:<7g} all {recall:.3f} / {precision:.3f}, F1 {f1:.3f}; {shown}")


def speeds(cases: list[Case]) -> None:
    """Print how often joints of right answers exceed the source's speed."""
    print("\nright answers beyond 1.5 x the source's greatest angular speed")
    for slow in SLOWS:
        joint_speed.SLOW = slow
        ratios = [each for case in cases for each in joints(case)]
        print(f"  SLOW {slow:<4g} {100 * np.mean([ratio > 1.5 for ratio in ratios]):.1f} % of the joints")


def joints(case: Case) -> list[float]:
    """The excess of every joint of the reference."""
    values = joint_speed.plugin().compute(Comparison(case, case.reference))
    return list(values["joint_speed_excess.joint"].values())


if __name__ == "__main__":
    data = Puppets()
    every = [
        data.load(info) for split in ("self", "intra", "cross") for info in data.cases("retarget", split)
    ]
    contacts(every)
    speeds(every)
