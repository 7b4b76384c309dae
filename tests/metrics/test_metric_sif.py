"""Source-instance fidelity: the arithmetic of its authors' toolkit, and what its ends mean."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.metrics.sif import LENGTH, Sif, correlation, distances, group, to_length


@pytest.fixture(scope="module")
def oracle(real_data):
    with np.load(real_data / "oracles/sif.npz") as arrays:
        return {name: arrays[name] for name in arrays.files}


def clips_of(oracle, part: str, number: int) -> list[np.ndarray]:
    names = [f"{part}_{number}_{clip}" for clip in range(6)]
    return [oracle[name] for name in names if name in oracle]


@pytest.mark.parametrize("mode", ["raw", "fixed"])
def test_distances_and_correlations_are_the_toolkits(oracle, mode):
    for number in range(8):
        found = {}
        for part in ("source", "output"):
            clips = clips_of(oracle, part, number)
            clips = [to_length(clip, LENGTH) for clip in clips] if mode == "fixed" else clips
            found[part] = distances(clips)
            expected = oracle[f"{mode}_{part}_distances_{number}"]
            np.testing.assert_allclose(found[part], expected[np.triu_indices(len(clips), 1)], rtol=1e-6)
        assert correlation(*found.values()) == pytest.approx(oracle[f"{mode}_sif"][number], abs=1e-6)
        ratio = found["output"].mean() / found["source"].mean()
        assert ratio == pytest.approx(oracle[f"{mode}_variation"][number], rel=1e-6)
