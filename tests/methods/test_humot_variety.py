"""Bodies of other proportions and limbs held otherwise: what HuMoT's training windows are varied by."""

from __future__ import annotations

import humot_material
import method_bodies
import numpy as np
import pan_material
import pytest
import training_material
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.methods.humot.augmentation import (
    FARTHEST,
    LIMITS,
    REACH,
    build,
    proportions,
    reproportion,
    rotate_limbs,
    slanted,
    slants,
)
from retarget_bench.methods.humot.features import USUAL, body, stature, upright
from retarget_bench.motion import aligned, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples

BODIES, THREE, WINDOW = humot_material.BODIES, humot_material.THREE, humot_material.WINDOW
SEEDS = st.integers(0, 2**31)


def dance(name, frames=6):
    return method_bodies.dance(pan_material.BODIES[name], frames)


def bones(places, humot_body):
    return (places - places[..., list(humot_body.parents), :])[..., 1:, :]


def lengths_of(bones):
    return np.linalg.norm(bones, axis=1)


def bones_to(places, humot_body):
    return places - places[..., list(humot_body.parents), :]


def leaning(character, added):
    """The character with what ``slants`` gives added to its bones, and the same rotations at rest."""
    skeleton, humot_body = character.skeleton, body(character)
    offsets = skeleton.offsets.copy()
    for joint, more in zip(humot_body.joints[1:], upright(added)[1:], strict=True):
        above = character.reference_globals[skeleton.parents[joint]]
        offsets[joint] += rotation.rotate(rotation.conjugate(above), more)
    other = Skeleton(skeleton.names, skeleton.parents, offsets)
    return Character(
        "leaning", other, character.structure, character.roles, character.reference_pose, character.measures
    )


def resized(character, factors):
    """The character with the bones to its joints seen longer by factors."""
    skeleton = character.skeleton
    offsets = skeleton.offsets.copy()
    joints = list(body(character).joints)
    assert len(joints) == len(offsets)
    offsets[joints] *= factors[:, None]
    return Character.of(
        "resized", Skeleton(skeleton.names, skeleton.parents, offsets), roles=character.roles
    )


@examples(10)
@given(SEEDS)
def test_reshaped_motion_is_what_the_same_rotations_do_on_other_bones(seed):
    motion = dance("one")
    humot_body = body(motion.character)
    factors = proportions(np.random.default_rng(seed), humot_body)
    other = resized(motion.character, factors)
    expected = other.motion(motion.rotations, motion.root, motion.fps)
    reshaped = reproportion(humot_body.see(motion), factors, humot_body)
    expected_places = body(other).see(expected)
    apart = expected_places - expected_places[:, :1]
    np.testing.assert_allclose(reshaped - reshaped[:, :1], apart, atol=1e-9)
    np.testing.assert_allclose(reshaped[:, 0], humot_body.see(motion)[:, 0])
    np.testing.assert_allclose(
        reproportion(humot_body.template, factors, humot_body),
        upright(aligned.template(other)[list(humot_body.joints)]),
        atol=1e-9,
    )


@examples(10)
@given(SEEDS, st.sampled_from(sorted(THREE)))
def test_slanted_motion_is_what_the_same_rotations_do_on_slanted_bones(seed, name):
    motion = dance(name)
    humot_body = body(motion.character)
    added = slants(np.random.default_rng(seed), humot_body)
    other = leaning(motion.character, added)
    expected = body(other).see(other.motion(motion.rotations, motion.root, motion.fps))
    result = slanted(humot_body.see(motion), humot_body.turns(motion), added, humot_body)
    np.testing.assert_allclose(result - result[:, :1], expected - expected[:, :1], atol=1e-9)
    np.testing.assert_array_equal(result[:, 0], humot_body.see(motion)[:, 0])
    template = humot_body.template + build(humot_body).chains @ added
    np.testing.assert_allclose(template, body(other).template, atol=1e-9)


