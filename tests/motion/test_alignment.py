"""The reference pose: exact on re-framed rigs, and true on real ones."""

from __future__ import annotations

import numpy as np
import pytest
from alignment_rigs import performance, reframed, rewritten, t_pose
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body import PosedBody, quarter_turns
from retarget_bench.motion.character import Character
from retarget_bench.motion.importer import load
from retarget_bench.motion.reference_pose import reference_pose
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.transfer import from_relative, orientations, relative
from tests.examples import examples

X, Y, Z = np.eye(3)
T_POSE = Character.of("t", t_pose())
MOVES = performance(T_POSE)
PLACES = np.tile([0.0, 1.0, 0.0], (len(MOVES), 1))
MOTION = T_POSE.motion(MOVES, PLACES, 30.0)


def frames(**turns: np.ndarray) -> np.ndarray:
    """Per joint how its frame is turned: the first of ``turns`` whose name is in the joint's name."""
    out = rotation.identity(len(T_POSE.skeleton))
    for joint, name in enumerate(T_POSE.skeleton.names):
        for word, turn in turns.items():
            if word in name:
                out[joint] = turn
                break
    return out


def turn(axis: np.ndarray, degrees: float) -> np.ndarray:
    return rotation.about(axis, np.radians(degrees))


def along_x(flip_right: bool) -> np.ndarray:
    """Frames with every bone along +X (right limbs along -X with ``flip_right``, as Bandai's rig)."""

    def frame(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return rotation.from_matrix(np.stack([x, y, np.cross(x, y)], axis=1))

    sign = -1.0 if flip_right else 1.0
    leg_right = frame(-Y * sign, Z * sign)
    slope = np.arctan2(0.06, 0.14)
    foot = rotation.multiply(turn(X, np.degrees(slope)), frame(Z, Y))
    foot_right = rotation.multiply(turn(X, np.degrees(slope)), frame(Z * sign, Y * sign))
    return frames(
        RightFoot=foot_right,
        LeftFoot=foot,
        RightToe=frame(Z * sign, Y * sign),
        LeftToe=frame(Z, Y),
        RightUpLeg=leg_right,
        RightLeg=leg_right,
        LeftUpLeg=frame(-Y, Z),
        LeftLeg=frame(-Y, Z),
        RightShoulder=frame(-X * sign, Z),
        RightArm=frame(-X * sign, Z),
        RightForeArm=frame(-X * sign, Z),
        RightHand=frame(-X * sign, Z),
        LeftShoulder=frame(X, -Z),
        LeftArm=frame(X, -Z),
        LeftForeArm=frame(X, -Z),
        LeftHand=frame(X, -Z),
        Hips=frame(Y, Z),
        Spine=frame(Y, Z),
        Neck=frame(Y, Z),
        Head=frame(Y, Z),
    )


REFRAMED = {
    "Z up": frames(**{"": turn(X, 90)}),
    "facing -X": frames(**{"": turn(Y, 90)}),
    "facing back, upside down": frames(**{"": turn(X, 180)}),
    "A-pose": frames(
        LeftArm=turn(Z, 45), LeftFore=turn(Z, 45), LeftHand=turn(Z, 45),
        RightArm=turn(Z, -45), RightFore=turn(Z, -45), RightHand=turn(Z, -45),
    ),
    "arms down, legs apart": frames(
        LeftArm=turn(Z, 90), LeftFore=turn(Z, 90), LeftHand=turn(Z, 90),
        RightArm=turn(Z, -90), RightFore=turn(Z, -90), RightHand=turn(Z, -90),
        LeftUpLeg=turn(Z, -20), LeftLeg=turn(Z, -20), LeftFoot=turn(Z, -20), LeftToe=turn(Z, -20),
        RightUpLeg=turn(Z, 20), RightLeg=turn(Z, 20), RightFoot=turn(Z, 20), RightToe=turn(Z, 20),
    ),
    "bones along +X": along_x(False),
    "bones along X, right side mirrored": along_x(True),
}  # fmt: skip


@pytest.mark.parametrize("rig", REFRAMED)
def test_a_motion_written_on_another_rig_is_the_same_relative_to_the_reference_pose(rig):
    skeleton = reframed(T_POSE.skeleton, REFRAMED[rig])
    rotations = rewritten(T_POSE.skeleton, MOVES, REFRAMED[rig])
    other = Character.of(rig, skeleton, sample=rotations)
    motion = other.motion(rotations, PLACES, 30.0)
    np.testing.assert_allclose(motion.positions, MOTION.positions, atol=1e-12)  # the same performance
    apart = rotation.angle(relative(motion), relative(MOTION))
    assert apart.max() < 1e-6
    # and there and back again
    back = from_relative(T_POSE, orientations(motion, T_POSE))
    assert rotation.angle(back, MOVES).max() < 1e-6
    assert (np.einsum("fjc,fjc->fj", back[1:], back[:-1]) > 0).all()  # continuous in sign


def test_a_t_pose_rig_keeps_its_own_rotations():
    """Limbs within the tolerance are left as they are, however the artist bent them."""
    np.testing.assert_array_equal(T_POSE.reference_pose, rotation.identity(len(T_POSE.skeleton)))
    bent = frames(LeftFore=turn(Y, 20), LeftHand=turn(Y, 20), RightLeg=turn(X, -18), RightFoot=turn(X, 9))
    skeleton = reframed(T_POSE.skeleton, bent)
    pose = reference_pose(skeleton, find(skeleton))
    np.testing.assert_array_equal(pose, rotation.identity(len(skeleton)))


@examples(25)
@given(st.lists(st.integers(0, 23), min_size=3, max_size=3))
def test_any_quarter_turns_of_the_trunk_are_found(turns):
    """Hips, spine and head of a rig along axes may be framed in any way: the result is the same."""
    framing = along_x(False)
    cube = quarter_turns()
    for name, number in zip(("Hips", "Spine1", "Head", "HeadTop_End"), [*turns, turns[-1]], strict=True):
        framing[T_POSE.skeleton.index(name)] = cube[number]
    skeleton = reframed(T_POSE.skeleton, framing)
    rotations = rewritten(T_POSE.skeleton, MOVES, framing)
    other = Character.of("x", skeleton, sample=rotations)
    if PosedBody(skeleton, other.roles).rests_in_a_pose:
        return
    apart = rotation.angle(relative(other.motion(rotations, PLACES, 30.0)), relative(MOTION))
    assert apart.max() < 1e-6


def test_eyes_that_a_rig_along_axes_turns_always_alike_look_ahead():
    """The face of such a rig may rest a quarter turn aside; all motion of it turns it back."""
    framing, plain = along_x(False), T_POSE.skeleton
    framing, moves = (np.concatenate([each, each[..., -1:, :]], axis=-2) for each in (framing, MOVES))
    framing[-1] = rotation.multiply(framing[plain.index("Head")], turn(Y, 90))
    moves[:, -1] = rotation.identity()
    faced = Skeleton(
        (*plain.names, "Eyes"),
        np.append(plain.parents, plain.index("Head")),
        np.append(plain.offsets, [[0.0, 0.1, 0.1]], axis=0),
    )
    rotations = rewritten(faced, moves, framing)
    other = Character.of("x", reframed(faced, framing), sample=rotations)
    assert np.degrees(rotation.angle(other.reference_globals[-1], framing[-1])) < 0.1


def test_without_a_sample_limbs_still_point_the_right_way():
    """Twist cannot be known then, directions can."""
    skeleton = reframed(T_POSE.skeleton, along_x(False))
    other = Character.of("x", skeleton)
    places, _ = kinematics.forward(skeleton, other.reference_pose, np.zeros(3))
    expected, _ = kinematics.forward(T_POSE.skeleton, T_POSE.reference_pose, np.zeros(3))
    joints = [j for j, name in enumerate(skeleton.names) if "Toe" not in name]
    np.testing.assert_allclose(places[joints], expected[joints], atol=1e-12)


def test_skeletons_that_are_no_body_keep_their_rest_pose():
    rope = Skeleton(("a", "b", "c"), np.array([-1, 0, 1]), np.ones((3, 3)))
    np.testing.assert_array_equal(reference_pose(rope, find(rope)), rotation.identity(3))


def test_a_sample_of_another_skeleton_is_refused():
    with pytest.raises(SkeletonError, match="sample of motion"):
        reference_pose(T_POSE.skeleton, T_POSE.roles, rotation.identity(5, 3))


LIMBS = {
    "upper arm": ("arm", "forearm"),
    "forearm": ("forearm", "hand"),
    "thigh": ("up_leg", "leg"),
    "shin": ("leg", "foot"),
    "foot": ("foot", "toe"),
}


def directions(character: Character, places: np.ndarray, limb: str) -> np.ndarray:
    """``(frames, 2, 3)`` unit vectors of a limb's bone, left and right."""
    start, end = LIMBS[limb]
    joint = character.joint_of
    lines = [places[:, joint[f"{s}_{end}"]] - places[:, joint[f"{s}_{start}"]] for s in ("left", "right")]
    line = np.stack(lines, axis=1)
    return line / np.linalg.norm(line, axis=-1, keepdims=True)


def degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


PAIRS = {
    "ACAAD/Female1_A05_PickUpBox_0": ("0", {}),
    "pfnn/LocomotionFlat01_000_3": ("1", {"shin": 5.0}),
    "lafan1/aiming1_subject1_0": ("2", {}),
    "SFU/0005_JumpRope001_0": ("6", {"thigh": 10.0, "shin": 10.0}),
}
"""Source -> result made by MotionBuilder, and limbs that its foot solver bends otherwise (degrees)."""


@pytest.mark.parametrize("source", PAIRS)
def test_carried_limbs_agree_with_motionbuilder(real_data, source):
    """Sources of four data sets with rest poses of their own; the target is a T-pose body."""
    number, looser = PAIRS[source]
    source_motion = load(real_data / f"same_pairs/{source}.bvh").motion
    reference = load(real_data / f"same_pairs/result/{number}.bvh").motion
    body, count = reference.character, min(source_motion.frames, reference.frames)
    turned = from_relative(body, orientations(source_motion, body))[5:count]
    carried = body.motion(turned, reference.root[5:count], reference.fps)
    for limb in LIMBS:
        apart = degrees(
            directions(body, carried.positions, limb), directions(body, reference.positions[5:count], limb)
        )
        assert apart.mean() < looser.get(limb, 4.5), limb
    for role in ("left_forearm", "right_forearm", "left_hand", "right_hand"):
        joint = body.joint_of[role]
        twisted = rotation.angle(
            carried.global_rotations[:, joint], reference.global_rotations[5:count, joint]
        )
        assert np.degrees(twisted).mean() < 6.0, role


@examples(60)
@given(st.data())
def test_no_body_is_so_odd_that_its_reference_pose_is_not_a_pose(data):
    """Any tree of body joints with any offsets, zero ones and all along one line included."""
    names = data.draw(st.lists(st.sampled_from(T_POSE.skeleton.names[1:]), unique=True, max_size=16))
    parents = [-1, *(data.draw(st.integers(0, k)) for k in range(len(names)))]
    number = st.sampled_from([0.0, 0.0, 1.0, -1.0, 0.3])
    offsets = data.draw(
        st.lists(st.tuples(number, number, number), min_size=len(parents), max_size=len(parents))
    )
    skeleton = Skeleton(("Hips", *names), np.array(parents), np.array(offsets))
    sample = data.draw(st.none() | st.integers(0, 2**32 - 1))
    if sample is not None:
        draw = np.random.Generator(np.random.PCG64(sample))
        sample = rotation.normalise(draw.normal(size=(5, len(parents), 4)))
    body = Character.of("odd", skeleton, sample=sample)
    np.testing.assert_allclose(np.linalg.norm(body.reference_pose, axis=-1), 1.0, atol=1e-9)
    assert np.isfinite(list(vars(body.measures).values())).all()


def test_a_rig_along_no_axis_is_placed_by_its_motion_alone():
    """Every joint's frame turned at random: directions to a few degrees, hinges exactly."""
    draw = np.random.Generator(np.random.PCG64(1))
    framing = rotation.normalise(draw.normal(size=(len(T_POSE.skeleton), 4)))
    skeleton = reframed(T_POSE.skeleton, framing)
    rotations = rewritten(T_POSE.skeleton, MOVES, framing)
    other = Character.of("random", skeleton, sample=rotations)
    assert not PosedBody(skeleton, other.roles).along_axes
    apart = np.degrees(rotation.angle(other.reference_globals, framing))
    by_role = {role: apart[joint] for role, joint in other.joint_of.items()}
    for role in ("left_arm", "right_forearm", "left_up_leg", "right_leg"):
        assert by_role[role] < 1e-3, role
    for role in ("hips", "spine_1", "spine_2", "neck", "left_shoulder", "right_hand", "left_foot"):
        assert by_role[role] < 15.0, role
