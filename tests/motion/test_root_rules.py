"""Deviations from a source's path that fade."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.motion.root_rules import MEMORY, fading, relative


@pytest.mark.parametrize("fps", [30.0, 120.0])
def test_a_constant_speed_adds_up_to_that_of_the_memory(fps):
    """As a low-pass filter of first order answers a step: v T (1 - exp(-t / T)), whatever the rate."""
    frames = int(8 * MEMORY * fps)
    times = np.arange(1, frames + 1) / fps
    faded = fading(np.full((frames, 1), 0.5 / fps), fps)[:, 0]
    expected = 0.5 * MEMORY * (1.0 - np.exp(-times / MEMORY))
    np.testing.assert_allclose(faded, expected, atol=0.5 / fps)


def test_a_single_step_fades_to_a_share_of_e():
    frames = 31
    steps = np.zeros((frames, 3))
    steps[0] = 2.0, -1.0, 0.5
    faded = fading(steps, (frames - 1) / MEMORY)
    np.testing.assert_allclose(faded[-1], steps[0] / np.e, rtol=1e-12)


def test_chunks_give_exactly_what_the_whole_gives():
    steps = np.random.default_rng(0).normal(size=(50, 2, 3))
    complete, before, parts = fading(steps, 30.0), 0.0, []
    for part in (steps[:1], steps[1:20], steps[20:]):
        parts.append(fading(part, 30.0, before))
        before = parts[-1][-1]
    np.testing.assert_array_equal(np.concatenate(parts), complete)


def test_a_relative_path_begins_at_the_source_s_and_cannot_leave_it():
    numbers = np.random.default_rng(1)
    lead, path = np.cumsum(numbers.normal(size=(2, 3000, 3)), axis=1)
    moved = relative(path, lead, 30.0)
    np.testing.assert_array_equal(moved[0], lead[0])
    np.testing.assert_allclose(relative(lead + np.array([1.0, 2.0, 3.0]), lead, 30.0), lead, atol=1e-12)
    most = np.abs(np.diff(path - lead, axis=0)).max() / (1.0 - np.exp(-1.0 / (30.0 * MEMORY)))
    assert np.abs(moved - lead).max() < most
