"""Augmented windows: what each change does, what it leaves alone, and how windows are drawn with it."""

import dataclasses

import numpy as np
import pytest

from retarget_bench.errors import BenchError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import BODY_PARTS
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.augmentation.augmenter import Augmenter, ClipWindow, placed, smooth_noise
from retarget_bench.training.augmentation.body import AugmentedBody
from retarget_bench.training.augmentation.reshaping import carried, reshaped
from retarget_bench.training.augmentation.windows import as_quaternions, side_by_side
from retarget_bench.training.config import Augmentation
from retarget_bench.training.data import ClipArrays, TrainingData

FRAMES, FPS = 40, 30.0
NOTHING = Augmentation(exchanged=0.0, turned=0.0, mirrored=0.0, warped=0.0, veered=0.0, slant=0.0)


@pytest.fixture(scope="module")
def motions():
    """Of bodies of four structures: a person of 22 joints and another, one of 28, one of 17, a dog."""
    cast = {
        name: clips
        for bodies in bound.dataset(Spec("puppets")).built.training().values()
        for name, clips in bodies.items()
    }
    chosen = {}
    for name, clips in cast.items():
        chosen.setdefault(clips[0].character.structure, []).append(name)
    names = [name for bodies in chosen.values() for name in bodies[:2]]
    return [cast[name][0].resample(FPS) for name in names]


@pytest.fixture(scope="module")
def windows(motions):
    """The first frames of each."""
    return stacked(motions, np.arange(FRAMES, dtype=float))


def stacked(motions, at):
    bodies = [AugmentedBody(motion.character) for motion in motions]
    return side_by_side(
        bodies, [(body.see(motion), motion.root, at) for body, motion in zip(bodies, motions, strict=True)]
    )


def positions(windows, row):
    return windows.motion(row, FRAMES, FPS).positions


def aligned(windows, row):
    """``(frames, joints, 4)`` local rotations of a row."""
    return as_quaternions(windows.rotations[:, windows.first[row] : windows.first[row + 1]])


def same_turns(rotations, expected, within=1e-3):
    assert rotation.angle(rotations.astype(float), expected.astype(float)).max() < within


def changed_at_random(windows, numbers):
    """All changes at once."""
    rows, count = len(windows.bodies), windows.chains.max() + 1
    parts = numbers.random((rows, len(BODY_PARTS))) < 0.5
    vectors = numbers.normal(0.0, 0.5, (FRAMES, count, 3))
    changed = windows.exchanged(np.arange(rows) ^ 1, parts).turned(np.arange(count), vectors)
    return changed.as_low_as(windows).mirrored(np.arange(rows))


# --------------------------------------------------------------------------------------- what it keeps
def test_windows_that_nothing_changes_are_the_clips(motions, windows):
    for row, motion in enumerate(motions):
        np.testing.assert_allclose(positions(windows, row), motion.positions[:FRAMES], atol=3e-6)
        lowest = motion.positions[:FRAMES, :, 1].min(1)
        np.testing.assert_allclose(windows.lowest[row], lowest, atol=3e-6)


def test_the_lowest_joint_and_the_path_over_the_floor_stay(motions, windows):
    changed = changed_at_random(windows, np.random.default_rng(1))
    for row, motion in enumerate(motions):
        places = positions(changed, row)
        np.testing.assert_allclose(places[..., 1].min(1), motion.positions[:FRAMES, :, 1].min(1), atol=1e-5)
        np.testing.assert_allclose(
            changed.root[row][:, [0, 2]] * (-1, 1), motion.root[:FRAMES, [0, 2]], atol=1e-6
        )


@pytest.mark.parametrize("part", ["left_arm", "right_leg", "trunk"])
def test_a_part_of_another_turns_as_the_others_and_the_rest_as_before(windows, part):
    """Both of one structure: their joints are the same."""
    parts = np.zeros((len(windows.bodies), len(BODY_PARTS)), dtype=bool)
    parts[0, BODY_PARTS.index(part)] = True
    changed = windows.exchanged(np.arange(len(parts)) ^ 1, parts)
    _, joints = windows.bodies[0].limbs[part]
    others = np.setdiff1d(np.arange(len(windows.bodies[0].parents)), joints)
    assert "hips" not in windows.bodies[0].limbs[part][0]
    np.testing.assert_array_equal(aligned(changed, 0)[:, joints], aligned(windows, 1)[:, joints])
    np.testing.assert_array_equal(aligned(changed, 0)[:, others], aligned(windows, 0)[:, others])
    assert (aligned(windows, 0)[:, joints] != aligned(windows, 1)[:, joints]).any()
    np.testing.assert_array_equal(aligned(changed, 1), aligned(windows, 1))


