"""How differently two bodies are built: their proportions compared, whatever their sizes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from .families import Family
from .proportions import Proportions

RATIOS: Mapping[str, Callable[[Proportions], float]] = {
    "thigh to shank": lambda p: p.thigh / p.shank,
    "leg to trunk": lambda p: p.leg / p.trunk,
    "arm to trunk": lambda p: p.arm / p.trunk,
    "upper arm to forearm": lambda p: p.upper_arm / p.forearm,
    "hips to leg": lambda p: p.hip_half / p.leg,
    "shoulders to trunk": lambda p: p.shoulder_half / p.trunk,
    "foot to leg": lambda p: p.ball / p.leg,
    "ankle to leg": lambda p: p.ankle / p.leg,
    "head to trunk": lambda p: p.head / p.trunk,
}
"""Of lengths of the skeleton alone; what any method makes of them has no say."""


def build(sizes: Proportions) -> np.ndarray:
    """``(ratios,)`` logarithms of a body's ratios."""
    return np.log([ratio(sizes) for ratio in RATIOS.values()])


@cache
def unlikeness(family: Family) -> Mapping[tuple[str, str], int]:
    """Two bodies of a family -> how unlike they are, in hundredths: the root mean square difference of
    their builds, each ratio in units of its standard deviation among the family. Whole numbers, so that
    lists which depend on them are the same everywhere."""
    names = list(family.bodies)
    builds = np.array([build(body.proportions) for body in family.bodies.values()])
    scaled = builds / builds.std(axis=0)
    apart = np.sqrt(((scaled[:, None] - scaled) ** 2).mean(axis=-1))
    hundredths = np.rint(100.0 * apart).astype(int).tolist()
    return {(a, b): hundredths[i][j] for i, a in enumerate(names) for j, b in enumerate(names)}
