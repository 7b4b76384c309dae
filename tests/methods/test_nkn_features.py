"""Motions as NKN sees them, and back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from method_bodies import body, dance
from nkn_toys import CAST, apart
from scipy.spatial.transform import Rotation

from retarget_bench.methods.nkn import plugin
from retarget_bench.methods.nkn.features import Path, Sight, answer, begin, cleaned, see
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.motion import Motion

NKN = plugin(facing=5.0, lengths="world")


def turned(motion: Motion, degrees: float, away: tuple[float, float, float]) -> Motion:
    """The motion elsewhere, about the vertical axis."""
    turn = Rotation.from_euler("Y", degrees, degrees=True)
    rotations = np.array(motion.rotations)
    quarter = turn.as_quat()[[3, 0, 1, 2]]
    rotations[:, 0] = rotation.multiply(np.broadcast_to(quarter, rotations[:, 0].shape), rotations[:, 0])
    return motion.character.motion(rotations, turn.apply(motion.root) + away, motion.fps)


def at_thirty(motion: Motion, frames: int) -> Motion:
    """So many frames at 30 per second, the last of which may be beyond the end."""
    at = np.minimum(np.arange(frames) * motion.fps / 30.0, motion.frames - 1)
    low = np.minimum(at.astype(int), max(motion.frames - 2, 0))
    high = np.minimum(low + 1, motion.frames - 1)
    turns = rotation.slerp(motion.rotations[low], motion.rotations[high], (at - low)[:, None])
    return motion.character.motion(turns, motion.root[low], 30.0)


def back(motion: Motion, sight: Sight, unit: float = 0.01) -> Motion:
    """The motion from its movements and its own local rotations."""
    seen = NKN.body(motion.character)
    turns, _ = seen.see(at_thirty(motion, len(sight.poses)))
    path = Path(sight.hips[:1], sight.turn[:1], np.array([unit]))
    turn, hips = path.follow(sight.poses[:, None, -4:])
    turns[:, 0] = rotation.multiply(rotation.conjugate(facing.rotation(sight.turn)), turns[:, 0])
    return answer(seen, turns, turn[:, 0], hips[:, 0], motion.frames, motion.fps)


@pytest.mark.parametrize("lengths", ["world", "body"])
@pytest.mark.parametrize("name", CAST)
def test_movements_and_rotations_give_the_motion_back(name, lengths):
    method = plugin(facing=5.0, lengths=lengths)
    motion = turned(dance(CAST[name]), 40.0, (2.0, 0.3, -1.0))
    unit = 0.01 if lengths == "world" else CAST[name].measures.hip_height / 90.0
    assert apart(back(motion, method.see(motion), unit), motion) < 1e-5


def test_places_are_those_of_the_joints_seen_from_where_the_body_faces():
    motion = dance(CAST["one"])
    sight, seen = NKN.see(motion), NKN.body(CAST["one"])
    places = motion.positions[:, list(seen.joints)]
    yaw = np.angle(sight.turn)
    for frame in (0, 7, 39):
        local = Rotation.from_euler("Y", -yaw[frame]).apply(places[frame] - places[frame, 0]) * 100.0
        local[0, 1] = 100.0 * (places[frame, 0, 1] - places[0, 0, 1])
        np.testing.assert_allclose(sight.poses[frame, :66].reshape(22, 3), local, atol=1e-3)
        if frame:
            step = Rotation.from_euler("Y", -yaw[frame]).apply(places[frame, 0] - places[frame - 1, 0])
            np.testing.assert_allclose(sight.poses[frame, 66:69], 100.0 * step, atol=1e-3)
            turn = (yaw[frame] - yaw[frame - 1] + np.pi) % (2 * np.pi) - np.pi
            assert sight.poses[frame, 69] == pytest.approx(turn, abs=1e-5)
    np.testing.assert_array_equal(sight.poses[0, 66:], sight.poses[1, 66:])


@settings(max_examples=20, deadline=None)
@given(
    st.floats(-180, 180),
    st.tuples(st.floats(-5, 5), st.floats(-1, 1), st.floats(-5, 5)),
)
def test_neither_place_nor_direction_is_seen(degrees, away):
    motion = dance(CAST["one"])
    elsewhere = NKN.see(turned(motion, degrees, away)).poses
    np.testing.assert_allclose(elsewhere, NKN.see(motion).poses, atol=1e-3)


def test_own_lengths_make_scaled_bodies_the_same():
    method = plugin(lengths="body")
    motions = [dance(body(scale=scale)) for scale in (1.0, 1.7)]
    motions[1] = replace(motions[1], root=1.7 * motions[0].root)
    a, b = (method.see(motion).poses for motion in motions)
    np.testing.assert_allclose(a, b, atol=1e-3)
    np.testing.assert_allclose(*(method.bones(motion.character) for motion in motions), atol=1e-3)
    assert np.abs(NKN.see(motions[0]).poses - NKN.see(motions[1]).poses).max() > 1.0


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 60.0, 1 / 0.016667, 59.94, 120.0])
@pytest.mark.parametrize("frames", [1, 2, 61, 100])
def test_rates_keep_the_number_of_frames_and_the_motion(fps, frames):
    slow = dance(CAST["one"], 400)
    motion = replace(slow.at(slice(0, frames)), fps=fps)
    result = back(motion, NKN.see(motion))
    # in between, joints are taken to move straight on and the last moment may lie beyond the clip
    assert (result.frames, result.fps) == (frames, fps)
    assert apart(result.at(slice(0, max(frames - 4, 1))), motion.at(slice(0, max(frames - 4, 1)))) < 0.005


def test_twice_the_rate_is_every_other_frame():
    motion = dance(CAST["one"], 81)
    doubled = replace(motion, fps=60.0)
    np.testing.assert_array_equal(NKN.see(doubled).poses, NKN.see(motion.at(slice(0, None, 2))).poses)


def test_a_window_begins_at_its_own_height():
    poses = np.random.default_rng(0).normal(size=(2, 5, 70)).astype(np.float32)
    window = begin(poses)
    assert window[:, 0, 1].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.diff(window[..., 1]), np.diff(poses[..., 1]), atol=1e-6)
    np.testing.assert_array_equal(np.delete(window, 1, -1), np.delete(poses, 1, -1))


def test_a_path_goes_on_where_its_last_chunk_ended():
    numbers = np.random.default_rng(1)
    moves = numbers.normal(size=(11, 2, 4))
    start = numbers.normal(size=(2, 3)), np.exp(1j * numbers.normal(size=2)), np.array([0.01, 0.02])
    whole, path = Path(*start).follow(moves), Path(*start)
    parts = [path.follow(moves[part]) for part in (slice(0, 1), slice(1, 7), slice(7, 11))]
    for k in (0, 1):
        np.testing.assert_allclose(np.concatenate([part[k] for part in parts]), whole[k], atol=1e-12)
    np.testing.assert_allclose(whole[1][0], start[0], atol=1e-12)  # the first frame moves nothing


def test_cleaned_movements_have_the_sources_sign_and_do_not_rise_alone():
    moves = np.array([[1.0, -2.0, 3.0, -0.5], [-1.0, 2.0, 3.0, 0.5]])
    source = np.array([[-4.0, 0.5, 0.0, -0.1], [1.0, 0.005, -2.0, 0.1]])
    assert cleaned(moves, source).tolist() == [[-1.0, 2.0, 0.0, -0.5], [1.0, 0.0, -3.0, 0.5]]


def test_positions_are_seen_like_the_motion_they_are_of():
    motion = dance(CAST["long"])
    known = motion.character.positions(motion.positions, motion.fps)
    np.testing.assert_array_equal(NKN.see(known).poses, NKN.see(motion).poses)


def test_a_single_frame_stands_still():
    motion = dance(CAST["one"]).at(slice(0, 1))
    sight = see(motion, NKN.body(CAST["one"]), 20.0, 0.01)
    assert sight.poses.shape == (1, 70)
    np.testing.assert_allclose(sight.poses[0, 66:], 0.0, atol=1e-9)
