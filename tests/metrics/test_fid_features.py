"""What the features of FID see and do not see, in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from metric_cases import character, sides

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.metrics.fid import FEATURES, features
from retarget_bench.motion.motion import Positions
from retarget_bench.motion.skeleton import Skeleton

POSE, KNEES, TWIST, STANCE, FLOOR = slice(19), slice(17, 19), 19, 20, 21
SPEEDS, JOLTS, WAY = slice(22, 28), slice(28, 33), slice(33, 36)
SWING, STANDING, LIFE, LIMBS = 36, 37, 38, slice(39, 43)


def motion(frames: int = 100, seed: int = 0, fps: float = 30.0) -> Positions:
    """A body that wanders about, smoothly."""
    predicted = sides(frames, seed).predicted
    return Positions(predicted.character, predicted.positions, fps)


def moved(motion: Positions, angle: float, shift: tuple[float, float, float]) -> Positions:
    """Turned about the vertical axis and put elsewhere."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return Positions(motion.character, motion.positions @ turn.T + shift, motion.fps)


def seen(motion: Positions, floor: float = 0.0) -> np.ndarray:
    return features.features(motion, floor)[0]


def carried(velocity: tuple[float, float, float], turning: float = 0.0, frames: int = 90) -> Positions:
    """The rest pose carried along at heights a second, seen from it, and turned at radians a second."""
    body = character("Human")
    pose = np.zeros((1, len(body.skeleton), 4))
    pose[..., 0] = 1
    still = body.motion(pose, np.zeros((1, 3)), 30.0).positions[0]
    angle = turning * np.arange(frames) / 30
    c, s = np.cos(angle), np.sin(angle)
    left, up, ahead = np.array(velocity) * body.height
    steps = np.stack([c * left + s * ahead, 0 * c + up, c * ahead - s * left], axis=1) / 30
    x = c[:, None] * still[:, 0] + s[:, None] * still[:, 2]
    z = -s[:, None] * still[:, 0] + c[:, None] * still[:, 2]
    y = np.broadcast_to(still[:, 1], x.shape)
    return Positions(body, np.stack([x, y, z], axis=-1) + np.cumsum(steps, axis=0)[:, None], 30.0)


@pytest.mark.parametrize(("angle", "shift"), [(0.7, (3, 0, -8)), (np.pi, (0, 0, 0)), (-2.5, (100, 0, 1))])
def test_place_and_heading_are_not_seen(angle, shift):
    np.testing.assert_allclose(seen(moved(motion(), angle, shift)), seen(motion()), atol=1e-5)


def test_the_size_of_a_body_is_not_seen():
    clip = motion()
    own = clip.character
    skeleton = Skeleton(own.skeleton.names, own.skeleton.parents, 2.0 * own.skeleton.offsets)
    twice = replace(own, skeleton=skeleton, measures=replace(own.measures, height=2.0 * own.height))
    np.testing.assert_allclose(seen(Positions(twice, clip.positions * 2.0, 30.0)), seen(clip), atol=1e-5)


def test_the_height_over_the_floor_is_one_feature_and_the_floor_may_lie_anywhere():
    clip = motion()
    lifted = moved(clip, 0.0, (0, 0.5, 0))
    np.testing.assert_allclose(seen(lifted, floor=0.5), seen(clip), atol=1e-5)
    apart = seen(lifted) - seen(clip)
    assert (apart[:, FLOOR] > 0.0).all()
    np.testing.assert_allclose(np.delete(apart, FLOOR, axis=1), 0.0, atol=1e-5)


@pytest.mark.parametrize("height", [0.05, 0.2])
def test_a_body_in_the_air_is_as_high_as_its_lower_foot(height):
    clip = carried((0, 0, 0))
    body = clip.character
    feet = [body.joint_of[f"{side}_foot"] for side in ("left", "right")]
    lifted = moved(clip, 0.0, (0, height * body.height - clip.positions[0, feet, 1].min(), 0))
    expected = 5 * (np.tanh(height / 0.1) - np.tanh(0.5))
    np.testing.assert_allclose(seen(lifted)[:, FLOOR], expected, atol=1e-4)


def test_gliding_is_speeds_and_the_way_and_no_pose():
    still, gliding = seen(carried((0, 0, 0))), seen(carried((0, 0, 0.3)))
    middle = gliding[5:-5]  # what is smoothed at the ends repeats the last frame
    np.testing.assert_allclose(middle[:, POSE], still[5:-5, POSE], atol=1e-5)
    np.testing.assert_allclose(still[:, SPEEDS], 0.0, atol=1e-5)
    np.testing.assert_allclose(middle[:, SPEEDS], 2 * np.arcsinh(0.3), rtol=1e-4)
    np.testing.assert_allclose(middle[:, STANDING], 3 * np.tanh(0.3 / 0.1), rtol=1e-4)
    np.testing.assert_allclose(middle[:, LIFE], np.arcsinh(0.3 / 0.02) - np.arcsinh(20), rtol=1e-4)
    np.testing.assert_allclose(middle[:, JOLTS], 0.0, atol=1e-3)
    np.testing.assert_allclose(middle[:, WAY], [[0.0, 0.5 * np.arcsinh(1.0), 0.0]] * len(middle), atol=1e-3)


