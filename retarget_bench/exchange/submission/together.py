"""Values that follow from each other: a mean goes with its parts, and no part exceeds the whole.

Those of ``position``, by which methods are ranked: all are means over frames of distances of joints, e, of
which the hips' is one, r.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from retarget_bench.results import store
from retarget_bench.results.store import Results

CLOSE = 1e-6
"""Relative difference up to which numbers of nine digits agree."""
WORLD, ROOT, JOINT = "mpjpe_h.world", "mpjpe_h.root", "mpjpe_h.joint"
ENDS_WORLD, ENDS_ROOT = "ee_h.world", "ee_h.root"
ALONG, UP = "root_path.horizontal", "root_path.vertical"


def impossible(results: Results) -> Iterator[str]:
    """What cannot be true of one motion, as sentences: of every rule the first case that breaks it.

    Rows of large results have no curves in entries; those are read beside them.
    """
    joints = _means(store.read_arrays(results.paths))
    broken: dict[str, str] = {}
    for entry in results.entries:
        values = {name: value for name, value in entry.values.items() if isinstance(value, float)}
        if entry.status != "ok" or not {WORLD, ROOT, ALONG, UP} <= values.keys():
            continue
        if entry.case not in joints:
            broken.setdefault(JOINT, f"{entry.case} has {ROOT} and no {JOINT}")
            continue
        for rule in _by_joints(values, *joints[entry.case]):
            broken.setdefault(rule, f"{rule} of {entry.case} cannot be true together")
    yield from broken.values()


def _means(arrays: Mapping[str, np.ndarray]) -> dict[str, tuple[float, int]]:
    """Case -> the mean of the errors of its joints, and how many they are."""
    if f"{JOINT}:cases" not in arrays:
        return {}
    cases, places = np.unique(arrays[f"{JOINT}:cases"], return_inverse=True)
    counts = np.bincount(places)
    means = np.bincount(places, weights=arrays[f"{JOINT}:values"]) / counts
    return {str(case): (float(mean), int(n)) for case, mean, n in zip(cases, means, counts, strict=True)}


def _by_joints(values: Mapping[str, float], mean: float, count: int) -> Iterator[str]:
    """Broken rules. mean, count: of the joints' errors relative to the root."""
    world, root = values[WORLD], values[ROOT]
    least, most = max(values[ALONG], values[UP]), values[ALONG] + values[UP]  # of the mean of r
    if abs(mean - root) > near(mean, root):
        yield f"{JOINT} and {ROOT}"
    if least > world * count + near(least, world):
        yield f"{WORLD} and {ALONG if values[ALONG] == least else UP}"
    # |e| <= |e - r| + |r|, and |e - r| <= |e| + |r|
    for one, other, names in (
        (world, root, f"{WORLD} and {ROOT}"),
        (values.get(ENDS_WORLD, 0.0), values.get(ENDS_ROOT, 0.0), f"{ENDS_WORLD} and {ENDS_ROOT}"),
    ):
        if abs(one - other) > most + near(one, other, most):
            yield names
    for ends, whole in ((ENDS_WORLD, WORLD), (ENDS_ROOT, ROOT)):
        if values.get(ends, 0.0) > values[whole] * count + near(values[whole]):
            yield f"{ends} and {whole}"


def near(*numbers: float) -> float:
    """How far apart numbers of nine digits, of about these sizes, may be."""
    return CLOSE * max(*map(abs, numbers), CLOSE)
