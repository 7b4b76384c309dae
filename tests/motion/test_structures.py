"""Reduced bodies: joints and order of the papers, places kept, errors that say what is missing."""

from __future__ import annotations

import numpy as np
import pytest
from alignment_rigs import performance, t_pose
from role_schemes import SCHEMES

from retarget_bench.errors import NotSupported, SkeletonError
from retarget_bench.motion import bvh, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.structures import Reduction, reduce


def deviation(reduction: Reduction, motion: Motion) -> float:
    """Metres: the largest distance between a kept joint before and after."""
    apart = reduction.apply(motion).positions - motion.positions[:, list(reduction.joints)]
    return float(np.linalg.norm(apart, axis=-1).max())


def words(*lines: str) -> list[str]:
    return " ".join(lines).split()


LEGS = words(
    "LeftUpLeg LeftLeg LeftFoot LeftToeBase",
    "RightUpLeg RightLeg RightFoot RightToeBase",
)
ARMS = words(
    "LeftShoulder LeftArm LeftForeArm LeftHand",
    "RightShoulder RightArm RightForeArm RightHand",
)
NKN_ORDER = [*words("Hips Spine Spine1 Spine2 Neck Head"), *LEGS, *ARMS]
NKN_PARENTS = [-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 3, 18, 19, 20]
S23_ORDER = [*words("Hips Pelvis"), *LEGS, *words("Spine Spine1 Spine2 Neck Head"), *ARMS]
S23_PARENTS = [-1, 0, 1, 2, 3, 4, 1, 6, 7, 8, 0, 10, 11, 12, 13, 12, 15, 16, 17, 12, 19, 20, 21]
S28_ORDER = words(
    "Hips LeftUpLeg LeftLeg LeftFoot LeftToeBase LeftToe_End",
    "RightUpLeg RightLeg RightFoot RightToeBase RightToe_End",
    "Spine Spine1 Spine1_split Spine2 Neck Head HeadTop_End",
    "LeftShoulder LeftShoulder_split LeftArm LeftForeArm LeftHand",
    "RightShoulder RightShoulder_split RightArm RightForeArm RightHand",
)
S28_PARENTS = [
    *(-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 0, 11, 12, 13, 14, 15, 16, 14, 18, 19, 20, 21),
    *(14, 23, 24, 25, 26),
]
LISTS = {
    "body22": (NKN_ORDER, NKN_PARENTS),
    "S23": (S23_ORDER, S23_PARENTS),
    "S28": (S28_ORDER, S28_PARENTS),
}


def clip(real_data, file: str) -> Motion:
    recording = bvh.read(real_data / file, scale=0.01)
    body = Character.of(file, recording.skeleton, structure="native", sample=recording.rotations)
    return body.motion(recording.rotations, recording.root, recording.fps)


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("mixamo_san/Aj/Praying.bvh", "S23"),
        ("mixamo_san/BigVegas/Praying.bvh", "S23"),
        ("mixamo_san/Goblin_m/Praying.bvh", "S28"),
        ("mixamo_san/Mousey_m/Praying.bvh", "S28"),
        ("mixamo_san/Goblin_m/Praying.bvh", "body22"),
        ("mixamo_san/Kaya/Praying.bvh", "body22"),
        ("mixamo_r2et/Ortiz/Angry.bvh", "body22"),
    ],
)
def test_joints_order_and_places_on_mixamo(real_data, file, name):
    motion = clip(real_data, file)
    reduction = reduce(motion.character, name)
    body, expected = reduction.character, LISTS[name]
    assert [each.rpartition(":")[2] for each in body.skeleton.names] == expected[0]
    assert body.skeleton.parents.tolist() == expected[1]
    reduced = reduction.apply(motion)
    np.testing.assert_allclose(reduced.positions, motion.positions[:, list(reduction.joints)], atol=2e-8)
    assert deviation(reduction, motion) < 2e-8
    assert body.measures == motion.character.measures
    assert (body.structure, body.name) == ("native", motion.character.name)


def test_a_left_out_joint_that_turns_shows_as_deviation():
    """Toe ends aside, body22 of this body leaves out nothing: turn a helper by a known angle."""
    skeleton = t_pose()
    names = list(skeleton.names)
    names[names.index("Spine")] = "Spine_split"
    body = Character.of("t", type(skeleton)(tuple(names), skeleton.parents, skeleton.offsets))
    moves = rotation.identity(1, len(skeleton))
    moves[0, names.index("Spine_split")] = rotation.about(np.array([0.0, 0.0, 1.0]), 0.3)
    motion = body.motion(moves, np.zeros((1, 3)), 30.0)
    reduction = reduce(body, "body22")
    # Spine1 was 0.2 above the helper; without it, it is 0.2 further straight up
    assert deviation(reduction, motion) == pytest.approx(2 * 0.2 * np.sin(0.15), rel=1e-9)
    assert deviation(reduction, body.motion(rotation.identity(1, len(names)), np.zeros((1, 3)), 30.0)) == 0


def test_a_longer_spine_gives_three_of_its_joints():
    skeleton, _ = SCHEMES["Xsens"].body()
    names = reduce(Character.of("xsens", skeleton), "body22").character.skeleton.names
    assert names[:4] == ("Pelvis", "L5", "T12", "T8")


def test_the_ends_become_tips():
    reduced = reduce(Character.of("t", t_pose()), "body22").character.skeleton
    tips = {reduced.names[site.parent]: site.offset for site in reduced.end_sites}
    assert tips == {
        "Head": pytest.approx((0.0, 0.2, 0.0)),
        "LeftToeBase": pytest.approx((0.0, 0.0, 0.07)),
        "RightToeBase": pytest.approx((0.0, 0.0, 0.07)),
    }


def test_what_cannot_be_reduced_is_explained(real_data):
    body = Character.of("t", t_pose())
    with pytest.raises(NotSupported, match="no structure 'S24'; structures are body22, S23, S28"):
        reduce(body, "S24")
    with pytest.raises(SkeletonError, match="t has no Pelvis, Spine2, which S23 needs"):
        reduce(body, "S23")
    dog = bvh.read(real_data / "dog/Dog_example.bvh").skeleton
    assert len(reduce(Character.of("dog", dog), "body22").joints) == 19
    headless = dict(zip(body.skeleton.names, body.roles, strict=True)) | {"Head": None, "LeftHand": None}
    nobody = Character.of("nobody", body.skeleton, roles=list(headless.values()))
    with pytest.raises(SkeletonError, match=r"nobody cannot be reduced .* known as head, left_hand"):
        reduce(nobody, "body22")


def test_a_motion_of_another_body_is_refused():
    body, other = Character.of("t", t_pose()), Character.of("big", t_pose())
    grown = type(body.skeleton)(body.skeleton.names, body.skeleton.parents, body.skeleton.offsets * 2)
    other = Character.of("big", grown)
    motion = other.motion(performance(other, 3), np.zeros((3, 3)), 30.0)
    with pytest.raises(
        SkeletonError, match="reduction of t to body22 cannot be applied to a motion of big"
    ):
        reduce(body, "body22").apply(motion)
