"""copy_rotations and the root rules against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance, first
from scipy.spatial.transform import Rotation

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.motion import root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

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
    turn = Rotation.from_euler("Y", 70, degrees=True)
    spun = np.array(source.rotations)
    spun[:, 0] = first(turn * Rotation.from_quat(source.rotations[:, 0, [1, 2, 3, 0]]))
    moved = source.character.motion(spun, turn.apply(source.root), source.fps)
    expected = turn.apply(copied(source, target).positions.reshape(-1, 3))
    np.testing.assert_allclose(copied(moved, target).positions.reshape(-1, 3), expected, atol=1e-9)


@pytest.mark.parametrize(
    ("rule", "ratio"),
    [
        ("none", 1.0),
        ("height", 2.0),
        ("root_offset", 2.0),
        ("hip_height", 2.0),
        ("leg_length", 2.0),
        ("hip_height_width", 2.0),
        ("mixamo", 2.0),
    ],
)
def test_a_body_twice_as_large_goes_twice_as_far(rule, ratio):
    source = dance(body())
    result = copied(source, body("giant", scale=2.0), root_rule=rule)
    np.testing.assert_allclose(result.root, ratio * source.root, rtol=1e-9)


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
