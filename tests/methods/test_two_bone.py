"""The closed-form limb against what a limb must do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from retarget_bench.motion import rotation
from retarget_bench.motion.planting.two_bone import LEG, Limb, Pose, ease_reach, fold, slowed

FRAMES = 8
vectors = arrays(np.float64, (FRAMES, 3), elements=st.floats(-1.0, 1.0))


def solve(upper, lower, goal, axis):
    """World turns of both bones: the fold, and the shortest arc that then points the limb at its goal."""
    second = fold(upper, lower, goal, axis)
    first = rotation.between(upper + rotation.rotate(second, lower), goal)
    return first, rotation.multiply(first, second)


def lengths(v: np.ndarray) -> np.ndarray:
    return np.linalg.norm(v, axis=-1)


@given(upper=vectors, lower=vectors, towards=vectors, share=st.floats(0.05, 0.95))
def test_reaches_whatever_is_in_reach(upper, lower, towards, share):
    usable = (lengths(upper) > 0.1) & (lengths(lower) > 0.1) & (lengths(towards) > 0.1)
    usable &= lengths(np.cross(upper, lower)) > 1e-3 * lengths(upper) * lengths(lower)
    upper, lower, towards = (v[usable] for v in (upper, lower, towards))
    a, b = lengths(upper), lengths(lower)
    nearest, furthest = np.abs(a - b) + 0.2 * np.minimum(a, b), (a + b) * 0.9
    far = nearest + share * np.maximum(furthest - nearest, 0.0)
    goal = towards / lengths(towards)[:, None] * far[:, None]
    first, second = solve(upper, lower, goal, np.zeros_like(goal))
    end = rotation.rotate(first, upper) + rotation.rotate(second, lower)
    np.testing.assert_allclose(end, goal, atol=1e-7)


def test_out_of_reach_points_at_the_goal():
    upper, lower = np.array([[0.0, -0.5, 0.1]]), np.array([[0.0, -0.4, -0.1]])
    goal = np.array([[2.0, -1.0, 0.5]])
    first, second = solve(upper, lower, goal, np.array([[1.0, 0.0, 0.0]]))
    end = rotation.rotate(first, upper) + rotation.rotate(second, lower)
    np.testing.assert_allclose(np.cross(end, goal), 0.0, atol=1e-9)
    assert lengths(end)[0] == pytest.approx(lengths(upper)[0] + lengths(lower)[0], rel=1e-9)


@pytest.mark.parametrize("lean", [0.0, -0.02, 0.02])
def test_a_straight_leg_folds_with_its_knee_forward(lean):
    """Also when it is a little overstretched, where the bend at hand points the wrong way."""
    upper, lower = np.array([[0.0, -0.5, 0.0]]), np.array([[0.0, -0.5, lean]])
    goal = np.array([[0.0, -0.8, 0.0]])
    first, second = solve(upper, lower, goal, np.array([[1.0, 0.0, 0.0]]))
    knee = rotation.rotate(first, upper)
    assert knee[0, 2] > 0.2
    np.testing.assert_allclose(knee + rotation.rotate(second, lower), goal, atol=1e-9)


def test_a_limb_at_its_goal_is_left_alone():
    random = np.random.default_rng(3)
    upper, lower = random.normal(size=(2, 50, 3))
    axis = np.cross(upper, lower)
    first, second = solve(upper, lower, upper + lower, axis / lengths(axis)[:, None])
    still = np.broadcast_to([1.0, 0.0, 0.0, 0.0], first.shape)
    assert rotation.angle(first, still).max() < 1e-6
    assert rotation.angle(second, still).max() < 1e-6


def test_hands_are_not_made_to_lock_or_fold_an_arm():
    """One arm of 1 m, bent by 90 degrees; goals straight out from the shoulder at growing distance."""
    distance = np.linspace(0.01, 1.5, 200)
    places = np.broadcast_to([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.0, 0.5]], (200, 3, 3))
    pose = Pose(rotation.identity(200, 3), np.zeros((200, 3)), np.array(places), rotation.identity(200, 3))
    limb = Limb(0, 1, 2, -1, np.array([0.0, -1.0, 0.0]))
    goal = distance[:, None] * [0.6, 0.8, 0.0]
    eased = ease_reach(pose, limb, goal)
    far = lengths(eased)
    np.testing.assert_allclose(np.cross(eased, goal), 0.0, atol=1e-12)
    free = (distance > 0.4) & (distance < 0.9)
    np.testing.assert_allclose(far[free], distance[free], atol=1e-12)
    assert (np.diff(far) > 0.0).all()
    assert np.abs(np.diff(far, 2)).max() < 2e-3  # no kink where easing begins
    assert far.min() > 0.25
    assert far.max() < 0.98


def test_what_was_copied_stays_allowed():
    places = np.array([[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.999, 0.0, 0.02]]])
    pose = Pose(rotation.identity(1, 3), np.zeros((1, 3)), places, rotation.identity(1, 3))
    limb = Limb(0, 1, 2, -1, np.array([0.0, -1.0, 0.0]))
    np.testing.assert_allclose(ease_reach(pose, limb, places[:, 2]), places[:, 2], atol=1e-12)


def test_legs_reach_their_goals_until_they_are_nearly_straight():
    places = np.broadcast_to([[0.0, 1.0, 0.0], [0.5, 1.0, 0.0], [0.5, 1.0, 0.5]], (200, 3, 3))
    pose = Pose(rotation.identity(200, 3), np.zeros((200, 3)), np.array(places), rotation.identity(200, 3))
    goal = np.linspace(0.01, 2.0, 200)[:, None] * [0.0, -1.0, 0.0] + [0.0, 1.0, 0.0]
    far = lengths(ease_reach(pose, Limb(0, 1, 2, -1, np.zeros(3)), goal, LEG) - places[:, 0])
    near = lengths(goal - places[:, 0]) <= 0.97
    np.testing.assert_allclose(far[near], lengths(goal - places[:, 0])[near], atol=1e-12)
    assert np.diff(far).min() > -1e-12
    assert far.max() < 0.99 + 1e-12


@pytest.mark.parametrize("fps", [30.0, 120.0])
def test_a_snap_takes_no_more_than_its_speed_and_nothing_else_changes(fps):
    """A joint that swings by up to 4 degrees a frame is to turn by 70 degrees at once, and back."""
    time = np.arange(400)
    copied = rotation.about(np.array([[1.0, 0.0, 0.0]]), np.radians(40.0) * np.sin(time / 10.0))
    snap = np.where((time >= 200) & (time < 205), np.radians(70.0), 0.0)
    expected = rotation.multiply(rotation.about(np.array([[0.6, 0.8, 0.0]]), snap), copied)
    limited = slowed(copied, expected, fps)
    fastest, speed = (np.degrees(rotation.angle(each[1:], each[:-1])) for each in (copied, limited))
    assert speed.max() < 1.5 * max(fastest.max(), 60.0 / fps)
    away = np.abs(time - 202) > 60
    np.testing.assert_allclose(rotation.angle(limited, expected)[away], 0.0, atol=1e-6)
    np.testing.assert_array_equal(slowed(copied, copied, fps), copied)