@examples(20)
@given(SEEDS)
def test_slants_keep_lengths_and_are_mirror_images_and_leave_hanging_arms(seed):
    humot_body = body(BODIES["one"])
    added = slants(np.random.default_rng(seed), humot_body)
    before = humot_body.template - humot_body.template[list(humot_body.parents)]
    lengths = (np.linalg.norm(each, axis=1) for each in (before, before + added))
    np.testing.assert_allclose(*lengths, atol=1e-12)
    roles = [humot_body.character.roles[joint] or "" for joint in humot_body.joints]
    for place, role in enumerate(roles):
        if role.startswith("left_"):
            other = roles.index(role.replace("left_", "right_"))
            np.testing.assert_allclose(added[place] * [-1, 1, 1], added[other], atol=1e-9)
        if role.endswith(("forearm", "hand")):
            assert not added[place].any()
        if not role.startswith(("left_", "right_")):
            assert added[place, 0] == pytest.approx(0.0, abs=1e-12)
    cosines = ((before + added) * before).sum(1) / np.square(lengths_of(before)).clip(1e-12)
    assert np.arccos(cosines[lengths_of(before) > 0].clip(-1, 1)).max() < FARTHEST + 1e-6


def test_where_only_positions_are_known_no_bone_is_slanted():
    motion = dance("one")
    humot_body = body(motion.character)
    assert not humot_body.turns(motion.character.positions(motion.positions, motion.fps)).any()


@examples(20)
@given(SEEDS)
def test_both_sides_of_a_body_have_the_same_proportions(seed):
    humot_body = body(BODIES["one"])
    factors = proportions(np.random.default_rng(seed), humot_body)
    assert factors.shape == (len(humot_body.joints),)
    assert LIMITS[0] <= factors.min() <= factors.max() <= LIMITS[1]
    roles = [humot_body.character.roles[joint] or "" for joint in humot_body.joints]
    for place, role in enumerate(roles):
        if role.startswith("left_"):
            assert factors[place] == factors[roles.index(role.replace("left_", "right_"))]


@examples(20)
@given(SEEDS, st.sampled_from(sorted(THREE)))
def test_a_limb_turns_as_one_piece_about_its_first_joint(seed, name):
    humot_body = body(BODIES[name])
    motion = dance(name)
    places, turns = humot_body.see(motion), humot_body.turns(motion)
    rotated, turned = rotate_limbs(np.random.default_rng(seed), places, turns, humot_body)
    lengths = (np.linalg.norm(bones(each, humot_body), axis=-1) for each in (rotated, places))
    np.testing.assert_allclose(*lengths, atol=1e-9)
    limbs = build(humot_body).limbs
    still = ~np.any([below for _, below, _ in limbs], axis=0)
    np.testing.assert_array_equal(rotated[:, still], places[:, still])
    for joint, below, reach in limbs:
        one, other = ((each[:, below] - each[:, [joint]]).reshape(-1, 3) for each in (places, rotated))
        np.testing.assert_allclose(one @ one.T, other @ other.T, atol=1e-9)  # one turn, for all frames
        cosines = (one * other).sum(1) / np.linalg.norm(one, axis=1).clip(1e-9) ** 2
        assert (cosines > np.cos(reach) - 1e-6).all()
        bone, was, now = (
            each[..., below, :]
            for each in (humot_body.template - humot_body.template[list(humot_body.parents)], turns, turned)
        )
        swung = rotation.multiply(now, rotation.conjugate(was)).reshape(-1, 4)
        np.testing.assert_allclose(np.abs(swung @ swung[0]), 1.0, atol=1e-9)
        rigid = rotation.rotate(now, np.broadcast_to(bone, (*now.shape[:-1], 3)))
        if "up_leg" in (humot_body.character.roles[humot_body.joints[joint]] or ""):
            np.testing.assert_allclose(rigid, bones_to(rotated, humot_body)[:, below], atol=1e-9)


def test_joints_without_roles_have_the_proportions_of_the_other_side():
    """A joint between the hips and each leg, as CMU's bodies have, and one in the spine."""
    one = BODIES["one"].skeleton
    names, parents, offsets = list(one.names), one.parents.tolist(), list(one.offsets)
    for name in ("LeftUpLeg", "RightUpLeg", "Spine1"):
        joint = names.index(name)
        names.append(f"{name}_split")
        parents.append(parents[joint])
        offsets.append(offsets[joint] / 2)
        parents[joint], offsets[joint] = len(names) - 1, offsets[joint] / 2
    order = sorted(range(len(names)), key=lambda joint: depth(parents, joint))
    split = Skeleton(
        tuple(names[j] for j in order),
        np.array([order.index(parents[j]) if parents[j] >= 0 else -1 for j in order]),
        np.array([offsets[j] for j in order]),
    )
    humot_body = body(Character.of("split", split))
    at = [humot_body.joints.index(split.names.index(f"{name}UpLeg_split")) for name in ("Left", "Right")]
    assert [humot_body.character.roles[humot_body.joints[k]] for k in at] == [None, None]
    for seed in range(8):
        factors = proportions(np.random.default_rng(seed), humot_body)
        assert factors[at[0]] == factors[at[1]]
    assert len(set(build(humot_body).pairs[at])) == 1
    spine = humot_body.joints.index(split.names.index("Spine1_split"))
    assert (build(humot_body).pairs == build(humot_body).pairs[spine]).sum() == 1


