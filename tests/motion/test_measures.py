"""Sizes of bodies against closed forms and sums over the text of hierarchies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from alignment_rigs import performance, reframed, rewritten, t_pose
from test_alignment import REFRAMED

from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import Measures, measure
from retarget_bench.motion.reference_pose import reference_pose
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.skeleton import EndSite, Skeleton

FOOT = math.hypot(0.06, 0.14)
TRUNK = 0.1 + 0.2 + 0.25 + 0.1
CHAIN = math.hypot(0.1, 0.05) + 0.45 + 0.42 + FOOT + 0.07 + TRUNK + 0.2
BY_HAND = Measures(
    height=CHAIN,
    h1=CHAIN,
    h2=TRUNK + 0.45 + 0.42 + FOOT,
    h4=0.05 + 0.45 + 0.42 + 0.06 + TRUNK + 0.2,
    leg_length=0.45 + 0.42,
    arm_length=0.28 + 0.25,
    hip_height=0.05 + 0.45 + 0.42 + 0.06,
    hip_width=0.2,
    root_offset=1.0,
)


def sizes(measures: Measures) -> np.ndarray:
    return np.array(list(vars(measures).values()))


def test_the_t_pose_body_by_hand():
    np.testing.assert_allclose(sizes(Character.of("t", t_pose()).measures), sizes(BY_HAND), rtol=1e-12)


@pytest.mark.parametrize("rig", REFRAMED)
def test_sizes_do_not_depend_on_how_the_rig_is_written(rig):
    body = Character.of("t", t_pose())
    moves = rewritten(body.skeleton, performance(body), REFRAMED[rig])
    other = Character.of(rig, reframed(body.skeleton, REFRAMED[rig]), sample=moves)
    np.testing.assert_allclose(sizes(other.measures), sizes(BY_HAND), rtol=1e-9)


def test_tips_count_for_extent_and_hip_height_but_not_for_chains():
    skeleton = t_pose()
    foot, head = skeleton.index("LeftToe_End"), skeleton.index("HeadTop_End")
    tipped = Skeleton(
        skeleton.names,
        skeleton.parents,
        skeleton.offsets,
        (EndSite(foot, (0.0, -0.03, 0.0)), EndSite(head, (0.0, 0.5, 0.0))),
    )
    measures = Character.of("t", tipped).measures
    assert measures.h4 == pytest.approx(BY_HAND.h4 + 0.53)
    assert measures.hip_height == pytest.approx(BY_HAND.hip_height + 0.03)
    assert (measures.height, measures.h1) == (pytest.approx(BY_HAND.height), pytest.approx(BY_HAND.h1))


def test_a_skeleton_that_is_no_body_is_measured_along_its_chains():
    rope = Skeleton(("a", "b", "c"), np.array([-1, 0, 1]), np.array([[0.0, 9, 0], [0, 0, 1], [0, 2, 0]]))
    measures = measure(rope, find(rope), rotation.identity(3))
    assert measures.height == measures.h1 == pytest.approx(3.0)
    assert measures.h4 == pytest.approx(2.0)
    assert not any((measures.leg_length, measures.arm_length, measures.hip_height, measures.hip_width))


def test_heights_of_other_rigs(real_data):
    """Typed from the bone lengths: LAFAN's 22 joints, and the dog's left hind leg and spine, neck, head."""
    lafan = bvh.read(real_data / "lafan1/Lafan1_example.bvh", scale=0.01).skeleton
    leg = 10.711 + 43.500 + 42.372 + 17.300
    trunk = 7.377 + 12.588 + 12.343 + 25.833 + 11.767
    measures = measure(lafan, find(lafan), reference_pose(lafan, find(lafan)))
    assert measures.height == pytest.approx((leg + trunk) / 100, abs=1e-4)
    dog = bvh.read(real_data / "dog/Dog_example.bvh", scale=0.01).skeleton
    hind = 10.840 + 16.0 + 18.0
    measures = measure(dog, find(dog), reference_pose(dog, find(dog)))
    assert measures.height == pytest.approx((hind + 19.0 + 22.508 + 14.0) / 100, abs=1e-4)
