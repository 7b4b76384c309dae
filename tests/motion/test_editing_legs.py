"""Two legs, four legs and birds: level bodies, arms that hang as fore legs stand, nothing in the floor."""

from __future__ import annotations

import numpy as np
import pytest
from editing_bodies import body, fingers, gait, hen, jump
from hypothesis import given
from hypothesis import strategies as st

import retarget_bench as rb
from retarget_bench.api import Context
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.editing import edits, floor, legs
from retarget_bench.plugins import registry
from retarget_bench.python import motions
from tests.examples import examples

PERSON = body()
DOG = next(
    each
    for each in registry.create("datasets", "puppets[size=tiny]").characters().values()
    if each.four_legged
)


def pitch(motion: Motion, high: str, low: str) -> np.ndarray:
    """Degrees by which the line from one joint to another rises."""
    line = (
        motion.positions[:, motion.skeleton.index(high)] - motion.positions[:, motion.skeleton.index(low)]
    )
    return np.degrees(np.arcsin(line[:, 1] / np.linalg.norm(line, axis=1)))


def lowest(motion: Motion, role: str) -> float:
    """Metres: of a joint, of all below it and of their tips, written as a loop."""
    body, heights = motion.character, []
    for joint in range(len(body.skeleton)):
        line = joint
        while line >= 0 and line != body.joint_of[role]:
            line = int(body.skeleton.parents[line])
        if line < 0:
            continue
        heights.append(motion.positions[:, joint, 1].min())
        for site in body.skeleton.end_sites:
            if site.parent == joint:
                tip = rotation.rotate(motion.global_rotations[:, joint], np.array([site.offset]))
                heights.append((motion.positions[:, joint] + tip)[:, 1].min())
    return float(min(heights))


def stooped(angle: float, person: Character = PERSON) -> Motion:
    """A walk with the trunk bent forward."""
    motion = gait(person)
    rotations = np.array(motion.rotations)
    spine = person.joint_of["spine_1"]
    rotations[:, spine] = rotation.multiply(
        rotation.about(np.array([1.0, 0.0, 0.0]), angle)[None], rotations[:, spine]
    )
    return person.motion(rotations, motion.root, motion.fps)


def test_how_bodies_stand():
    assert legs.stance(PERSON) == legs.stance(body(fingers())) == "two legs"
    assert legs.stance(DOG) == "four legs"
    assert legs.stance(hen(wings=True)) == legs.stance(hen(wings=False)) == "bird"


@pytest.mark.parametrize("wings", [True, False])
@pytest.mark.parametrize("method", ["copy_rotations", "ik"])
def test_a_bird_walks_as_level_as_it_rests(wings, method):
    bird = hen(wings)
    with pytest.warns(UserWarning, match="hen stands level on two legs, as birds do") as caught:
        answer = rb.retarget(gait(PERSON), bird, method)
    assert len([each for each in caught if "guess" in str(each.message)]) == 1
    rest = np.degrees(np.arctan2(0.06, 0.16))
    assert np.abs(pitch(answer, "Chest", "Hips") - rest).max() < 8.0
    assert lowest(answer, "head") > 0.3
    for side in ("left", "right"):
        assert lowest(answer, f"{side}_foot") > -0.03


@pytest.mark.parametrize("wings", [True, False])
def test_a_person_who_does_as_a_bird_does_stands_upright(wings):
    bird = hen(wings)
    rest = bird.motion(rotation.identity(5, len(bird.skeleton)), np.tile([0.0, 0.35, 0.0], (5, 1)), 30.0)
    with pytest.warns(UserWarning, match="guess"):
        answer = rb.retarget(rest, PERSON, "copy_rotations")
    assert pitch(answer, "Head", "Hips").min() > 85.0


def test_arms_that_hang_are_fore_legs_that_stand():
    """Plain copying crosses them: fore legs are down in the common reference pose, and arms out."""
    hanging = gait(PERSON, speed=0.0)
    pose = np.repeat(PERSON.reference_pose[None], hanging.frames, axis=0)
    for side, sign in (("left", -1.0), ("right", 1.0)):
        arm = PERSON.joint_of[f"{side}_arm"]
        down = rotation.about(np.array([0.0, 0.0, sign]), np.pi / 2)
        pose[:, arm] = rotation.multiply(down[None], pose[:, arm])
    root = np.tile([0.0, PERSON.measures.hip_height, 0.0], (hanging.frames, 1))
    with pytest.warns(UserWarning, match="what each limb should do is a guess"):
        answer = rb.retarget(PERSON.motion(pose, root, 30.0), DOG, "copy_rotations")
    stand = DOG.reference_places
    for side in ("left", "right"):
        arm, hand = DOG.joints([f"{side}_arm", f"{side}_hand"])
        line = answer.positions[0, hand] - answer.positions[0, arm]
        np.testing.assert_allclose(line, stand[hand] - stand[arm], atol=0.02 * DOG.height)


def test_bodies_of_one_stance_are_taken_as_they_are():
    for pair in ((PERSON, body(size=2.0)), (DOG, DOG)):
        assert legs.alike(*pair) == pair
        assert legs.guess(*pair) == ""


def test_learned_methods_see_the_common_reference_pose():
    characters: list[Character] = []

    def answer(source, target):
        characters.extend((source.character, target))
        return target.motion(np.repeat(target.reference_pose[None], source.frames, 0), source.root, 30.0)

    for posed in (True, False):
        edits.edited(gait(PERSON), DOG, edits.USUAL, answer, posed)
    assert characters[1] is not DOG
    assert characters[-1] is DOG
    assert characters[-2] is PERSON


