"""Size and path of a body of which only points are seen."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.motion import scan_path

sys.path.insert(0, str(Path(__file__).parents[1] / "methods"))
from skinned_toys import skinned_body


def test_a_rods_size_is_its_length_in_any_direction() -> None:
    numbers = np.random.default_rng(0)
    along = np.linspace(-0.9, 0.9, 50)
    for way in numbers.normal(size=(20, 3)):
        rod = along[:, None] * way / np.linalg.norm(way) + numbers.normal(size=3)
        assert scan_path.size([rod]) == pytest.approx(1.8, rel=0.02)
        assert scan_path.size([rod]) <= 1.8 + 1e-9


def test_the_largest_frame_decides() -> None:
    frames = [np.random.default_rng(1).normal(size=(30, 3)) * scale for scale in (1.0, 3.0, 2.0)]
    assert scan_path.size(frames) == scan_path.size(frames[1:2])


def test_the_ratio_is_of_statures() -> None:
    small, tall = skinned_body("small"), skinned_body("tall", scale=1.5)
    standing = scan_path.standing(small)
    one, two = (scan_path.ratio([standing], each) for each in (small, tall))
    assert two / one == pytest.approx(1.5)
    assert one == pytest.approx(np.ptp(standing[:, 1]) / scan_path.size([standing]))


def test_poses_go_where_the_points_are() -> None:
    numbers = np.random.default_rng(2)
    vertices, points = (
        numbers.normal(size=(4, 10, 3)),
        list(numbers.normal(size=(4, 25, 3)) + np.array([3.0, 1.0, 0.0])),
    )
    path = scan_path.along(vertices, points, 0.5)
    for frame, each, pose in zip(points, path, vertices, strict=True):
        np.testing.assert_allclose(each - each[0], pose - pose[0], atol=1e-12)
        assert each[:, 1].min() == pytest.approx(0.5 * frame[:, 1].min())
        middle = 0.5 * (each.min(axis=0) + each.max(axis=0))
        expected = 0.25 * (frame.min(axis=0) + frame.max(axis=0))
        np.testing.assert_allclose(middle[[0, 2]], expected[[0, 2]], atol=1e-12)
