"""Starts that do not belong to a motion: found, cut off, eased."""

from __future__ import annotations

import numpy as np
import pytest
from editing_bodies import BONES, Bones, body, gait, hen
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.editing import start
from tests.examples import examples

BODY = body()


def posed(
    frames: int, place: tuple[float, float, float], turn: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations and root of a T-pose that stands somewhere."""
    pose = np.repeat(BODY.reference_pose[None], frames, axis=0)
    pose[:, 0] = rotation.multiply(rotation.about(np.array([0.0, 1.0, 0.0]), turn)[None], pose[:, 0])
    return pose, np.repeat(np.array([place]), frames, axis=0)


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> Motion:
    rotations, root = (np.concatenate(each) for each in zip(*parts, strict=True))
    return BODY.motion(rotations, root, 30.0)


def walk(frames: int = 60, turn: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    moving = gait(BODY, frames, turn=turn)
    return moving.rotations, moving.root


@given(frames=st.integers(1, 8), x=st.floats(1.0, 9.0), turn=st.floats(-3.0, 3.0))
@examples(15)
def test_a_t_pose_elsewhere_is_found_with_its_frames_and_its_jump(frames, x, turn):
    motion = joined(posed(frames, (x, 1.0, -x), turn), walk())
    beginning = start.find(motion)
    assert beginning is not None
    assert (beginning.frames, beginning.cuts, beginning.t_pose) == (frames, (frames,), True)
    away = np.linalg.norm(motion.positions[frames] - motion.positions[frames - 1], axis=1).mean()
    assert beginning.jump == pytest.approx(away)
    cut = start.cut(motion, beginning)
    np.testing.assert_array_equal(cut.root, motion.root[frames:])
    np.testing.assert_array_equal(cut.rotations, motion.rotations[frames:])


@given(frames=st.integers(1, 8), x=st.floats(1.0, 9.0), turn=st.floats(-3.0, 3.0))
@examples(15)
def test_an_eased_start_has_all_frames_no_jump_and_the_motion_after_it(frames, x, turn):
    motion = joined(posed(frames, (x, 1.3, -x), turn), walk())
    eased = start.eased(motion, start.find(motion))
    assert eased.frames == motion.frames
    steps = np.linalg.norm(np.diff(eased.positions, axis=0), axis=-1)
    usual = np.linalg.norm(np.diff(motion.positions[frames:], axis=0), axis=-1).max()
    pose = np.linalg.norm(eased.positions[frames - 1] - motion.positions[frames + 15], axis=-1).max()
    assert steps.max() < usual + 2.0 * pose / 15  # of a smoothstep over 15 frames, 1.5 times its mean
    np.testing.assert_allclose(eased.positions[frames + 15 :], motion.positions[frames + 15 :], atol=1e-12)
    # it stands where the motion begins, turned alike, its feet as high, in its own pose
    np.testing.assert_allclose(eased.root[frames - 1, [0, 2]], motion.root[frames, [0, 2]], atol=1e-12)
    feet = BODY.joints(
        ["left_toe", "right_toe", "left_foot", "right_foot", "left_toe_end", "right_toe_end"]
    )
    low = [motion.positions[frames, feet, 1].min(), eased.positions[frames - 1, feet, 1].min()]
    assert low[0] == pytest.approx(low[1])
    np.testing.assert_allclose(
        rotation.angle(eased.rotations[0, 1:], motion.rotations[0, 1:]), 0.0, atol=1e-7
    )


def test_a_teleport_without_a_t_pose_is_one_too():
    rotations, root = walk(60)
    root = root.copy()
    root[:3] += [4.87, 0.0, 0.0]
    beginning = start.find(BODY.motion(rotations, root, 30.0))
    assert (beginning.frames, beginning.t_pose) == (3, False)
    assert beginning.jump == pytest.approx(4.87, abs=0.1)
    assert str(beginning).startswith("the first 3 frames are elsewhere, and joints are 4.8")
    eased = start.eased(BODY.motion(rotations, root, 30.0), beginning)
    assert np.linalg.norm(np.diff(eased.root, axis=0), axis=1).max() < 0.1


def test_a_t_pose_that_is_left_smoothly_lasts_until_the_arms_are_down():
    still, down = posed(20, (0.0, 1.0, 0.0)), posed(60, (0.0, 1.0, 0.0))
    share = np.clip(np.arange(60) / 20, 0.0, 1.0)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        turn = rotation.about(np.broadcast_to([0.0, 0.0, sign], (60, 3)), 1.2 * share)
        arm = BODY.joint_of[f"{side}_arm"]
        down[0][:, arm] = rotation.multiply(turn, down[0][:, arm])
    motion = joined(still, down)
    beginning = start.find(motion)
    assert (beginning.cuts, beginning.jump, beginning.t_pose) == ((), 0.0, True)
    assert beginning.frames == 40
    assert start.eased(motion, beginning) is motion
    assert str(beginning) == "the first 40 frames hold a T-pose and leave it"
    assert beginning.options == ("start=cut",), "there is nothing to ease"


def lowered(frames: int, arms: float, forward: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A T-pose with arms lowered and turned forward by so many degrees."""
    pose, root = posed(frames, (0.0, 1.0, 0.0))
    for side, sign in (("left", -1.0), ("right", 1.0)):
        arm = BODY.joint_of[f"{side}_arm"]
        down = rotation.about(np.array([0.0, 0.0, sign]), np.radians(arms))
        ahead = rotation.about(np.array([0.0, sign, 0.0]), np.radians(forward))
        pose[:, arm] = rotation.multiply(rotation.multiply(ahead, down)[None], pose[:, arm])
    return pose, root


def between(first: tuple[np.ndarray, np.ndarray], last: tuple[np.ndarray, np.ndarray], frames: int):
    share = np.arange(1, frames + 1)[:, None] / (frames + 1)
    turned = rotation.slerp(
        np.broadcast_to(first[0][-1], (frames, *first[0].shape[1:])), last[0][:1], share
    )
    return turned, first[1][-1] + share * (last[1][0] - first[1][-1])


@pytest.mark.parametrize(("arms", "forward", "hold"), [(20.0, 0.0, 15), (25.0, 20.0, 60), (38.0, 0.0, 30)])
def test_a_t_pose_as_actors_hold_it_is_found(arms, forward, hold):
    still, down = lowered(hold, arms, forward), lowered(30, 75.0)
    beginning = start.find(joined(still, between(still, down, 20), down, between(down, walk(), 20), walk()))
    assert (beginning.cuts, beginning.t_pose, beginning.held) == ((), True, "T-pose")
    assert hold <= beginning.frames <= hold + 20


def test_a_t_pose_that_is_held_after_a_cut_is_part_of_the_start():
    still, down = lowered(40, 20.0), lowered(30, 75.0)
    motion = joined(posed(1, (3.0, 1.0, 0.0)), still, between(still, down, 20), down)
    beginning = start.find(motion)
    assert (beginning.cuts, beginning.t_pose, beginning.held) == ((1,), True, "T-pose")
    assert 41 <= beginning.frames <= 61
    assert "; the next " in str(beginning)
    assert start.find(start.cut(motion, beginning)) is None, "nothing of it is left"
    eased = start.eased(motion, beginning)
    assert eased.frames == motion.frames
    assert np.linalg.norm(np.diff(eased.positions, axis=0), axis=-1).max() < 0.15


def test_poses_that_belong_to_a_motion_are_no_start():
    moving = walk()
    for arms in (45.0, 70.0, 85.0):  # an idle, arms down, or half down
        still = lowered(60, arms)
        assert start.find(joined(still, between(still, moving, 20), moving)) is None
    brief = lowered(10, 20.0)
    assert start.find(joined(brief, between(brief, moving, 20), moving)) is None, "held for a moment only"
    swinging = np.concatenate([lowered(1, 20.0 + 15.0 * np.sin(k / 4.0))[0] for k in range(60)])
    assert start.find(joined((swinging, lowered(60, 0.0)[1]), moving)) is None, "wings, not held"
    still = lowered(60, 20.0)
    motion = joined(moving, between(moving, still, 20), still, between(still, moving, 20), moving)
    assert start.find(motion) is None, "a T-pose in the middle is performed"


def drooping(degrees: float) -> Character:
    """The body with arms that hang down by so much at rest."""
    turn = np.radians(degrees)
    bones: Bones = {}
    for name, (above, (x, y, z)) in BONES.items():
        length = abs(x) if name.endswith(("ForeArm", "Hand")) else None
        lowered_to = (
            (np.sign(x) * length * np.cos(turn), y - length * np.sin(turn), z) if length else (x, y, z)
        )
        bones[name] = (above, lowered_to)
    return body(bones)


@pytest.mark.parametrize(("degrees", "held"), [(45.0, "rest pose"), (80.0, "")])
def test_a_rest_pose_that_is_held_is_a_start_unless_arms_hang_in_it(degrees, held):
    rig = drooping(degrees)
    moving = gait(rig, 60)
    still = rotation.identity(30, len(rig.skeleton)), np.repeat(moving.root[:1], 30, axis=0)
    parts = [still, between(still, (moving.rotations, moving.root), 20), (moving.rotations, moving.root)]
    beginning = start.find(rig.motion(*(np.concatenate(each) for each in zip(*parts, strict=True)), 30.0))
    assert (beginning.held if beginning else "") == held
    if beginning:
        assert 30 <= beginning.frames <= 50
        assert str(beginning) == f"the first {beginning.frames} frames hold a rest pose and leave it"


def test_motions_without_such_a_start_have_none():
    assert start.find(BODY.motion(*walk(), 30.0)) is None
    assert start.find(joined(posed(40, (0.0, 1.0, 0.0)))) is None, "in T-pose throughout"
    assert start.find(joined(walk(60), posed(5, (3.0, 1.0, 0.0)), walk(20))) is None, "a cut later on"
    bird = hen(wings=True)
    assert start.find(gait(bird)) is None
    for frames in range(3):
        assert start.find(BODY.motion(*(each[:frames] for each in walk()), 30.0)) is None


def test_positions_can_be_cut_and_not_eased():
    motion = joined(posed(1, (5.0, 1.0, 0.0)), walk())
    positions = BODY.positions(motion.positions, 30.0)
    beginning = start.find(positions)
    assert beginning == start.find(motion)
    assert start.cut(positions, beginning).frames == 60
    with pytest.raises(NotSupported, match="cut it instead"):
        start.eased(positions, beginning)
