"""The floor's height: flat, between samples, and beyond the edge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import Ground
from retarget_bench.errors import BenchError
from retarget_bench.motion.ground import ground_height

FIELD = np.array([[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]])
"""Rows along z, columns along x."""


def test_flat() -> None:
    assert ground_height(Ground(height=0.3), np.zeros((4, 2)), np.ones((4, 2))).tolist() == [[0.3, 0.3]] * 4


@given(st.floats(-3.0, 6.0), st.floats(-4.0, 4.0))
def test_a_plane_is_read_exactly_and_goes_on_level_beyond_its_edge(x: float, z: float) -> None:
    ground = Ground(heights=FIELD, origin=(-1.0, -2.0), spacing=2.0)
    along, across = np.clip((x + 1.0) / 2.0, 0, 2), np.clip((z + 2.0) / 2.0, 0, 1)
    assert float(ground_height(ground, x, z)) == pytest.approx(along + 10 * across, abs=1e-9)


def test_one_sample_is_flat() -> None:
    assert float(ground_height(Ground(heights=np.array([[0.7]])), 3.0, -2.0)) == 0.7


@pytest.mark.parametrize(
    "ground",
    [
        Ground(heights=np.zeros(4)),
        Ground(heights=np.zeros((0, 3))),
        Ground(heights=np.array([[np.nan]])),
        Ground(heights=np.zeros((2, 2)), spacing=0.0),
    ],
)
def test_fields_that_are_none_are_refused(ground: Ground) -> None:
    with pytest.raises(BenchError, match="height field"):
        ground_height(ground, np.zeros(1), np.zeros(1))
