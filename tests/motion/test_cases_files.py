"""Small files from public bug reports: how they are written, and what they hold."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.importer import load


def same_motion(one, other):
    """Whether two imported files hold one motion of one body."""
    assert one.motion.skeleton.same_as(other.motion.skeleton)
    assert one.motion.fps == other.motion.fps
    np.testing.assert_allclose(one.motion.rotations, other.motion.rotations, atol=1e-6)
    np.testing.assert_allclose(one.motion.root, other.motion.root, atol=1e-6)


@pytest.mark.parametrize(
    "name", ["01_comma", "10_comment", "11_wrapped", "11b_one_line", "28_trailing_blank_frames"]
)
def test_dress_of_numbers(real_data, name):
    base = load(real_data / "cases/07_mirrored_left_handed/00_base.bvh")
    same_motion(load(real_data / f"cases/19_number_dress/{name}.bvh"), base)


def test_no_frame_time(real_data):
    base = load(real_data / "cases/07_mirrored_left_handed/00_base.bvh", Reading(rate=30.0))
    path = real_data / "cases/18_frame_time_zero_with_rate/06_ft0.bvh"
    same_motion(load(path, Reading(rate=30.0)), base)
