"""How long FID takes: 1,200 windows of a puppet's motion to features, and the distance of two such sets.

The distance stands beside the usual way, ``scipy.linalg.sqrtm`` of the product of the covariances, on the
same features. Run: ``python tests/benchmarks/fid_speed.py``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg

from retarget_bench.metrics.fid_structure import SHIPPED
from retarget_bench.metrics.fid_structure.frechet import frechet
from retarget_bench.plugins import registry
from retarget_bench.training.features import network, windows

WINDOWS = 1200
REPEATS = 3


def main() -> None:
    """Print seconds, the best of a few."""
    data = registry.create("datasets", "puppets[size=tiny]")
    used = network.find(SHIPPED, "body22")
    motion = next(
        case.reference
        for case in map(data.load, data.cases("retarget", "intra"))
        if case.target.structure == "body22" and case.source.frames >= 100
    )
    frames = np.resize(np.arange(motion.frames), windows.FRAMES + windows.HOP * (WINDOWS - 1))
    motion = data.characters()[motion.character.name].positions(motion.positions[frames], motion.fps)

    seconds, (features, _) = best(lambda: used.features(motion))
    print(f"{WINDOWS} windows to {features.shape[1]} features: {seconds:.2f} s")
    # windows of one clip repeat; sets as spread as real ones make the distances well conditioned
    random = np.random.default_rng(0)
    real, made = (features.astype(float) + random.normal(size=features.shape) for _ in range(2))
    ours, value = best(lambda: frechet(real, made))
    print(f"distance of two sets: {ours:.3f} s")
    theirs, other = best(lambda: by_square_root(real, made))
    print(f"by scipy.linalg.sqrtm: {theirs:.3f} s, {theirs / ours:.1f} times as long")
    print(f"values {value:.9g} and {other:.9g}, {abs(value - other) / other:.1e} apart")
    print(f"FID of {WINDOWS} windows with features of one set: {seconds + ours:.2f} s")


def by_square_root(a: np.ndarray, b: np.ndarray) -> float:
    """The usual way."""
    first, second = np.cov(a.T), np.cov(b.T)
    apart = a.mean(axis=0) - b.mean(axis=0)
    root = scipy.linalg.sqrtm(first @ second).real
    return float(apart @ apart + np.trace(first) + np.trace(second) - 2 * np.trace(root))


def best(work: Callable[[], Any]) -> tuple[float, Any]:
    """The shortest of a few times, and the result."""
    times = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begun)
    return min(times), result


if __name__ == "__main__":
    main()
