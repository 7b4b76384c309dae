"""Loops: found, continued exactly, kept at other rates and by methods that filter in time."""

from __future__ import annotations

import numpy as np
import pytest
from editing_bodies import body, gait, squat
from hypothesis import given
from hypothesis import strategies as st

import retarget_bench as rb
from retarget_bench.api import Context
from retarget_bench.errors import SkeletonError
from retarget_bench.motion import rotation
from retarget_bench.motion.editing import loops
from retarget_bench.motion.rotation import about, multiply
from retarget_bench.plugins import registry
from tests.examples import examples

BODY, LARGE = body(), body(size=1.3)


@given(turn=st.floats(-2.5, 2.5), seed=st.integers(0, 99), frames=st.integers(3, 50))
@examples(20)
def test_a_gait_whose_last_frame_is_its_first_moved_as_a_whole_is_a_loop(turn, seed, frames):
    motion = gait(BODY, frames, turn=turn, seed=seed)
    assert loops.is_loop(motion)
    assert loops.gap(motion).angle < 1e-6
    assert loops.gap(motion).step == pytest.approx(turn, abs=1e-9)


def test_a_pose_or_a_height_that_differs_is_no_loop():
    motion = gait(BODY)
    assert not loops.is_loop(motion.at(slice(0, 20)))
    assert not loops.is_loop(motion.at(slice(0, 2)))
    higher = np.array(motion.root)
    higher[-1, 1] += 0.03 * BODY.height
    assert not loops.is_loop(BODY.motion(motion.rotations, higher, 30.0))
    tilted = np.array(motion.rotations)
    tilted[-1, 0] = multiply(about(np.array([1.0, 0.0, 0.0]), 0.06), tilted[-1, 0])
    assert not loops.is_loop(BODY.motion(tilted, motion.root, 30.0))


@given(turn=st.floats(-2.5, 2.5), frames=st.integers(4, 45))
@examples(15)
def test_a_continued_loop_repeats_moved_by_its_step(turn, frames):
    """Written out: every joint of the next period is the same joint of this one, turned and moved."""
    motion = gait(BODY, frames, turn=turn)
    complete, own = loops.continued(motion)
    np.testing.assert_allclose(complete.at(own).positions, motion.positions, atol=1e-9)
    assert min(own.start, complete.frames - own.stop) >= 29
    step, (first, last) = about(np.array([0.0, 1.0, 0.0]), turn), motion.root[[0, -1]]
    now, later = complete.positions[: -(frames - 1)], complete.positions[frames - 1 :]
    flat = np.array([1.0, 0.0, 1.0])
    # the step takes the first place to the last; any point of a period goes with it to the next
    expected = rotation.rotate(step[None, None], now - first * flat) + last * flat
    np.testing.assert_allclose(later, expected, atol=1e-7)


@given(fps=st.floats(7.0, 90.0), turn=st.floats(-2.0, 2.0))
@examples(25)
def test_a_loop_is_one_at_every_rate_and_lasts_as_long_to_half_a_frame(fps, turn):
    motion = gait(BODY, 32, turn=turn)
    resampled = loops.resampled(motion, fps)
    assert loops.is_loop(resampled)
    assert loops.gap(resampled).angle < 1e-6
    assert resampled.fps == fps
    assert abs((resampled.frames - 1) / fps - 31 / 30.0) <= 0.5 / fps + 1e-9
    np.testing.assert_allclose(resampled.root[[0, -1]], motion.root[[0, -1]], atol=1e-12)


def test_rates_of_other_motions_and_whole_steps_are_the_usual_ones():
    walk = gait(BODY, 31).at(slice(0, 20))
    np.testing.assert_array_equal(loops.resampled(walk, 17.0).root, walk.resample(17.0).root)
    loop = gait(BODY, 31)
    np.testing.assert_array_equal(loops.resampled(loop, 15.0).rotations, loop.resample(15.0).rotations)
    for wrong in (0.0, -5.0, np.nan):
        with pytest.raises(SkeletonError, match="must be positive"):
            loops.resampled(loop, wrong)


@given(seed=st.integers(0, 99), size=st.floats(0.0, 0.3))
@examples(15)
def test_closing_makes_ends_agree_and_leaves_the_middle(seed, size):
    motion, draw = gait(BODY, 61, turn=0.4), np.random.default_rng(seed)
    off = rotation.from_rotation_vector(size * draw.normal(size=(len(BODY.skeleton), 3)))
    rotations, root = np.array(motion.rotations), np.array(motion.root)
    rotations[-1], root[-1, 1] = multiply(rotations[-1], off), root[-1, 1] + size
    closed = loops.closed(BODY.motion(rotations, root, 30.0))
    gap = loops.gap(closed)
    assert max(gap.angle, abs(gap.height)) < 1e-6
    np.testing.assert_array_equal(closed.root[10:-10], root[10:-10])
    np.testing.assert_allclose(rotation.angle(closed.rotations[10:-10], rotations[10:-10]), 0.0, atol=1e-7)


@pytest.mark.parametrize("fps", [30.0, 24.0, 17.3])
@pytest.mark.parametrize("method", ["copy_rotations", "ik", "ik+smooth"])
def test_results_of_loops_are_loops(method, fps):
    source = loops.resampled(gait(BODY, 37, turn=0.3), fps)
    answer = rb.retarget(source, LARGE, method)
    assert answer.frames == source.frames
    assert loops.agrees(answer, source)


def test_a_method_that_filters_is_mended_by_going_on_and_hardly_by_closing():
    """``ik`` eases corrections at the ends of a clip; in the loop that goes on these lie elsewhere."""
    source, target = squat(BODY), body(shanks=1.3)
    method, context = registry.create("methods", "ik"), Context()
    plain = method.retarget(source, target, context=context)
    assert loops.gap(plain).angle > np.radians(0.1)
    complete, own = loops.continued(source)
    assert loops.gap(method.retarget(complete, target, context=context).at(own)).angle < 1e-5
    answer = rb.retarget(source, target, "ik")
    assert loops.gap(answer).angle < 1e-5