def depth(parents, joint):
    return 0 if parents[joint] < 0 else 1 + depth(parents, parents[joint])


def test_limbs_are_arms_and_legs():
    humot_body = body(BODIES["one"])
    roles = [humot_body.character.roles[joint] or "" for joint in humot_body.joints]
    limbs = {
        roles[joint]: {roles[k] for k in np.flatnonzero(below)}
        for joint, below, _ in build(humot_body).limbs
    }
    assert set(limbs) == {f"{side}_{part}" for side in ("left", "right") for part in REACH}
    assert {"left_forearm", "left_hand"} <= limbs["left_arm"]
    assert {"right_leg", "right_foot"} <= limbs["right_up_leg"]
    assert not any("left" in role for role in limbs["right_arm"] | limbs["right_up_leg"])


def test_half_of_the_bodies_slant_by_some_degrees():
    humot_body, numbers = body(BODIES["one"]), np.random.default_rng(0)
    every = np.array([slants(numbers, humot_body) for _ in range(1000)])
    assert 0.45 < every.any(axis=(1, 2)).mean() < 0.55
    shin = [humot_body.character.roles[joint] for joint in humot_body.joints].index("left_foot")
    length = np.linalg.norm(humot_body.template[shin] - humot_body.template[humot_body.parents[shin]])
    moved = np.linalg.norm(every[every.any(axis=(1, 2))][:, shin], axis=1) / length
    assert 5 < np.degrees(2 * np.arcsin(moved / 2)).mean() < 15


def test_half_of_the_bodies_keep_their_own_and_the_others_differ_by_a_fifth_or_so():
    humot_body, numbers = body(BODIES["one"]), np.random.default_rng(0)
    every = np.array([proportions(numbers, humot_body) for _ in range(2000)])
    own = (every == 1.0).all(axis=1)
    assert 0.46 < own.mean() < 0.54
    assert 0.2 < np.log(every[~own]).std() < 0.3
    assert abs(np.log(every[~own]).mean()) < 0.02


# ---------------------------------------------------------------------------------------- in training
def drawn(**options):
    """A batch of whole windows, in double precision."""
    module = humot_material.training_module(
        subsampling=False, lengths=(WINDOW,), **(humot_material.PLAIN | options)
    )
    batch = training_material.batch(module, 60)
    return [
        {key: each.double().numpy() for key, each in batch[side].items()} for side in ("source", "target")
    ]


@pytest.mark.parametrize("options", [{"sized": True, "varied": True}, {"slanted": True}], ids=str)
def test_what_is_given_and_asked_for_differ_in_bodies_and_not_in_what_is_done(options):
    """Bones of other lengths point where they did; slanted ones stay as long as they are at rest."""
    source, target = drawn(**options)
    keys, differ = ("places", "template"), 0
    for row in range(60):
        count = int(source["joints"][row].sum())
        parents = source["parents"][row, 1:count].astype(int)
        ways = [
            [side[key][row, ..., 1:count, :] - side[key][row][..., parents, :] for key in keys]
            for side in (source, target)
        ]
        lengths = [[np.linalg.norm(bones, axis=-1) for bones in side] for side in ways]
        if "slanted" in options:
            for side in lengths:
                np.testing.assert_allclose(*np.broadcast_arrays(*side), atol=1e-5)
        else:
            np.testing.assert_allclose(source["places"][row, :, 0], target["places"][row, :, 0], atol=1e-5)
            for one, other, own, others in zip(*ways, *lengths, strict=True):
                np.testing.assert_allclose((one * other).sum(-1), own * others, atol=1e-5)
        differ += not np.allclose(source["template"][row], target["template"][row], atol=1e-3)
    assert 35 < differ < 55  # but for a quarter


def test_every_body_has_the_usual_size():
    for side in drawn(sized=True, varied=True):
        for row in range(60):
            count = int(side["joints"][row].sum())
            humot_body = next(
                body(BODIES[name]) for name in THREE if len(body(BODIES[name]).joints) == count
            )
            size = stature(side["template"][row, :count], humot_body.heights)
            assert size == pytest.approx(USUAL, rel=1e-5)
