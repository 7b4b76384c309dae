"""Matrices of all pairs of windows of two sets, made once for the sets and all their parts."""

from collections.abc import Callable
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from retarget_bench.api import Sample

Made = TypeVar("Made")


def apart(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``(n, m)`` bool: which pairs of windows are of different groups; labels ``(n,)`` and ``(m,)``.

    Labels are numbered first: comparing a million pairs of texts takes longer than any distance.
    """
    _, numbers = np.unique(np.concatenate([a, b]), return_inverse=True)
    return np.asarray(numbers[: len(a), None] != numbers[len(a) :])


class PerPair(Generic[Made]):
    """What is made of two whole sets, for as long as both of them live."""

    def __init__(self, make: Callable[[Sample, Sample], Made]) -> None:
        self._make = make
        self._made: WeakKeyDictionary[Sample, WeakKeyDictionary[Sample, Made]] = WeakKeyDictionary()

    def __call__(self, a: Sample, b: Sample) -> Made:
        others = self._made.setdefault(a, WeakKeyDictionary())
        if b not in others:
            others[b] = self._make(a, b)
        return others[b]


def whole(sample: Sample) -> tuple[Sample, np.ndarray]:
    """The set that a set is a part of, and its windows there; itself and all where it is none."""
    if sample.whole is None or sample.rows is None:
        return sample, np.arange(len(sample.clips))
    return sample.whole, sample.rows
