"""bone_directions: what the bones point at, from rotations and from positions alone."""

from __future__ import annotations

import numpy as np
import pytest
from method_bodies import body, dance, squat

from retarget_bench.api import Context
from retarget_bench.methods.bone_directions import counterparts
from retarget_bench.methods.bone_directions import plugin as BoneDirections
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion, Positions

LIMBS = (("arm", "forearm"), ("forearm", "hand"), ("up_leg", "leg"), ("leg", "foot"))


def bone(motion: Motion, side: str, bone: tuple[str, str]) -> np.ndarray:
    start, end = (motion.character.joint_of[f"{side}_{part}"] for part in bone)
    along = motion.positions[:, end] - motion.positions[:, start]
    return along / np.linalg.norm(along, axis=-1, keepdims=True)


def pointed(source: Motion | Positions, target: Character) -> Motion:
    return BoneDirections().retarget(source, target, context=Context())


def test_positions_alone_give_the_same_body_its_positions_back():
    source = dance(body())
    result = pointed(source.character.positions(source.positions, source.fps), source.character)
    np.testing.assert_allclose(result.positions, source.positions, atol=1e-4)


@pytest.mark.parametrize("with_rotations", [True, False])
def test_limbs_point_where_the_source_points(with_rotations):
    motion, target = dance(body()), body("other", thigh=0.3, arm=0.4, shoulder=0.3, droop=40.0, spines=5)
    source = motion if with_rotations else motion.character.positions(motion.positions, motion.fps)
    result = pointed(source, target)
    for side in ("left", "right"):
        for each in LIMBS:
            np.testing.assert_allclose(bone(result, side, each), bone(motion, side, each), atol=1e-9)


def test_twist_comes_from_the_source_where_it_has_rotations():
    source = dance(body())
    result = pointed(source, body("tall", thigh=0.7, shin=0.7))
    agree = np.abs(np.einsum("fjc,fjc->fj", result.rotations, source.rotations))
    np.testing.assert_allclose(agree, 1.0, atol=1e-9)


def test_knees_bend_about_their_hinge_when_only_positions_are_known():
    """The plane of a bent leg fixes the twist of its thigh: the knee turns about left-right."""
    source = squat(body(), deepest=60.0)
    result = pointed(source.character.positions(source.positions, source.fps), source.character)
    knee = result.rotations[len(result.rotations) // 2, source.skeleton.index("LeftLeg")]
    assert abs(knee[1]) > 0.5
    np.testing.assert_allclose(knee[2:], 0.0, atol=1e-6)


def test_a_spine_of_another_count_is_cut_along_its_length():
    source, target = dance(body(spines=2)), body(spines=4)
    counterpart_positions, known = counterparts(source.positions, source.character, target)
    assert known.all()
    joints = [source.skeleton.index(name) for name in ("Hips", "Spine", "Spine1", "Neck")]
    line = source.positions[:, joints]
    # the trunk of 0.62 m has joints at 0.25 and 0.5 m; the new ones lie every 0.125 m
    expected = line[:, 0] + 0.5 * (line[:, 1] - line[:, 0])
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine")], expected, atol=1e-12
    )
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine1")], line[:, 1], atol=1e-12
    )
    np.testing.assert_allclose(
        counterpart_positions[:, target.skeleton.index("Spine3")], line[:, 2], atol=1e-12
    )