@given(angle=st.floats(0.3, 1.6), method=st.sampled_from(["copy_rotations", "ik"]))
@examples(8)
def test_a_stoop_leaves_no_head_and_no_paw_in_the_floor(angle, method):
    answer = motions.answer(stooped(angle), DOG, motions.RetargetOptions(method))
    for role in ("head", "left_hand", "right_hand"):
        assert lowest(answer, role) > -2e-3, role


def test_the_floor_is_what_keeps_the_head_up():
    source = stooped(1.5)
    plain = registry.create("methods", "copy_rotations")
    source_body, target_body = legs.alike(source.character, DOG)
    source = source_body.motion(source.rotations, source.root, 30.0)
    copied = plain.retarget(source, target_body, context=Context())
    assert lowest(DOG.motion(copied.rotations, copied.root, 30.0), "head") < -0.05
    raised = floor.above(DOG.motion(copied.rotations, copied.root, 30.0), source)
    assert lowest(raised, "head") > -2e-3
    own, others = raised.positions, DOG.motion(copied.rotations, copied.root, 30.0).positions
    hind = DOG.joints(["hips", "left_up_leg", "left_leg", "left_foot", "right_foot"])
    np.testing.assert_allclose(own[:, hind], others[:, hind], atol=1e-9)
    speed, usual = (np.linalg.norm(np.diff(each, axis=0), axis=-1).max() for each in (own, others))
    assert speed < 2.5 * usual, "it is raised smoothly"


def test_what_is_above_the_floor_stays_as_it_is():
    motion = gait(PERSON)
    assert floor.above(motion, motion) is motion


LONG = body({"Neck": ("Spine1", (0.0, 0.45, 0.0)), "Head": ("Neck", (0.0, 0.35, 0.0))})
"""A person with a trunk and neck that are longer by 0.45 m, on the same legs."""


def bowed(person: Character, most: float = 2.5) -> Motion:
    """Bends the trunk down to the knees and comes up again, on bent legs that stand still."""
    bend, across = 0.8, np.array([1.0, 0.0, 0.0])
    angle = most * np.sin(np.linspace(0.0, np.pi, 180)) ** 2
    rotations = np.repeat(person.reference_pose[None], len(angle), 0)
    for role, turn in (
        ("spine_1", angle),
        *((f"{side}_up_leg", -bend) for side in ("left", "right")),
        *((f"{side}_leg", 2 * bend) for side in ("left", "right")),
        *((f"{side}_foot", -bend) for side in ("left", "right")),
    ):
        joint = person.joint_of[role]
        world = rotation.about(across, np.broadcast_to(turn, angle.shape))
        rotations[:, joint] = rotation.multiply(world, rotations[:, joint])
    still = person.motion(rotations, np.zeros((len(angle), 3)), 30.0)
    root = np.tile([0.0, -lowest(still, "left_foot"), 0.0], (len(angle), 1))
    return person.motion(rotations, root, 30.0)


@pytest.mark.parametrize("method", ["copy_rotations", "ik"])
def test_a_longer_trunk_goes_no_deeper_than_that_of_its_source(method):
    source = bowed(PERSON)
    copied = LONG.motion(bowed(LONG).rotations, source.root, 30.0)
    assert source.positions[..., 1].min() > -1e-6
    assert lowest(copied, "head") < -0.05, "without the edit it is in the floor"
    answer = motions.answer(source, LONG, motions.RetargetOptions(method))
    if method == "copy_rotations":  # ik raises the head itself
        assert any("in the floor" in note for note in answer.notes)
    assert not motions.answer(source, PERSON, motions.RetargetOptions(method)).notes
    soles = -LONG.standing_places[LONG.joint_of["left_toe"], 1]  # the toes' joints are at y = 0
    assert lowest(answer, "head") > soles - 0.0101 * LONG.height
    feet = LONG.joints(["left_foot", "right_foot", "left_toe", "right_toe"])
    assert np.ptp(answer.positions[:, feet], axis=0).max() < 0.01, "feet stand"
    speed = np.linalg.norm(np.diff(answer.positions, axis=0), axis=-1).max()
    assert speed < 1.5 * np.linalg.norm(np.diff(copied.positions, axis=0), axis=-1).max()


def moved(motion: Motion, up: float) -> Motion:
    return motion.character.motion(motion.rotations, motion.root + np.array([0.0, up, 0.0]), motion.fps)


def test_what_is_as_deep_as_in_its_source_stays_as_it_is():
    source = bowed(PERSON)
    assert floor.no_deeper(source, source) is source
    deep = bowed(PERSON, 3.0)
    assert floor.no_deeper(deep, deep) is deep


def test_who_jumps_onto_a_lower_floor_is_not_raised_to_that_at_the_origin():
    """Nor are heads and hands of another stance, however far below y = 0 their feet are."""
    high, deep = (jump(PERSON, level, level - 1.1, before=60, after=3) for level in (0.0, -3.0))
    for source in (high, deep):
        assert floor.no_deeper(source, source) is source
        assert not motions.answer(source, LONG, motions.RetargetOptions("ik")).notes
        assert floor.above(source, source) is source


@given(source_lift=st.floats(-2.0, 2.0), target_lift=st.floats(-2.0, 2.0))
@examples(5)
def test_depth_is_below_the_floor_that_feet_stand_on(source_lift, target_lift):
    """Where the floor of a file lies changes nothing."""
    source, copied = bowed(PERSON), bowed(LONG)
    expected = floor.no_deeper(copied, source)
    assert expected is not copied
    raised = floor.no_deeper(moved(copied, target_lift), moved(source, source_lift))
    np.testing.assert_allclose(moved(raised, -target_lift).positions, expected.positions, atol=1e-6)