def test_the_way_is_seen_from_where_the_body_faces():
    middle = seen(carried((0.15, 0, 0), turning=0.5))[5:-5]
    expected = [0.5 * np.arcsinh(0.5), 0.0, 0.5 * np.arcsinh(0.5)]
    np.testing.assert_allclose(middle[:, WAY], [expected] * len(middle), atol=0.01)


def test_a_foot_that_swings_forward_is_told_from_one_that_swings_back():
    """Both are as high and as fast: the swing alone, and what it is to the left and right, changes sign."""
    clip = carried((0, 0, 0), frames=40)
    foot = clip.character.joint_of["left_foot"]
    places = clip.positions.copy()
    places[:, foot, 1] += 0.1 * clip.character.height
    places[:, foot, 2] += 0.4 * clip.character.height * np.arange(40) / 30
    forward = Positions(clip.character, places, 30.0)
    ahead, back = seen(forward)[2:-2], seen(forward.at(slice(None, None, -1)))[2:-2]
    assert (ahead[:, SWING] > 1.0).all()
    np.testing.assert_allclose(back[:, SWING], -ahead[::-1, SWING], atol=0.02)


def test_limbs_are_lengths_over_the_height():
    clip = motion()
    at = {role: clip.positions[0, joint] for role, joint in clip.character.joint_of.items()}
    arm, leg = (
        sum(np.linalg.norm(at[f"left_{a}"] - at[f"left_{b}"]) for a, b in chain) / clip.character.height
        for chain in ((("arm", "forearm"), ("forearm", "hand")), (("up_leg", "leg"), ("leg", "foot")))
    )
    measured = seen(clip)[:, LIMBS]
    np.testing.assert_allclose(measured[:, 0], (arm - 0.33) / 0.06, atol=1e-4)
    np.testing.assert_allclose(measured[:, 2], (leg - 0.45) / 0.06, atol=1e-4)


@pytest.mark.parametrize(("hertz", "least", "most"), [(2.0, 0.9, 1.0), (10.0, 0.05, 0.15)])
def test_what_is_faster_than_people_is_hardly_seen(hertz, least, most):
    """The filter's response: exp(-(2 pi f / 30)^2 / 2)."""
    wave = np.sin(2 * np.pi * hertz * np.arange(90) / 30)[:, None] * np.ones(3)
    kept = np.abs(features._smooth(wave))[10:-10].max() / np.abs(wave)[10:-10].max()
    assert least < kept < most
    assert kept == pytest.approx(np.exp(-0.5 * (2 * np.pi * hertz / 30) ** 2), abs=0.02)


def test_windows_are_cut_every_four_frames_and_short_clips_have_none():
    assert seen(motion(100)).shape == ((100 - 16) // 4 + 1, FEATURES)
    assert seen(motion(15)).shape == (0, FEATURES)
    assert seen(motion(1)).shape == (0, FEATURES)
    assert features.speeds(motion(15)).shape == (0,)


def test_other_rates_are_brought_to_thirty_frames_a_second():
    fast = motion(200, fps=60.0)
    slow = Positions(fast.character, fast.positions[::2], 30.0)
    np.testing.assert_allclose(seen(fast), seen(slow), atol=1e-5)


def test_a_knee_before_its_leg_and_turned_shoulders_are_seen():
    clip = carried((0, 0, 0))
    body, places = clip.character, clip.positions.copy()
    up, left_arm, right_arm = (body.joint_of[role] for role in ("left_leg", "left_arm", "right_arm"))
    places[:, up, 2] += 0.08 * body.height
    apart = seen(Positions(body, places, 30.0)) - seen(clip)
    np.testing.assert_allclose(apart[:, KNEES.start], 0.8, atol=1e-4)
    width = places[:, left_arm] - places[:, right_arm]
    places = clip.positions.copy()
    places[:, left_arm] = places[:, right_arm] + np.linalg.norm(width, axis=1)[:, None] * (
        np.array([np.cos(0.15), 0, -np.sin(0.15)])
    )
    assert seen(Positions(body, places, 30.0))[10, TWIST] == pytest.approx(0.15 / 0.3, abs=0.02)


def test_a_dog_stands_on_four_legs():
    """Three legs at rest do not make it glide, and all of them moving do."""
    dog = next(body for body in Puppets().characters().values() if body.four_legged)
    pose = np.broadcast_to(dog.reference_pose, (40, *dog.reference_pose.shape))
    still = dog.motion(pose, np.zeros((40, 3)), 30.0)
    places = np.array(still.positions)
    paws = [dog.joint_of[role] for role in ("left_foot", "right_foot", "left_hand")]
    places[:, paws, 2] += 0.3 * np.arange(40)[:, None] / 30
    three = seen(dog.positions(places, 30.0))
    places[:, dog.joint_of["right_hand"], 2] += 0.3 * np.arange(40) / 30
    four = seen(dog.positions(places, 30.0))
    np.testing.assert_allclose(three[:, STANDING], 0.0, atol=1e-4)
    assert (four[:, STANDING] > 1.0).all()


def test_every_puppet_has_features_and_a_body_without_a_hand_has_none():
    bodies = Puppets().characters().values()
    assert {features.unfit(body) for body in bodies} == {""}
    body = next(iter(bodies))
    maimed = replace(body, roles=tuple(None if role == "left_hand" else role for role in body.roles))
    assert features.unfit(maimed) == f"no joint of {body.name} is known as left_hand"
