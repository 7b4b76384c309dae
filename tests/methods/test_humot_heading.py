"""Windows turned ahead: the angle against a search and another library."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from retarget_bench.methods.humot.features import headings, rotated


def window(rng, rows=5, frames=7, joints=9):
    template = rng.normal(size=(rows, joints, 3))
    places = template[:, None] + 0.2 * rng.normal(size=(rows, frames, joints, 3))
    return places, template, np.ones((rows, joints), bool), np.ones((rows, frames), bool)


def about_z(places, angle):
    return Rotation.from_euler("z", angle).apply(places.reshape(-1, 3)).reshape(places.shape)


def test_turning_is_about_the_vertical_axis():
    rng = np.random.default_rng(0)
    places, angles = rng.normal(size=(4, 3, 5, 3)), rng.uniform(-4, 4, 4)
    expected = np.stack([about_z(row, angle) for row, angle in zip(places, angles, strict=True)])
    np.testing.assert_allclose(rotated(places, angles), expected, atol=1e-12)


@pytest.mark.parametrize("angle", [-2.9, -1.0, 0.3, 3.0])
def test_a_window_that_is_turned_is_turned_back(angle):
    places, *rest = window(np.random.default_rng(1))
    first = headings(places, *rest)
    again = headings(about_z(places, angle), *rest)
    np.testing.assert_allclose(np.exp(1j * (again - first)), np.exp(1j * angle), atol=1e-9)
    np.testing.assert_allclose(headings(rotated(places, -first), *rest), 0.0, atol=1e-9)


def test_no_angle_brings_template_and_window_nearer():
    places, template, joints, frames = window(np.random.default_rng(2), rows=3)
    angles = headings(places, template, joints, frames)
    mean = places.mean(1)
    mean, still = (each - each.mean(1, keepdims=True) for each in (mean, template))
    for row in range(3):
        tried = np.linspace(-np.pi, np.pi, 7201)
        apart = [np.square(about_z(still[row], angle) - mean[row]).sum() for angle in tried]
        best = tried[int(np.argmin(apart))]
        assert abs(np.angle(np.exp(1j * (best - angles[row])))) < 1e-3


def test_padding_says_nothing():
    places, template, joints, frames = window(np.random.default_rng(3))
    wider = np.pad(places, ((0, 0), (0, 4), (0, 3), (0, 0)), constant_values=9.0)
    longer = np.pad(template, ((0, 0), (0, 3), (0, 0)), constant_values=-5.0)
    padded = headings(wider, longer, np.pad(joints, ((0, 0), (0, 3))), np.pad(frames, ((0, 0), (0, 4))))
    np.testing.assert_allclose(padded, headings(places, template, joints, frames), atol=1e-12)


def test_a_single_joint_has_no_heading():
    places, template, _, frames = window(np.random.default_rng(4), joints=1)
    assert (headings(places, template, np.ones((5, 1), bool), frames) == 0.0).all()
