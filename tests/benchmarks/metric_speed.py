"""How long all metrics take for one case, and how the best fit compares with scipy's, in one run.

    python tests/benchmarks/metric_speed.py

Prints milliseconds of processor time per case (kinematics done before), metric by metric, and for the best
rigid fit of every frame the ratio to a loop over ``scipy.spatial.transform.Rotation.align_vectors``.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

REPEATS = 50


def milliseconds(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Processor time of one call, the median of some."""
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        taken.append(1e3 * (time.process_time() - start))
    return float(np.median(taken))


def scipy_fits(moving: np.ndarray, fixed: np.ndarray) -> float:
    """The mean distance left after the best rigid fit of every frame, by scipy."""
    total = 0.0
    for a, b in zip(moving, fixed, strict=True):
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        total += float(np.linalg.norm(Rotation.align_vectors(b, a)[0].apply(a) - b, axis=1).mean())
    return total / len(moving)


def report(frames: int) -> None:
    """Print the figures of one case."""
    cases = importlib.import_module("metric_cases")
    residuals = importlib.import_module("retarget_bench.motion.alignment").residuals
    case, metrics = cases.sides(frames), [cases.metric(name) for name in cases.METRICS]
    p, g = (side.positions for side in (case.predicted, case.expected))
    assert len(case.source.positions) == frames  # kinematics is done here, so that it is not timed

    def run(chosen: list) -> None:
        comparison = case.comparison()
        for each in chosen:
            each.compute(comparison)

    joints = len(case.comparison().joints)
    print(f"{frames} frames, {joints} scored joints: {milliseconds(lambda: run(metrics)):.2f} ms per case")
    for each in metrics:
        print(f"  {each.card.name:12s} {milliseconds(partial(run, [each])):6.2f} ms on its own")
    assert abs(residuals(p, g)[0] - scipy_fits(p, g)) < 1e-9
    ours, theirs = milliseconds(lambda: residuals(p, g)), milliseconds(lambda: scipy_fits(p, g), 5)
    print(f"  fit of every frame: {ours:.2f} ms; loop over scipy {theirs:.2f} ms, {theirs / ours:.0f}x")


if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1] / "metrics")]
    for frames in (75, 240):
        report(frames)
