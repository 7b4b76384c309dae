"""Fingers: those of the source, those of a neighbour, or a relaxed hand."""

from __future__ import annotations

import numpy as np
import pytest
from alignment_rigs import reframed
from editing_bodies import FINGERS, body, fingers, gait
from hypothesis import given
from hypothesis import strategies as st

import retarget_bench as rb
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.editing import fingers as editing
from retarget_bench.motion.skeleton import EndSite, Skeleton
from tests.examples import examples

BARE, FULL = body(), body(fingers())


def bends(character: Character, rotations: np.ndarray, side: str, finger: str) -> np.ndarray:
    """Degrees by which each bone of a finger points down from the line of the hand, palm down."""
    places = character.motion(rotations[None], np.zeros((1, 3)), 30.0).positions[0]
    line = places[editing.fingers(character, side)[finger.lower()]]
    bones = np.diff(line, axis=0)
    return np.degrees(np.arctan2(-bones[:, 1], np.abs(bones[:, 0])))


def curled(character: Character) -> np.ndarray:
    pose = np.array(character.reference_pose)
    for side in ("left", "right"):
        for joint, local in editing.curl(character, side).items():
            pose[joint] = local
    return pose


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("finger", list(FINGERS)[1:])
def test_fingers_of_a_relaxed_hand_are_bent_down_by_so_much(side, finger):
    angles = bends(FULL, curled(FULL), side, finger)
    np.testing.assert_allclose(angles, np.cumsum(editing.RELAXED[finger.lower()])[:2], atol=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_thumb_closes_towards_palm_and_little_finger(side):
    pose = curled(FULL)
    places = FULL.motion(pose[None], np.zeros((1, 3)), 30.0).positions[0]
    open_, closed = (
        each[editing.fingers(FULL, side)["thumb"][-1]] for each in (FULL.reference_places, places)
    )
    assert closed[1] < open_[1]
    assert closed[2] < open_[2]


@given(seed=st.integers(0, 999))
@examples(15)
def test_a_relaxed_hand_does_not_depend_on_how_a_rig_is_written(seed):
    frames = np.random.default_rng(seed).normal(size=(len(FULL.skeleton), 4))
    frames /= np.linalg.norm(frames, axis=1, keepdims=True)
    frames[0] = rotation.identity()
    written = reframed(FULL.skeleton, frames)
    other = Character.of("other", written, roles=FULL.roles)
    plain = FULL.motion(curled(FULL)[None], np.zeros((1, 3)), 30.0)
    pose = np.array(other.reference_pose)
    pose[:] = rotation.multiply(
        rotation.multiply(rotation.conjugate(frames[FULL.skeleton.parents]), FULL.reference_pose), frames
    )
    pose[0] = frames[0]
    other = Character(other.name, written, other.structure, other.roles, pose, other.measures)
    motion = other.motion(curled(other)[None], np.zeros((1, 3)), 30.0)
    np.testing.assert_allclose(motion.positions, plain.positions, atol=1e-9)


def test_tips_in_line_with_a_finger_change_nothing():
    plain = FULL.skeleton
    last = [joint for joint, name in enumerate(plain.names) if name.endswith("3")]
    tips = tuple(EndSite(joint, tuple(plain.offsets[joint].tolist())) for joint in last)
    tipped = Character.of("tipped", Skeleton(plain.names, plain.parents, plain.offsets, tips))
    np.testing.assert_allclose(curled(tipped), curled(FULL), atol=1e-9)


def test_a_hand_that_rests_half_closed_is_closed_no_further():
    half = body(fingers(joints=4))
    pose = curled(half)
    resting = Character("half", half.skeleton, half.structure, half.roles, pose, half.measures)
    long = [
        joint
        for side in ("left", "right")
        for name in editing.LONG
        for joint in editing.fingers(half, side)[name]
    ]
    np.testing.assert_allclose(rotation.angle(curled(resting)[long], pose[long]), 0.0, atol=1e-6)


def test_a_source_without_fingers_gives_relaxed_hands_that_move_with_the_arm():
    source = gait(BARE)
    answer = rb.retarget(source, FULL, "copy_rotations")
    assert answer.notes == ("body shows no fingers: the hands of body are relaxed",)
    opened = rb.retarget(source, FULL, "copy_rotations", hands="open")
    assert opened.notes == ()
    joints = [
        j for j, role in enumerate(FULL.roles) if role and any(f"_{f.lower()}_" in role for f in FINGERS)
    ]
    rest = [j for j in range(len(FULL.skeleton)) if j not in joints]
    np.testing.assert_array_equal(answer.rotations[:, rest], opened.rotations[:, rest])
    expected = np.repeat(curled(FULL)[None], source.frames, axis=0)[:, joints]
    np.testing.assert_allclose(rotation.angle(answer.rotations[:, joints], expected), 0.0, atol=1e-6)
    still = np.repeat(FULL.reference_pose[None], source.frames, axis=0)[:, joints]
    np.testing.assert_allclose(rotation.angle(opened.rotations[:, joints], still), 0.0, atol=1e-6)


def test_a_finger_that_the_source_lacks_does_as_its_neighbour():
    source = gait(body(fingers("Thumb", "Index", "Middle")), seed=5)
    answer = rb.retarget(source, FULL, "copy_rotations")
    assert answer.notes == ()
    turned = transfer.relative(answer)
    for side in ("left", "right"):
        for rank in (1, 2, 3):
            near = turned[:, FULL.joint_of[f"{side}_middle_{rank}"]]
            for finger in ("ring", "pinky"):
                other = turned[:, FULL.joint_of[f"{side}_{finger}_{rank}"]]
                np.testing.assert_allclose(rotation.angle(near, other), 0.0, atol=1e-6)


def test_a_lone_finger_is_a_stub_where_it_is_still_and_a_finger_where_it_moves():
    moving = gait(body(fingers("Index", "Thumb")), seed=6)
    assert editing.shown(moving, "left") == {"index", "thumb"}
    rotations = np.array(moving.rotations)
    for joint in editing.fingers(moving.character, "left")["index"]:
        rotations[:, joint] = rotations[:1, joint]
    still = moving.character.motion(rotations, moving.root, 30.0)
    assert editing.shown(still, "left") == frozenset()
    assert editing.shown(still, "right") == {"index", "thumb"}
    assert editing.shown(moving.character.positions(moving.positions, 30.0), "left") == frozenset()


def test_hands_of_a_thumb_alone_stay():
    stub = body(fingers("Thumb", joints=1))
    answer = rb.retarget(gait(BARE), stub, "copy_rotations")
    assert answer.notes == ()
