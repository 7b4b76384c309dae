"""Random numbers that stay: from the raw bits of Philox, by transforms of our own.

NumPy keeps the bits of its generators, not what its distributions make of them.
"""

from __future__ import annotations

import numpy as np

from retarget_bench.results.store import case_seed


def seed_of(task: str, case_id: str) -> int:
    """The seed of a case: adding a case moves no other one's noise or draw."""
    return case_seed(0, task, case_id)


def uniform(seed: int, count: int) -> np.ndarray:
    """``(count,)`` numbers between 0 and 1, neither included."""
    raw = np.random.Philox(key=seed).random_raw(count)
    return np.asarray(((raw >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def gaussian(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers of mean 0 and standard deviation 1, by the inverse of the normal distribution."""
    from scipy.special import ndtri  # type: ignore[import-untyped]

    return np.asarray(ndtri(uniform(seed, int(np.prod(shape)))).reshape(shape))


def drawn(seed: int, total: int, count: int) -> tuple[int, ...]:
    """``count`` of ``total`` numbers from 0 on, each as likely as any other, in increasing order."""
    order = np.argsort(uniform(seed, total), kind="stable")
    return tuple(sorted(order[:count].tolist()))
