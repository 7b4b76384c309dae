"""What HuMoT sees of a body, and parts of skeletons as skeletons of their own."""

from __future__ import annotations

import numpy as np
import pan_material
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.methods.humot.features import (
    HEIGHTS,
    MAJOR,
    body,
    parents_among,
    size_factor,
    stature,
    unfit,
    upright,
)
from retarget_bench.methods.humot.training import DROP_MAJOR, DROP_OTHER, subsampled
from retarget_bench.motion.aligned import neutral_pose
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec

PUPPETS = bound.dataset(Spec.parse("puppets[size=tiny]")).built.characters()
BODIES = {each.structure: each for each in PUPPETS.values() if not each.four_legged}
DOG = next(each for each in PUPPETS.values() if each.four_legged)


def test_axes_turn_and_turn_back():
    places = np.random.default_rng(0).normal(size=(5, 7, 3))
    np.testing.assert_array_equal(upright(upright(places)), places)
    np.testing.assert_array_equal(upright(np.array([0.0, 1.0, 0.0])), [0.0, 0.0, 1.0])  # up is Z
    np.testing.assert_array_equal(upright(np.array([0.0, 0.0, 1.0])), [0.0, 1.0, 0.0])  # ahead is Y
    turn = upright(np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)  # and left stays left


@pytest.mark.parametrize("structure", sorted(BODIES))
def test_twelve_major_joints_and_hips_first(structure):
    humot_body = body(BODIES[structure])
    assert humot_body.character.roles[humot_body.joints[0]] == "hips"
    assert humot_body.parents[0] == -1
    assert all(0 <= parent < place for place, parent in enumerate(humot_body.parents) if place)
    assert humot_body.major.sum() == len(MAJOR) == 12
    assert np.abs(humot_body.template[0]).max() < 1e-12
    assert humot_body.template[:, 2].max() > 0.3 > -0.3 > humot_body.template[:, 2].min()


@pytest.mark.parametrize("structure", sorted(BODIES))
def test_places_of_the_joints_seen_come_back(structure):
    character = BODIES[structure]
    humot_body = body(character)
    numbers = np.random.default_rng(1)
    root = numbers.normal(size=(4, 3))
    motion = character.motion(np.repeat(neutral_pose(character)[None], 4, axis=0), root, 30.0)
    back = humot_body.positions(humot_body.see(motion), 30.0)
    np.testing.assert_allclose(back.positions, motion.positions, atol=1e-9)


def test_joints_that_are_not_seen_follow_their_bones():
    """A finger of a hand that is moved with the fore-arm."""
    names = ("Hips", "Spine", "Head", "LeftArm", "LeftForeArm", "LeftHand", "LeftHandIndex1")
    parents = np.array([-1, 0, 1, 1, 3, 4, 5])
    offsets = np.array(
        [[0, 1, 0], [0, 0.3, 0], [0, 0.3, 0], [0.2, 0.2, 0], [0.3, 0, 0], [0.3, 0, 0], [0.1, 0, 0]], float
    )
    character = Character.of("fingered", Skeleton(names, parents, offsets))
    humot_body = body(character)
    assert 6 not in humot_body.joints
    pose = neutral_pose(character)
    turned = np.array([pose, pose])
    turned[1, 3] = [np.cos(0.4), 0.0, 0.0, np.sin(0.4)]  # swings the arm in the plane that it hangs in
    motion = character.motion(turned, np.zeros((2, 3)), 30.0)
    restored = humot_body.positions(humot_body.see(motion), 30.0).positions
    np.testing.assert_allclose(restored, motion.positions, atol=1e-9)


@pytest.mark.parametrize("words", [("Shoulder", "Arm", "ForeArm", "Hand"), ("UpLeg", "Leg", "Foot", "Toe")])
def test_a_body_without_arms_or_without_legs_is_no_smaller(words):
    one = pan_material.BODIES["one"]
    joints = [f"{side}{word}" for side in ("Left", "Right") for word in words]
    part = pan_material.without(one, *joints, structure="lacking")
    assert len(part.skeleton) < len(one.skeleton)
    assert body(part).major.sum() == 6
    assert body(part).stature == pytest.approx(body(one).stature, rel=0.15)


def test_puppets_are_as_tall_by_their_legs_or_arms_alone():
    every = [body(each) for each in PUPPETS.values() if not each.four_legged]
    for limb in (("foot", "leg", "up_leg"), ("arm", "forearm", "hand"), ("leg", "forearm")):
        ratios = []
        for humot_body in every:
            known = np.isin(humot_body.heights, [HEIGHTS[part] for part in limb])
            assert known.sum() == 2 * len(limb)
            ratios.append(
                stature(humot_body.template, np.where(known, humot_body.heights, np.nan))
                / humot_body.stature
            )
        assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)
        assert np.mean(np.abs(np.log(ratios)) < 0.25) > 0.9  # one has arms to the floor
    for humot_body in every:
        ankles_to_shoulders = (
            humot_body.template[humot_body.heights == 1.0, 2].max()
            - humot_body.template[:, 2][humot_body.heights == 0.0].min()
        )
        assert humot_body.stature == pytest.approx(ankles_to_shoulders)


def test_one_height_tells_no_stature():
    humot_body = body(BODIES["h36m17"])
    for part in ("arm", "foot"):
        assert (
            stature(
                humot_body.template,
                np.where(humot_body.heights == HEIGHTS[part], humot_body.heights, np.nan),
            )
            == 0.0
        )
    assert size_factor(0.0) == 1.0


def test_bodies_on_four_legs_are_refused():
    assert "stands on four legs" in unfit(DOG)
    assert not any(unfit(each) for each in BODIES.values())


def test_joints_are_left_out_as_often_as_the_paper_says():
    numbers = np.random.default_rng(2)
    major = np.arange(40) < 12
    count = 3000
    stays = sum(np.bincount(subsampled(numbers, major), minlength=40) for _ in range(count)) / count
    for share, drop in ((stays[:12], DROP_MAJOR), (stays[12:], DROP_OTHER)):
        assert np.abs(share - (1.0 - drop)).max() < 5.0 * np.sqrt(drop * (1.0 - drop) / count)


@given(st.integers(0, 2**32 - 1), st.integers(1, 4))
def test_at_least_two_joints_stay(seed, joints):
    subset = subsampled(np.random.default_rng(seed), np.zeros(joints, bool))
    assert len(subset) >= min(2, joints)
    assert (np.diff(subset) > 0).all()


@given(st.data())
def test_parents_are_the_nearest_that_stay(data):
    count = data.draw(st.integers(2, 12))
    parents = [-1, *(data.draw(st.integers(0, joint - 1)) for joint in range(1, count))]
    joints = np.array(sorted(data.draw(st.sets(st.integers(0, count - 1), min_size=1))))
    nearest = parents_among(parents, joints)
    for place, joint in enumerate(joints):
        line, above = [], parents[joint]
        while above >= 0:
            line.append(above)
            above = parents[above]
        expected = [each for each in line if each in joints]
        assert (joints[nearest[place]] if nearest[place] >= 0 else None) == (
            expected[0] if expected else None
        )
