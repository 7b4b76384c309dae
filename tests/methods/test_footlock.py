"""Feet stand where the source's stand, under any answer; what is above the hips turns as before."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from tests.methods.method_bodies import body, dance, squat

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


def test_the_answer_is_not_changed_in_place():
    source = squat(body())
    answer = swaying(source, 0.01, 0.05)
    before = answer.rotations.copy(), answer.root.copy()
    locked(answer, source)
    assert (answer.rotations == before[0]).all()
    assert (answer.root == before[1]).all()


def test_sources_without_rotations_and_bodies_without_legs_are_refused():
    source = squat(body())
    with pytest.raises(NotSupported, match="needs a source with rotations"):
        registry.create("posts", "footlock").process(
            source, source.character.positions(source.positions, source.fps), context=Context()
        )
    cast = registry.create("datasets", "puppets[size=tiny]").characters()
    post = registry.create("posts", "footlock")
    assert {post.supports(one, two) for one in cast.values() for two in cast.values()} == {None}
