"""What SAME sees: the authors' features, and what they must not depend on."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
from method_bodies import dance

from retarget_bench.methods.same import features
from retarget_bench.methods.same.bodies import body, unfit
from retarget_bench.methods.same.features import BEFORE, CHANGE, CONTACT, POSITION, ROOT, VELOCITY, see
from retarget_bench.methods.same.inference import integrated
from retarget_bench.motion import kinematics, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.skeleton import EndSite, Skeleton


@pytest.fixture
def motion() -> Motion:
    return dance(same_material.BODIES["small"])


def moved(motion: Motion, angle: float, by: tuple[float, float, float]) -> Motion:
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), angle)
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    return motion.character.motion(rotations, rotation.rotate(turn, motion.root) + by, motion.fps)


# ------------------------------------------------------------------------------------------ the authors'
@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_features_are_the_authors(real_data, pair) -> None:
    arrays = same_material.oracle(real_data)
    source, target = (
        same_material.standing(real_data / "same_pairs" / name) for name in arrays[f"{pair}/files"]
    )
    same_body = body(source.character)
    nodes = same_material.order(list(same_body.skeleton.names), arrays[f"{pair}/source/names"].tolist())
    features = see(same_body, source)[1:41, nodes]
    scale = [
        np.concatenate([arrays[f"stats/{part}_{kind}"] for part in ("q", "p", "r", "pv", "qv", "pprev")])
        for kind in "ms"
    ]
    expected = arrays[f"{pair}/source/features"][..., 6:].copy()
    expected[..., :25] = expected[..., :25] * scale[1] + scale[0]
    for columns in (slice(0, 9), VELOCITY, CHANGE, BEFORE, CONTACT):
        np.testing.assert_allclose(features[..., columns], expected[..., columns], atol=2e-4)
    np.testing.assert_allclose(features[:, 0, ROOT], expected[:, 0, ROOT], atol=1e-4)
    for side, character in (("source", source.character), ("target", target.character)):
        same_body = body(character)
        nodes = same_material.order(list(same_body.skeleton.names), arrays[f"{pair}/{side}/names"].tolist())
        np.testing.assert_allclose(
            same_body.shape[nodes, :3], arrays[f"{pair}/{side}/local_offsets"], atol=1e-4
        )
        np.testing.assert_allclose(
            same_body.shape[nodes, 3:], arrays[f"{pair}/{side}/global_offsets"], atol=1e-4
        )


# -------------------------------------------------------------------------------------------- properties
def test_where_it_is_and_faces_changes_nothing(motion) -> None:
    same_body = body(motion.character)
    features, other = see(same_body, motion), see(same_body, moved(motion, 2.1, (3.0, 0.0, -5.0)))
    np.testing.assert_allclose(features, other, atol=1e-3)
    higher = see(same_body, moved(motion, 0.0, (0.0, 0.5, 0.0)))
    np.testing.assert_allclose(higher[:, 0, ROOT.stop - 1] - features[:, 0, ROOT.stop - 1], 50.0, atol=1e-3)


def test_the_first_frame_moves_as_the_second_does(motion) -> None:
    features = see(body(motion.character), motion)
    for columns in (VELOCITY, CHANGE):
        np.testing.assert_array_equal(features[0, :, columns], features[1, :, columns])
    np.testing.assert_array_equal(features[0, 0, 9:12], features[1, 0, 9:12])
    np.testing.assert_allclose(
        features[..., POSITION] - features[..., VELOCITY] / 30.0, features[..., BEFORE], atol=1e-4
    )


def test_one_frame_stands_still(motion) -> None:
    features = see(body(motion.character), motion.at(slice(1)))
    assert not features[..., VELOCITY].any()
    assert not features[0, 0, 9:12].any()
    np.testing.assert_array_equal(
        features[..., CHANGE], np.broadcast_to([1, 0, 0, 0, 1, 0], features[..., CHANGE].shape)
    )


def test_moves_add_up_to_the_path(motion) -> None:
    turning = rotation.about(np.array([0.0, 1.0, 0.0]), np.linspace(0.3, 9.0, motion.frames))
    rotations = motion.rotations.copy()
    rotations[:, 0] = rotation.multiply(turning, rotations[:, 0])
    spun = motion.character.motion(rotations, motion.root, motion.fps)
    facing = features.twist(transfer.relative(spun)[:, 0])
    moves = see(body(spun.character), spun)[:, 0, ROOT].astype(float)
    angles, hips = integrated(moves, float(features.angle(facing[:1])[0]), transfer.hips(spun)[0])
    np.testing.assert_allclose(hips, transfer.hips(spun), atol=1e-5)
    turned = rotation.about(np.array([0.0, 1.0, 0.0]), angles)
    assert np.degrees(rotation.angle(turned, facing)).max() < 1e-3


def test_twist_leaves_no_turn_about_the_vertical_axis() -> None:
    any_ = rotation.from_rotation_vector(np.random.default_rng(0).normal(size=(50, 3)))
    rest = rotation.multiply(rotation.conjugate(features.twist(any_)), any_)
    assert np.abs(rest[:, 2]).max() < 1e-12
    upside_down = np.array([[0.0, 1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(features.twist(upside_down), [[1, 0, 0, 0]])


def test_low_and_slow_nodes_are_in_contact() -> None:
    motion = moved(dance(same_material.BODIES["small"], 300), 0.0, (0.0, -0.05, 0.0))
    same_body = body(motion.character)
    rotations, hips = same_body.aligned.see(motion)
    places = kinematics.forward(same_body.aligned.skeleton, rotations, hips)[0]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=-1) * 30
    expected = (places[1:, :, 1] < 0.05) & (speed < 0.4)
    features = see(same_body, motion)[1:, : len(same_body.aligned.joints), CONTACT.start]
    assert 0.01 < expected.mean() < 0.5
    np.testing.assert_array_equal(features.astype(bool), expected)


# ------------------------------------------------------------------------------------------------ bodies
def test_last_joints_have_tips_and_fingers_are_their_ends() -> None:
    plain = same_material.BODIES["plain"]
    old = plain.skeleton
    hand = old.index("LeftHand")
    names = (*old.names, "LeftHandIndex1", "LeftHandThumb1")
    offsets = np.concatenate([old.offsets, [[0.1, 0.0, 0.0], [0.06, 0.0, 0.04]]])
    fingered = Character.of(
        "fingered", Skeleton(names, np.append(old.parents, [hand, hand]), offsets, old.end_sites)
    )
    same_body = body(fingered)
    assert not any("Index" in name or "Thumb" in name for name in same_body.skeleton.names)
    tip = same_body.skeleton.index("LeftHand tip")
    np.testing.assert_allclose(same_body.skeleton.offsets[tip], [0.08, 0.0, 0.02], atol=1e-6)
    assert not same_body.skeleton.offsets[same_body.skeleton.index("Head tip")].any()
    toe = same_body.skeleton.offsets[same_body.skeleton.index("LeftToeBase tip")]
    np.testing.assert_allclose(toe, [0.0, 0.0, 0.05], atol=1e-6)
    assert same_body.turning.tolist() == [" tip" not in name for name in same_body.skeleton.names]


def test_joints_that_are_tips_have_no_other_behind_them() -> None:
    plain = same_material.BODIES["plain"].skeleton
    head = plain.index("Head")
    names = (*plain.names, "HeadTop_End")
    offsets = np.concatenate([plain.offsets, [[0.0, 0.2, 0.0]]])
    topped = Character.of(
        "topped", Skeleton(names, np.append(plain.parents, head), offsets, plain.end_sites)
    )
    same_body = body(topped)
    assert "HeadTop_End tip" not in same_body.skeleton.names
    assert "Head tip" not in same_body.skeleton.names
    assert same_body.turning[same_body.skeleton.index("Head")]
    assert not same_body.turning[same_body.skeleton.index("HeadTop_End")]


def test_bodies_without_hips_are_refused() -> None:
    names, parents = ("Thing", "Other"), np.array([-1, 0])
    offsets = np.array([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0]])
    thing = Character.of(
        "thing", Skeleton(names, parents, offsets, (EndSite(1, (0.0, 0.1, 0.0)),)), roles=(None, None)
    )
    assert "no joint of thing is known as hips" in unfit(thing)
    assert unfit(same_material.BODIES["plain"]) == ""
