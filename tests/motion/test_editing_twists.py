"""Twist bones and their shares."""

from __future__ import annotations

import numpy as np
import pytest
from editing_bodies import body, gait, twists
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import retarget_bench as rb
from retarget_bench.motion import importer, rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.editing import twists as editing
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples

PLAIN, TWISTED = body(), body(twists(0.3, 0.6))


def turned(character: Character, role: str, vector: np.ndarray) -> Motion:
    """The reference pose with one joint turned by rotation vectors ``(frames, 3)`` in its own frame."""
    pose = np.repeat(character.reference_pose[None], len(vector), axis=0)
    joint = character.joint_of[role]
    pose[:, joint] = rotation.multiply(pose[:, joint], rotation.from_rotation_vector(vector))
    return character.motion(pose, np.zeros((len(vector), 3)), 30.0)


def about_bone(motion: Motion, bone: str, joint: str) -> np.ndarray:
    """Degrees that a joint is turned against another, which have the same axes at reference, about +X."""
    turns, names = transfer.relative(motion), motion.skeleton.names
    turn = rotation.multiply(rotation.conjugate(turns[:, names.index(bone)]), turns[:, names.index(joint)])
    return np.degrees(Rotation.from_quat(turn[:, [1, 2, 3, 0]]).as_rotvec()[:, 0])


@pytest.mark.parametrize(
    ("turning", "above", "bone"), [("hand", "ForeArm", "ForeArm"), ("arm", "Shoulder", "Arm")]
)
@given(angle=st.floats(-2.9, 2.9))
@examples(20)
def test_a_bone_takes_a_joint_s_twist_by_place(turning, above, bone, angle):
    """The forearm that of the hand; the upper arm its own, turned back towards the shoulder."""
    ramp = np.linspace(0.0, angle, 9)[:, None] * [1.0, 0.0, 0.0]
    answer = rb.retarget(turned(PLAIN, f"left_{turning}", ramp), TWISTED, "copy_rotations", hands="open")
    ends = {"LeftHand": 1.0} if turning == "hand" else {}
    for name, share in {f"Left{bone}Twist01": 0.3, f"Left{bone}Twist02": 0.6, **ends}.items():
        np.testing.assert_allclose(
            about_bone(answer, f"Left{above}", name), share * np.degrees(ramp[:, 0]), atol=1e-5
        )


@given(
    angle=st.floats(-2.0, 2.0),
    swing=st.floats(-1.2, 1.2),
    across=st.sampled_from([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]),
)
@examples(20)
def test_a_swing_of_the_wrist_does_not_count(angle, swing, across):
    """A bend after a twist: the share is that of the twist alone."""
    twist = Rotation.from_rotvec([angle, 0.0, 0.0])
    bent = Rotation.from_rotvec(swing * np.array(across))
    vector = (bent * twist).as_rotvec()[None]
    answer = rb.retarget(turned(PLAIN, "left_hand", vector), TWISTED, "copy_rotations", hands="open")
    np.testing.assert_allclose(
        about_bone(answer, "LeftForeArm", "LeftForeArmTwist02"), 0.6 * np.degrees(angle), atol=1e-5
    )