def test_parts_with_joints_of_other_roles_are_not_exchanged(windows):
    dog = next(row for row, body in enumerate(windows.bodies) if body.character.four_legged)
    assert windows.bodies[dog].limbs["trunk"][0] != windows.bodies[0].limbs["trunk"][0]
    parts = np.zeros((len(windows.bodies), len(BODY_PARTS)), dtype=bool)
    parts[dog, BODY_PARTS.index("trunk")] = True
    changed = windows.exchanged(np.zeros(len(parts), dtype=int), parts)
    np.testing.assert_array_equal(changed.rotations, windows.rotations)


# ------------------------------------------------------------------------------------------------ turns
def test_turns_are_shared_by_the_joints_of_a_chain(windows):
    """Against the same written out joint by joint."""
    numbers = np.random.default_rng(2)
    body = windows.bodies[0]
    spine = body.chains[body.character.joint_of["spine_1"]]
    elbow = body.chains[body.character.joint_of["left_forearm"]]
    vectors = numbers.normal(0.0, 0.5, (FRAMES, 2, 3))
    order = np.argsort([spine, elbow])
    changed = windows.turned(np.array([spine, elbow])[order], vectors[:, order])
    for joint, role in enumerate(body.character.roles):
        expected = aligned(windows, 0)[:, joint].astype(float)
        if role is not None and role.startswith("spine"):
            turn = rotation.from_rotation_vector(vectors[:, 0] / 3.0)
            expected = rotation.multiply(turn, expected)
        if role == "left_forearm":
            expected = rotation.multiply(rotation.from_rotation_vector(vectors[:, 1]), expected)
        same_turns(aligned(changed, 0)[:, joint], expected)
    for row in range(1, len(windows.bodies)):
        np.testing.assert_array_equal(aligned(changed, row), aligned(windows, row))


def test_a_chain_is_a_spine_a_neck_a_tail_or_a_finger_and_no_tip_turns():
    names = (
        "Hips Spine Spine1 Neck Head HeadTop_End LeftShoulder LeftArm LeftForeArm LeftHand "
        "LeftHandIndex1 LeftHandIndex2 LeftHandThumb1 Tail1 Tail2 Sword"
    )
    roles = (
        "hips spine_1 spine_2 neck head head_top left_shoulder left_arm left_forearm left_hand "
        "left_index_1 left_index_2 left_thumb_1 tail_1 tail_2"
    )
    names, roles = tuple(names.split()), (*roles.split(), None)
    parents = np.array([-1, 0, 1, 2, 3, 4, 2, 6, 7, 8, 9, 10, 9, 0, 13, 9])
    skeleton = Skeleton(names, parents, np.full((len(names), 3), 0.1))
    body = AugmentedBody(Character.of("one", skeleton, roles=roles))
    of = dict(zip(roles, body.chains.tolist(), strict=True))
    assert of["spine_1"] == of["spine_2"]
    assert of["left_index_1"] == of["left_index_2"]
    assert of["tail_1"] == of["tail_2"]
    assert of["head_top"] == of[None] == -1
    assert sorted(set(of.values())) == list(range(-1, 11))
    assert body.links.tolist() == [np.count_nonzero(body.chains == chain) for chain in range(11)]


def test_noise_is_smooth_and_of_deviation_one():
    noise = smooth_noise(np.random.default_rng(3), (4000,), 60, FPS)
    np.testing.assert_allclose(noise.std(0), 1.0, atol=0.06)
    np.testing.assert_allclose(noise.mean(0), 0.0, atol=0.08)
    assert np.diff(noise).std() < 0.06
    assert np.abs(np.corrcoef(noise[:, 0], noise[:, 55])[0, 1]) < 0.08


# ------------------------------------------------------------------------------------------- the mirror
def test_mirror_images_are_exact(motions, windows):
    """Of bodies whose sides are alike: joint by joint the image of the other side's place."""
    changed = windows.mirrored(np.arange(1, len(motions)))
    np.testing.assert_array_equal(positions(changed, 0), positions(windows, 0))
    for row, motion in enumerate(motions[1:], start=1):
        names = motion.skeleton.names
        swap = {"Left": "Right", "Right": "Left"}
        other = [
            names.index(next((name.replace(side, swap[side]) for side in swap if side in name), name))
            for name in names
        ]
        image = motion.positions[:FRAMES, other] * (-1.0, 1.0, 1.0)
        np.testing.assert_allclose(positions(changed, row), image, atol=5e-6)
        np.testing.assert_array_equal(windows.bodies[row].mirror, other)


