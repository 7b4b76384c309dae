"""Methods without networks against closed forms: copies, bone directions, root rules, controls."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance, elsewhere, squat
from scipy.spatial.transform import Rotation

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.bone_directions import counterparts
from retarget_bench.methods.bone_directions import plugin as BoneDirections
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.other_clip import plugin as OtherClip
from retarget_bench.methods.other_clip import to_and_fro
from retarget_bench.methods.reference import plugin as Reference
from retarget_bench.methods.rest_pose import plugin as RestPose
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Positions

NOTHING = Context()


def copied(source: Motion, target: Character, **parameters) -> Motion:
    return CopyRotations(**parameters).retarget(source, target, context=NOTHING)


@pytest.mark.parametrize("rule", [rule for rule in root_rules.ROOT_RULES if rule != "reference"])
def test_onto_itself_it_changes_nothing(rule):
    source = dance(body())
    result = copied(source, source.character, root_rule=rule)
    np.testing.assert_allclose(result.positions, source.positions, atol=1e-12)


def test_t_pose_rigs_exchange_local_rotations():
    source, target = dance(body()), body("long", thigh=0.6, arm=0.2)
    result = copied(source, target)
    agree = np.abs(np.einsum("fjc,fjc->fj", result.rotations, source.rotations))
    np.testing.assert_allclose(agree, 1.0, atol=1e-12)


def test_the_rest_pose_does_not_matter():
    """The same body drawn with hanging arms takes the same poses."""
    source = dance(body())
    result = copied(source, body("hanging", droop=50.0))
    np.testing.assert_allclose(result.positions, source.positions, atol=1e-9)


def test_spines_of_other_counts_end_in_the_same_chest():
    source, target = dance(body(spines=2)), body(spines=5)
    result = copied(source, target)
    chest, neck = (source.skeleton.index("Spine1"), target.skeleton.index("Spine4"))
    agree = np.einsum("fc,fc->f", source.global_rotations[:, chest], result.global_rotations[:, neck])
    np.testing.assert_allclose(np.abs(agree), 1.0, atol=1e-9)


def test_turning_the_source_turns_the_result():
    source, target = dance(body()), body("short", thigh=0.3, spines=4)
    expected = Rotation.from_euler("Y", 70, degrees=True).apply(
        copied(source, target).positions.reshape(-1, 3)
    )
    turned = copied(elsewhere(source, 70.0), target).positions
    np.testing.assert_allclose(turned.reshape(-1, 3), expected, atol=1e-9)


@pytest.mark.parametrize("rule", [rule for rule in root_rules.ROOT_RULES if rule != "reference"])
def test_a_body_twice_as_large_goes_twice_as_far(rule):
    source = dance(body())
    result = copied(source, body("giant", scale=2.0), root_rule=rule)
    np.testing.assert_allclose(result.root, (1.0 if rule == "none" else 2.0) * source.root, rtol=1e-9)


def test_rules_measure_what_they_say():
    small, other = body(), body("other", thigh=0.6, shin=0.5, hip=0.2)
    both = {rule: root_rules.ratios(rule, small, other) for rule in root_rules.SIZES}
    ratios = {rule: level for rule, (level, _, _) in both.items()}
    ankle, bone = 0.1, np.hypot(0.15, 0.1)
    assert ratios["leg_length"] == pytest.approx(1.1 / 0.87)
    assert ratios["hip_height"] == pytest.approx((1.1 + ankle) / (0.87 + ankle))
    assert ratios["root_offset"] == pytest.approx((1.1 + ankle) / (0.87 + ankle))
    width = (1.1 + ankle + 0.6 * 0.4) / (0.87 + ankle + 0.6 * 0.2)
    assert ratios["hip_height_width"] == pytest.approx(width)
    assert both["mixamo"] == pytest.approx([width, ratios["hip_height"], width])
    assert all(level == height for rule, (level, height, _) in both.items() if rule != "mixamo")
    head = 0.5 + 0.12 + np.hypot(0.1, 0.02)
    height = (0.2 + 1.1 + bone + head) / (0.1 + 0.87 + bone + head)
    assert ratios["height"] == pytest.approx(height)


def test_the_reference_rule_is_privileged_and_takes_the_reference_path():
    source, target = dance(body()), body("giant", scale=2.0)
    reference = dance(target, seed=5)
    method = CopyRotations(root_rule="reference")
    assert method.card.needs == ("reference",)
    assert CopyRotations().card.needs == ()
    result = method.retarget(source, target, context=Context(reference=reference))
    np.testing.assert_array_equal(result.root, reference.root)
    with pytest.raises(NotSupported, match="needs a reference"):
        method.retarget(source, target, context=NOTHING)


def test_what_cannot_be_done_is_said():
    source = dance(body())
    with pytest.raises(NotSupported, match="rules are none, height"):
        CopyRotations(root_rule="hight")
    positions = source.character.positions(source.positions, 30.0)
    with pytest.raises(NotSupported, match="needs a source with rotations"):
        CopyRotations().retarget(positions, source.character, context=NOTHING)
    floating = body("floating")
    bare = Character.of(
        "bare", type(floating.skeleton)(("a", "b"), np.array([-1, 0]), np.array([[0, 0, 0], [0, 1, 0]]))
    )
    assert "no joint of bare is known as hips" in (CopyRotations().supports(floating, bare) or "")
    assert CopyRotations().supports(floating, floating) is None


# ------------------------------------------------------------------------------------------------- controls
def test_rest_pose_stands_still_on_the_floor_facing_forward():
    source, target = dance(body()), body("small", scale=0.5, droop=45.0)
    result = RestPose().retarget(source, target, context=Context())
    assert np.ptp(result.positions, axis=0).max() == pytest.approx(0.0, abs=1e-12)
    joint = result.positions[0]
    assert joint[target.joints(["left_toe", "right_toe"]), 1] == pytest.approx(0.0, abs=1e-9)
    arm = joint[target.joint_of["left_hand"]] - joint[target.joint_of["left_arm"]]
    assert arm / np.linalg.norm(arm) == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert result.root[0, [0, 2]] == pytest.approx(0.5 * source.root.mean(axis=0)[[0, 2]])


def test_reference_hands_back_the_right_answer():
    source, right = dance(body()), dance(body(), seed=1)
    assert Reference().retarget(source, right.character, context=Context(reference=right)) is right
    with pytest.raises(NotSupported, match="no reference"):
        Reference().retarget(source, right.character, context=Context())


@pytest.mark.parametrize(("length", "frames"), [(1, 4), (2, 5), (5, 3), (5, 17)])
def test_to_and_fro_walks_back_at_the_ends(length, frames):
    expected, at, step = [], 0, 1
    for _ in range(frames):
        expected.append(at)
        if length > 1:
            step = -step if not 0 <= at + step < length else step
            at += step
    assert to_and_fro(length, frames).tolist() == expected


def test_other_clip_does_not_look_at_the_source():
    target = body("target")
    others = [dance(target, frames=25, seed=seed) for seed in (7, 8, 9)]
    sources = [dance(body(), frames=60, seed=seed) for seed in (1, 2)]
    results = [
        OtherClip().retarget(each, target, context=Context(seed=11, other_clips=others)) for each in sources
    ]
    np.testing.assert_array_equal(results[0].positions, results[1].positions)
    np.testing.assert_array_equal(results[0].positions[:25], others[11 % 3].positions)
    assert results[0].frames == 60
    with pytest.raises(NotSupported, match="no other clip"):
        OtherClip().retarget(sources[0], target, context=Context(other_clips=[]))


def test_other_clip_takes_the_rate_of_the_source():
    target = body("target")
    clip = dance(target, frames=30)
    source = dance(body(), frames=50).resample(15.0)
    result = OtherClip().retarget(source, target, context=Context(other_clips=[clip]))
    assert result.fps == source.fps
    np.testing.assert_allclose(result.positions[:15], clip.positions[::2], atol=1e-12)


def test_controls_are_marked():
    for control in (RestPose, Reference, OtherClip):
        assert control().card.control
    assert Reference().card.needs == ("reference",)
    assert OtherClip().card.needs == ("other_clips",)


def test_rest_pose_needs_positions_only():
    source = dance(body())
    positions = source.character.positions(source.positions, source.fps)
    results = [RestPose().retarget(each, body(), context=Context()) for each in (source, positions)]
    np.testing.assert_allclose(results[0].positions, results[1].positions, atol=1e-12)


# -------------------------------------------------------------------------------------- directions of bones
LIMBS = (("arm", "forearm"), ("forearm", "hand"), ("up_leg", "leg"), ("leg", "foot"))


def bone(motion: Motion, side: str, bone: tuple[str, str]) -> np.ndarray:
    start, end = (motion.character.joint_of[f"{side}_{part}"] for part in bone)
    along = motion.positions[:, end] - motion.positions[:, start]
    return along / np.linalg.norm(along, axis=-1, keepdims=True)


def pointed(source: Motion | Positions, target: Character) -> Motion:
    return BoneDirections().retarget(source, target, context=Context())


def test_positions_alone_give_the_same_body_its_positions_back():
    source = dance(body())
    result = pointed(source.character.positions(source.positions, source.fps), source.character)
    np.testing.assert_allclose(result.positions, source.positions, atol=1e-4)


@pytest.mark.parametrize("with_rotations", [True, False])
def test_limbs_point_where_the_source_points(with_rotations):
    motion, target = dance(body()), body("other", thigh=0.3, arm=0.4, shoulder=0.3, droop=40.0, spines=5)
    source = motion if with_rotations else motion.character.positions(motion.positions, motion.fps)
    result = pointed(source, target)
    for side in ("left", "right"):
        for each in LIMBS:
            np.testing.assert_allclose(bone(result, side, each), bone(motion, side, each), atol=1e-9)


def test_twist_comes_from_the_source_where_it_has_rotations():
    source = dance(body())
    result = pointed(source, body("tall", thigh=0.7, shin=0.7))
    agree = np.abs(np.einsum("fjc,fjc->fj", result.rotations, source.rotations))
    np.testing.assert_allclose(agree, 1.0, atol=1e-9)


def test_knees_bend_about_their_hinge_when_only_positions_are_known():
    """The plane of a bent leg fixes the twist of its thigh: the knee turns about left-right."""
    source = squat(body(), deepest=60.0)
    result = pointed(source.character.positions(source.positions, source.fps), source.character)
    knee = result.rotations[len(result.rotations) // 2, source.skeleton.index("LeftLeg")]
    assert abs(knee[1]) > 0.5
    np.testing.assert_allclose(knee[2:], 0.0, atol=1e-6)


def test_a_spine_of_another_count_is_cut_along_its_length():
    source, target = dance(body(spines=2)), body(spines=4)
    counterpart_positions, known = counterparts(source.positions, source.character, target)
    assert known.all()
    joints = [source.skeleton.index(name) for name in ("Hips", "Spine", "Spine1", "Neck")]
    line = source.positions[:, joints]
    # the trunk of 0.62 m has joints at 0.25 and 0.5 m; the new ones lie every 0.125 m
    expected = line[:, 0] + 0.5 * (line[:, 1] - line[:, 0])
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine")], expected, atol=1e-12
    )
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine1")], line[:, 1], atol=1e-12
    )
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine3")], line[:, 2], atol=1e-12
    )
