"""What HuMoT sees of a body, parts of skeletons, and windows turned ahead."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from retarget_bench.methods.humot.features import (
    HEIGHTS,
    MAJOR,
    body,
    headings,
    parents_among,
    rotated,
    size_factor,
    stature,
    unfit,
    upright,
)
from retarget_bench.methods.humot.training import DROP_MAJOR, DROP_OTHER, subsampled
from retarget_bench.motion.aligned import neutral_pose
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


# ----------------------------------------------------------------------------------------------- directions
def window(rng, rows=5, frames=7, joints=9):
    template = rng.normal(size=(rows, joints, 3))
    places = template[:, None] + 0.2 * rng.normal(size=(rows, frames, joints, 3))
    return places, template, np.ones((rows, joints), bool), np.ones((rows, frames), bool)


def about_z(places, angle):
    return Rotation.from_euler("z", angle).apply(places.reshape(-1, 3)).reshape(places.shape)


def test_turning_is_about_the_vertical_axis():
    rng = np.random.default_rng(0)
    places, angles = rng.normal(size=(4, 3, 5, 3)), rng.uniform(-4, 4, 4)
    expected = np.stack([about_z(row, angle) for row, angle in zip(places, angles, strict=True)])
    np.testing.assert_allclose(rotated(places, angles), expected, atol=1e-12)


def test_no_angle_brings_template_and_window_nearer():
    places, template, joints, frames = window(np.random.default_rng(2), rows=3)
    angles = headings(places, template, joints, frames)
    mean = places.mean(1)
    mean, still = (each - each.mean(1, keepdims=True) for each in (mean, template))
    for row in range(3):
        tried = np.linspace(-np.pi, np.pi, 7201)
        apart = [np.square(about_z(still[row], angle) - mean[row]).sum() for angle in tried]
        best = tried[int(np.argmin(apart))]
        assert abs(np.angle(np.exp(1j * (best - angles[row])))) < 1e-3


def test_padding_says_nothing():
    places, template, joints, frames = window(np.random.default_rng(3))
    wider = np.pad(places, ((0, 0), (0, 4), (0, 3), (0, 0)), constant_values=9.0)
    longer = np.pad(template, ((0, 0), (0, 3), (0, 0)), constant_values=-5.0)
    padded = headings(wider, longer, np.pad(joints, ((0, 0), (0, 3))), np.pad(frames, ((0, 0), (0, 4))))
    np.testing.assert_allclose(padded, headings(places, template, joints, frames), atol=1e-12)


def test_a_single_joint_has_no_heading():
    places, template, _, frames = window(np.random.default_rng(4), joints=1)
    assert (headings(places, template, np.ones((5, 1), bool), frames) == 0.0).all()