def test_a_path_that_veers_has_the_same_steps_and_poses(windows):
    turns = np.random.default_rng(2).normal(0.0, 0.3, (len(windows.bodies), FRAMES)).cumsum(1) / 10
    veered = windows.veered(turns)
    for row, angles in enumerate(turns):
        before, after = (positions(each, row) for each in (windows, veered))
        axis = np.array([0.0, 1.0, 0.0]) * angles[:, None, None]
        expected = rotation.rotate(rotation.from_rotation_vector(axis), before - before[:, :1])
        np.testing.assert_allclose(after - after[:, :1], expected, atol=1e-5)
        np.testing.assert_allclose(after[:, 0, 1], before[:, 0, 1], atol=1e-6)
        steps = [np.linalg.norm(np.diff(each[:, 0], axis=0), axis=-1) for each in (before, after)]
        np.testing.assert_allclose(*steps, atol=1e-5)
    whole = windows.veered(np.full_like(turns, 0.7))
    about = rotation.rotate(
        rotation.from_rotation_vector(np.array([0.0, 0.7, 0.0])), windows.root - windows.root[:, :1]
    )
    np.testing.assert_allclose(whole.root - whole.root[:, :1], about, atol=1e-6)


def test_a_reshaped_body_turns_alike_and_rests_otherwise(motions):
    for motion in motions:
        body, other = motion.character, reshaped(motion.character, 8.0)
        if body.four_legged:
            assert other is None
            continue
        again = reshaped(body, 8.0)
        np.testing.assert_array_equal(again.skeleton.offsets, other.skeleton.offsets)
        own, others = AugmentedBody(body), AugmentedBody(other)
        moved = carried(motion, other)
        same_turns(others.see(moved), own.see(motion), within=1e-6)
        heights = [
            each.positions[..., 1].min(1) / each.character.measures.hip_height for each in (motion, moved)
        ]
        np.testing.assert_allclose(*heights, atol=1e-9)
        first, second = (
            each.offsets / np.linalg.norm(each.offsets, axis=-1, keepdims=True).clip(min=1e-9)
            for each in (own, others)
        )
        joints = {role: joint for role, joint in body.joint_of.items() if first[joint].any()}
        cosines = {role: first[joint] @ second[joint] for role, joint in joints.items()}
        assert cosines["left_hand"] == cosines["left_forearm"] == pytest.approx(1.0)
        angles = np.degrees(np.arccos(np.clip([*cosines.values()], -1.0, 1.0)))
        assert 5.0 < angles.mean() < 20.0
        assert (own.mirror is None) == (others.mirror is None)
        assert (other.structure, other.roles) == (body.structure, body.roles)


def test_a_body_whose_sides_differ_has_no_mirror_image(motions):
    character = motions[0].character
    skeleton = character.skeleton
    offsets = skeleton.offsets.copy()
    offsets[character.joint_of["left_forearm"]] *= 1.3
    longer = dataclasses.replace(character, skeleton=dataclasses.replace(skeleton, offsets=offsets))
    assert AugmentedBody(longer).mirror is None
    assert AugmentedBody(character).mirror is not None
    roles = tuple(None if role == "left_hand" else role for role in character.roles)
    assert AugmentedBody(dataclasses.replace(character, roles=roles)).mirror is None


# --------------------------------------------------------------------------------------------- the time
def test_between_frames_it_is_slerp_nearly(motions):
    at = np.linspace(1.3, 30.9, FRAMES)
    warped = stacked(motions, at)
    for row, motion in enumerate(motions):
        low = at.astype(int)
        expected = motion.between(low, at - low, FPS)
        moved = warped.motion(row, FRAMES, FPS)
        same_turns(moved.rotations, expected.rotations, within=np.radians(0.1))
        np.testing.assert_allclose(moved.root, expected.root, atol=1e-6)


@pytest.mark.parametrize(("start", "length"), [(0, 200), (150, 200), (0, 40), (3, 45)])
def test_speeds_keep_to_the_clip_and_to_their_limits(start, length):
    numbers = np.random.default_rng(4)
    for _ in range(50):
        speeds = np.exp(numbers.uniform(-np.log(1.4), np.log(1.4), FRAMES - 1))
        passed = np.concatenate([[0.0], np.cumsum(speeds)])
        at = placed(passed, start, FRAMES, length)
        assert at[0] >= 0.0
        assert at[-1] <= length - 1 + 1e-9
        assert (np.diff(at) > 0.0).all()
        assert (np.diff(at) <= 1.4 + 1e-9).all()
        if passed[-1] <= length - 1:
            np.testing.assert_allclose(np.diff(at), speeds)
            assert at[0] == min(start, length - 1 - passed[-1])