def test_a_twist_beyond_half_a_turn_goes_on():
    ramp = np.linspace(0.0, 1.5 * np.pi, 60)[:, None] * [1.0, 0.0, 0.0]
    source = turned(PLAIN, "left_hand", ramp)
    turn = transfer.relative(source)
    joints = PLAIN.joints(["left_forearm", "left_hand"])
    angles = editing.twist(*(turn[:, joint] for joint in joints), np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(angles, ramp[:, 0], atol=1e-9)


def test_nothing_else_moves():
    source = gait(PLAIN, seed=7)
    answer, plain = (rb.retarget(source, target, "ik") for target in (TWISTED, PLAIN))
    shared = [TWISTED.skeleton.index(name) for name in PLAIN.skeleton.names]
    np.testing.assert_allclose(answer.positions[:, shared], plain.positions, atol=1e-9)
    own, plain_turns = transfer.relative(answer)[:, shared], transfer.relative(plain)
    np.testing.assert_allclose(rotation.angle(own, plain_turns), 0.0, atol=1e-6)


def test_twist_bones_below_each_other_or_in_the_limb_take_the_same():
    source = gait(PLAIN, seed=8)
    beside = rb.retarget(source, TWISTED, "copy_rotations")
    chained = rb.retarget(source, body(twists(0.3, 0.6, chained=True)), "copy_rotations")
    between = rb.retarget(source, between_bones(), "copy_rotations")
    for other in (chained, between):
        for name in TWISTED.skeleton.names:
            if "Twist" in name or name in PLAIN.skeleton.names:
                a, b = (transfer.relative(each)[:, each.skeleton.index(name)] for each in (beside, other))
                np.testing.assert_allclose(rotation.angle(a, b), 0.0, atol=1e-6, err_msg=name)
    joints = [[each.skeleton.index(name) for name in PLAIN.skeleton.names] for each in (beside, between)]
    np.testing.assert_allclose(beside.positions[:, joints[0]], between.positions[:, joints[1]], atol=1e-9)


def between_bones() -> Character:
    """The twisted body with its twist bones as joints of the limbs: ends hang from the last of them."""
    plain = body(twists(0.3, 0.6, chained=True)).skeleton
    names, parents, offsets = list(plain.names), np.array(plain.parents), np.array(plain.offsets)
    for side in ("Left", "Right"):
        for bone, end in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg"), ("Leg", "Foot")):
            parents[names.index(f"{side}{end}")] = names.index(f"{side}{bone}Twist02")
            offsets[names.index(f"{side}{end}")] *= 0.4
    order: list[int] = []
    while len(order) < len(names):
        order += [
            j for j in range(len(names)) if j not in order and (parents[j] < 0 or parents[j] in order)
        ][:1]
    place = {old: new for new, old in enumerate(order)}
    above = np.array([place.get(int(parents[old]), -1) for old in order])
    return Character.of("body", Skeleton(tuple(names[old] for old in order), above, offsets[order]))


@pytest.mark.parametrize(
    ("along", "end", "expected"),
    [
        ([0.25, 0.5, 0.75], True, [0.25, 0.5, 0.75]),
        ([0.25, 0.5, 0.75], False, [0.25, 0.5, 0.75]),
        ([0.0, 0.5], True, [0.0, 0.5]),
        ([0.0, 0.5], False, [0.5, 1.0]),
        ([0.0], True, [0.5]),
        ([0.0], False, [0.5]),
        ([0.5], False, [0.5]),
        ([1.0], True, [0.5]),
        ([-0.1, 1.2], True, [0.0, 1.0]),
        ([], True, []),
    ],
)
def test_shares_follow_from_places(along, end, expected):
    assert editing.shares(along, end) == expected


def test_other_joints_named_so_are_no_twist_bones_and_faces_and_props_stay():
    extra = {
        "LeftRibsTwist": ("Spine1", (0.1, 0.0, 0.0)),
        "Jaw": ("Head", (0.0, 0.0, 0.1)),
        "LeftEye": ("Head", (0.03, 0.1, 0.1)),
        "Sword": ("RightHand", (-0.1, 0.0, 0.0)),
    }
    target = body(extra)
    assert editing.find(target) == ()
    answer = rb.retarget(gait(PLAIN, seed=9), target, "ik")
    for name in extra:
        joint = target.skeleton.index(name)
        still = np.repeat(target.reference_pose[None, joint], answer.frames, axis=0)
        np.testing.assert_allclose(rotation.angle(answer.rotations[:, joint], still), 0.0, atol=1e-6)


def test_twist_bones_that_correspond_are_the_source_s():
    source = gait(TWISTED, seed=10)
    answer = rb.retarget(source, body(twists(0.3, 0.6), size=1.2), "copy_rotations")
    np.testing.assert_allclose(rotation.angle(answer.rotations, source.rotations), 0.0, atol=1e-6)


@pytest.mark.parametrize("side", ["L", "R"])
@pytest.mark.parametrize("bone", ["Upperarm", "Forearm", "Thigh"])
def test_shares_are_those_of_iclone_s_own_twist_bones(real_data, bone, side):
    """Files as iClone wrote them: twist bones turned by its own rig, against ours by their places."""
    path = real_data / "cmu_iclone" / ("002_05.bvh" if bone == "Thigh" else "005_03.bvh")
    if not path.exists():
        pytest.skip(f"{path} is not there")
    motion = importer.load(path).motion
    shared = editing.shared(motion, np.ones(len(motion.skeleton), dtype=bool))
    for name in [f"CC_Base_{side}_{bone}Twist{number:02d}" for number in (1, 2)]:
        each = next(
            one for one in editing.find(motion.character) if motion.skeleton.names[one.joint] == name
        )
        turns, shared_turns = (transfer.relative(one) for one in (motion, shared))
        pair = each.bone if each.end else (each.above, each.bone[0])
        total = editing.twist(*(turns[:, joint] for joint in pair), each.axis)
        shares = [
            editing.twist(one[:, each.bone[0]], one[:, each.joint], each.axis)
            for one in (turns, shared_turns)
        ]
        off = np.diff(shares, axis=0)[0].std() / total.std()
        assert off < 0.17, name
