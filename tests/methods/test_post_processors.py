"""Post-processors: held feet, moving averages, fitted rotations and root paths."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance, squat

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.bone_directions import plugin as BoneDirections
from retarget_bench.methods.copy_rotations import plugin as CopyRotations
from retarget_bench.methods.posts.root_path import plugin as RootPath
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.root_rules import SCALING_RULES
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

FEET = ("left_foot", "left_toe", "right_foot", "right_toe")
UPPER = ("spine", "neck", "head", "left_arm", "left_forearm", "right_hand")


def locked(answer: Motion, source: Motion) -> Motion:
    return registry.create("posts", "footlock").process(answer, source, context=Context())


def answered(method: str, source: Motion, target: Character) -> Motion:
    plugin = registry.create("methods", str(Spec.parse(method)))
    return plugin.retarget(source, target, context=Context())


def feet(motion: Motion) -> np.ndarray:
    return motion.positions[:, motion.character.joints(FEET)]


def swaying(motion: Motion, path: float, turns: float) -> Motion:
    """In two seconds: the root by so many heights, all joints by so many radians about axes of their own;
    with a drift of a hundredth of the height in a second."""
    time = np.arange(motion.frames) / motion.fps
    axes = np.random.default_rng(0).normal(size=(motion.rotations.shape[1], 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    wave = np.sin(np.pi * time)
    sway = rotation.from_rotation_vector(turns * wave[:, None, None] * axes)
    shift = path * np.outer(wave, [0.6, 0.5, 0.6]) + np.outer(time, [0.01, 0.0, 0.0])
    root = motion.root + motion.character.height * shift
    return motion.character.motion(rotation.multiply(sway, motion.rotations), root, motion.fps)


@pytest.mark.parametrize("target", [body(), body("long", thigh=0.62, shin=0.40, hip=0.16), body(scale=0.4)])
def test_feet_of_a_swaying_drifting_answer_stand_where_those_of_ik_stand(target):
    source = squat(body())
    answer = swaying(answered("copy_rotations", source, target), 0.01, 0.02)
    result = locked(answer, source)
    assert np.ptp(feet(answer), axis=0).max() > 0.02 * target.height
    assert np.ptp(feet(result), axis=0).max() < 2e-3 * target.height
    expected = feet(answered("ik[hands=false]", source, target))
    assert (
        np.abs(feet(result) - expected).max() < 0.02 * target.height
    )  # toes lie as the answer's feet point


def test_copied_rotations_become_ik_without_hands():
    for source, target in ((squat(body()), body("long", thigh=0.62, shin=0.40)), (dance(body()), body())):
        answer = locked(answered("copy_rotations", source, target), source)
        expected = answered("ik[hands=false]", source, target)
        np.testing.assert_allclose(answer.positions, expected.positions, atol=1e-9)


def test_above_the_hips_joints_turn_as_in_the_answer():
    source = squat(body())
    answer = swaying(source, 0.01, 0.05)
    result = locked(answer, source)
    upper = answer.character.joints(UPPER)
    apart = rotation.angle(result.global_rotations[:, upper], answer.global_rotations[:, upper])
    assert apart.max() < 1e-6
    np.testing.assert_allclose(np.linalg.norm(result.rotations, axis=-1), 1.0, atol=1e-9)
    assert (result.frames, result.fps, result.character) == (answer.frames, answer.fps, answer.character)


def test_sources_without_rotations_and_bodies_without_legs_are_refused():
    source = squat(body())
    with pytest.raises(NotSupported, match="needs a source with rotations"):
        registry.create("posts", "footlock").process(
            source, source.character.positions(source.positions, source.fps), context=Context()
        )
    cast = registry.create("datasets", "puppets[size=tiny]").characters()
    post = registry.create("posts", "footlock")
    assert {post.supports(one, two) for one in cast.values() for two in cast.values()} == {None}


# ------------------------------------------------------------------------------------------ moving averages
FPS = 30.0


def smoothed(answer: Motion, sigma: float, source: Motion | None = None) -> Motion:
    post = registry.load("posts", "smooth")(sigma=sigma)
    return post.process(answer, answer if source is None else source, context=Context())


def turning(speed: float, frames: int = 40) -> Motion:
    """All joints turn about axes of their own at so many radians per second; the root goes straight on."""
    character = body()
    axes = np.random.default_rng(0).normal(size=(len(character.skeleton), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    time = np.arange(frames) / FPS
    turns = rotation.from_rotation_vector(speed * time[:, None, None] * axes)
    return character.motion(turns, np.outer(time, [1.0, 0.2, -0.5]), FPS)


def averaged_by_hand(values: np.ndarray, width: float) -> np.ndarray:
    """Frame by frame from the formula: Gaussian weights up to four standard deviations, mirror images
    through the end points beyond the ends."""
    last, reach = len(values) - 1, int(4 * width + 0.5)

    def at(frame: int) -> np.ndarray:
        if frame < 0:
            return 2 * values[0] - values[-frame]
        return values[frame] if frame <= last else 2 * values[last] - values[2 * last - frame]

    around = range(-reach, reach + 1)
    weights = np.exp([-0.5 * (k / width) ** 2 for k in around])
    rows = [
        sum(w * at(n + k) for w, k in zip(weights, around, strict=True)) / weights.sum()
        for n in range(last + 1)
    ]
    return np.array(rows)


def test_the_path_is_averaged_as_the_formula_says():
    answer = dance(body())
    averaged = smoothed(answer, 0.05)
    np.testing.assert_allclose(averaged.root, averaged_by_hand(answer.root, 0.05 * answer.fps), atol=1e-12)


def test_steady_motion_stays_as_it_is():
    answer = turning(speed=1.0)
    averaged = smoothed(answer, 0.04)
    np.testing.assert_allclose(averaged.root, answer.root, atol=1e-12)
    inner = slice(6, -6)  # at the ends mirror images of quaternions are not quite unit
    assert rotation.angle(averaged.rotations[inner], answer.rotations[inner]).max() < 1e-6
    assert rotation.angle(averaged.rotations, answer.rotations).max() < 2e-3


def test_trembling_is_removed_and_signs_of_quaternions_do_not_matter():
    answer, rng = turning(speed=1.0), np.random.default_rng(1)
    noise = rotation.from_rotation_vector(0.05 * rng.normal(size=(*answer.rotations.shape[:2], 3)))
    signs = rng.choice([-1.0, 1.0], size=(*answer.rotations.shape[:2], 1))
    rough = answer.character.motion(
        rotation.multiply(noise, answer.rotations),
        answer.root + 0.01 * rng.normal(size=answer.root.shape),
        FPS,
    )
    flipped = Motion(rough.character, signs * rough.rotations, rough.root, FPS)
    averaged, other = smoothed(rough, 0.06), smoothed(flipped, 0.06)
    assert rotation.angle(averaged.rotations, other.rotations).max() < 1e-7
    for before, after in ((rough, averaged), (rough, other)):
        off = [rotation.angle(each.rotations, answer.rotations).mean() for each in (before, after)]
        assert off[1] < 0.5 * off[0]
        off = [np.abs(each.root - answer.root).mean() for each in (before, after)]
        assert off[1] < 0.5 * off[0]
    np.testing.assert_allclose(np.linalg.norm(averaged.rotations, axis=-1), 1.0, atol=1e-12)


def test_nothing_is_averaged_over_a_cut_of_the_source():
    still = turning(speed=0.0)
    jump = np.where(np.arange(still.frames) < 20, 0.0, 5.0)[:, None] * [1.0, 0.0, 0.0]
    source = still.character.motion(still.rotations, still.root + jump, FPS)
    np.testing.assert_allclose(smoothed(source, 0.1).root, source.root, atol=1e-12)


def test_no_width_changes_nothing_and_a_negative_one_is_refused():
    answer = dance(body())
    assert (smoothed(answer, 0.0).root == answer.root).all()
    with pytest.raises(BenchError, match="sigma is in seconds"):
        smoothed(answer, -1.0)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_clips_of_a_frame_or_two(frames):
    answer = dance(body()).at(slice(0, frames))
    averaged = smoothed(answer, 0.04)
    assert averaged.frames == frames
    assert np.isfinite(averaged.positions).all()


# ---------------------------------------------------------------------------------- rotations for positions
def fitted(prediction):
    return registry.create("posts", "fit").process(prediction, prediction, context=Context())


def test_positions_become_a_motion_with_the_body_s_bones():
    motion = dance(body())
    answer = fitted(motion.character.positions(motion.positions, motion.fps))
    assert isinstance(answer, Motion)
    assert np.abs(answer.positions - motion.positions).max() < 1e-4


def test_an_answer_with_rotations_is_left_as_it_is():
    motion = dance(body())
    answer = fitted(motion)
    assert (answer.rotations == motion.rotations).all()
    assert (answer.root == motion.root).all()


def test_twists_that_positions_leave_open_are_those_of_the_source():
    motion = dance(body())
    answer, head = motion.character.positions(motion.positions, motion.fps), motion.skeleton.index("Head")
    post = registry.create("posts", "fit")
    for source, near in ((motion, True), (answer, False)):
        processed = post.process(answer, source, context=Context())
        apart = rotation.angle(processed.global_rotations[:, head], motion.global_rotations[:, head])
        assert (np.degrees(apart).max() < 0.1) == near


# ----------------------------------------------------------------------------------------------- root paths
NOTHING = Context()


@pytest.mark.parametrize("rule", SCALING_RULES)
@pytest.mark.parametrize("method", [CopyRotations, BoneDirections])
def test_it_gives_what_a_method_with_that_rule_gives(method, rule):
    source, target = dance(body()), body("other", thigh=0.6, shin=0.5, hip=0.2)
    usual, expected = (
        method(root_rule=each).retarget(source, target, context=NOTHING) for each in ("hip_height", rule)
    )
    moved = RootPath(root_rule=rule).process(usual, source, context=NOTHING)
    np.testing.assert_allclose(moved.positions, expected.positions, atol=1e-12)
    flat = target.positions(usual.positions, usual.fps)
    there = RootPath(root_rule=rule).process(flat, source, context=NOTHING)
    np.testing.assert_allclose(there.positions, expected.positions, atol=1e-12)