# ------------------------------------------------------------------------------------------- as drawn
def seen(shares, seed, warping=True):
    """Windows of two clips of toys, and the rotations and roots of what is made of them."""
    dataset = bound.dataset(Spec("puppets")).built.training()
    names = [(structure, name) for structure, cast in dataset.items() for name in list(cast)[:2]]
    drawn = []
    for number, (structure, name) in enumerate(names[:4]):
        motion = dataset[structure][name][0].resample(FPS)
        body = AugmentedBody(motion.character)
        length = min(FRAMES, motion.frames - number)
        drawn.append(
            ClipWindow(body, body.see(motion).astype("f4"), motion.root.astype("f4"), number, length)
        )
    augmenter = Augmenter(shares, FPS, lambda motion: {"root": motion.root, "rotations": motion.rotations})
    return drawn, augmenter.changed(np.random.default_rng(seed), drawn, warping)


def test_frames_that_are_not_to_be_drawn_are_not_read():
    warped = dataclasses.replace(NOTHING, warped=1.0)
    assert seen(warped, 0, warping=False)[1] == {}
    assert seen(warped, 0, warping=True)[1] != {}


AUTO_ENCODERS = ("pan", "san", "humot", "nkn", "pmnet", "smrm", "r2et")


@pytest.mark.parametrize("name", AUTO_ENCODERS)
def test_every_auto_encoder_draws_augmented_windows(name, motions):
    """Unchanged rows as before, changed ones as the method sees the changed motion; finite; by the seed."""
    method = bound.method(Spec(name)).built
    fit = [motion for motion in motions if not method.unfit(motion.character)]
    clips = {}
    for motion in fit:
        source = {"rotations": AugmentedBody(motion.character).see(motion), "root": motion.root}
        arrays = {key: np.asarray(each, np.float32) for key, each in method.prepare(motion).items()}
        clips[motion.character.name] = [ClipArrays(motion.character.name, "one", arrays, source)]
    shares = Augmentation(exchanged=0.1, turned=0.1, mirrored=0.1, warped=0.1, veered=0.1)
    augmenter = Augmenter(shares, FPS, method.prepare)
    data = TrainingData({each.character.name: each.character for each in fit}, clips, (), augmenter)
    plain = dataclasses.replace(data, augmenter=None)
    cast = plain.cast(np.random.default_rng(0), 12)
    drawn = [each.draw(np.random.default_rng(7), cast, 32) for each in (plain, data, data)]
    differ = np.zeros(12, dtype=bool)
    for key, array in drawn[0].arrays.items():
        np.testing.assert_array_equal(drawn[1].arrays[key], drawn[2].arrays[key])
        assert np.isfinite(drawn[1].arrays[key]).all()
        assert array.dtype == drawn[1].arrays[key].dtype
        differ |= (array != drawn[1].arrays[key]).reshape(12, -1).any(1)
    assert 0 < differ.sum() < 12
    np.testing.assert_array_equal(drawn[0].lengths, drawn[1].lengths)
    single = [each.draw(np.random.default_rng(7), cast, 1).arrays for each in (plain, data)]
    for key, array in single[0].items():
        np.testing.assert_array_equal(array, single[1][key])


@pytest.mark.parametrize(
    ("method", "says"),
    [
        ("paired", "paired learns from pairs, and --augment makes no pair of a pair"),
        ("skr", "skr learns from single frames, and --augment changes windows"),
    ],
)
def test_methods_without_windows_of_single_motions_are_refused(toy_run, method, says):
    with pytest.raises(BenchError, match=says):
        toy_run(method=method, data="puppets", augment=True)


def test_a_row_alone_is_its_own_partner(motions):
    motion = motions[0]
    body = AugmentedBody(motion.character)
    drawn = [ClipWindow(body, body.see(motion), motion.root, 0, FRAMES)]
    only = dataclasses.replace(NOTHING, exchanged=1.0)
    augmenter = Augmenter(only, FPS, lambda motion: {"positions": motion.positions})
    changed = augmenter.changed(np.random.default_rng(0), drawn, warping=True)
    np.testing.assert_allclose(changed[0]["positions"], motion.positions[:FRAMES], atol=3e-6)
