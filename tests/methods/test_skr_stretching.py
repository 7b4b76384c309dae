"""Bodies stretched at random: what stays, what follows the bones, and how far proportions reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import skr_material

from retarget_bench.methods.skr.stretching import PARTS, StretchedBody
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.layers.skinned_body import SkinnedBody, moves_about_hips

LEFT, RIGHT = [*range(6, 10), *range(14, 18)], [*range(10, 14), *range(18, 22)]


def body(name: str = "ada") -> tuple[StretchedBody, dict[str, np.ndarray]]:
    motion = skr_material.motions()[name]
    return StretchedBody(SkinnedBody.of(motion.character)), moves_about_hips(motion)


def lengths(joints: np.ndarray) -> np.ndarray:
    return np.linalg.norm(joints[1:] - joints[list(PARENTS[1:])], axis=-1)


def at_rest(stretched: StretchedBody, stretch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    joints = stretched.body.joints
    return stretched.posed(stretch, rotation.identity(joints), np.zeros((joints, 3)))


@pytest.mark.parametrize("name", skr_material.NAMES)
def test_a_body_that_is_not_stretched_is_as_it_was(name):
    stretched, arrays = body(name)
    for frame in (0, 30, 61):
        turns, shifts = arrays["turns"][frame], arrays["shifts"][frame]
        vertices, joints = stretched.posed(stretched.unchanged, turns, shifts)
        np.testing.assert_allclose(vertices, stretched.body.posed(turns, shifts), atol=1e-6)
        np.testing.assert_allclose(joints, arrays["joints"][frame], atol=1e-12)
    np.testing.assert_allclose(
        at_rest(stretched, stretched.unchanged)[1], stretched.body.resting, atol=1e-12
    )


def test_growing_in_all_directions_is_a_larger_body_in_the_same_pose():
    stretched, arrays = body()
    turns, shifts = arrays["turns"][40], arrays["shifts"][40]
    before, small = stretched.posed(stretched.unchanged, turns, shifts)
    after, large = stretched.posed(1.3 * stretched.unchanged, turns, shifts)
    np.testing.assert_allclose(large - large[0], 1.3 * (small - small[0]), atol=1e-9)
    np.testing.assert_allclose(after - large[0], 1.3 * (before - small[0]), atol=1e-6)


def test_bones_keep_their_stretched_lengths_in_every_pose():
    stretched, arrays = body()
    stretch = stretched.drawn(np.random.default_rng(3))
    rest = lengths(at_rest(stretched, stretch)[1])
    for frame in (0, 25, 50):
        posed = stretched.posed(stretch, arrays["turns"][frame], arrays["shifts"][frame])[1]
        np.testing.assert_allclose(lengths(posed), rest, rtol=1e-9)


def test_a_longer_shank_moves_its_foot_along_and_nothing_else():
    stretched, _ = body()
    stretch = stretched.unchanged.copy()
    knee = stretched.character_joints[7]
    bone = stretched.body.resting[8] - stretched.body.resting[7]
    along = bone / np.linalg.norm(bone)
    stretch[knee] += 0.5 * np.outer(along, along)
    before, after = at_rest(stretched, stretched.unchanged)[1], at_rest(stretched, stretch)[1]
    moved = np.zeros((22, 3))
    moved[[8, 9]] = 0.5 * bone
    np.testing.assert_allclose(after - before, moved, atol=1e-9)


def test_left_and_right_are_stretched_alike_and_parts_for_themselves():
    stretched, _ = body()
    numbers = np.random.default_rng(0)
    drawn = np.array([lengths(at_rest(stretched, stretched.drawn(numbers))[1]) for _ in range(400)])
    own = lengths(stretched.body.resting)
    factors = np.log(drawn / own)
    np.testing.assert_allclose(factors[:, np.array(LEFT) - 1], factors[:, np.array(RIGHT) - 1], atol=1e-6)
    spread = factors.std(axis=0)
    # thigh, shank, upper arm and forearm: the bones that end at knee, ankle, elbow and wrist
    for rank, part in ((7, 4), (8, 5), (16, 8), (17, 9)):
        assert spread[rank - 1] == pytest.approx(PARTS[part].length, rel=0.15)
    related = np.corrcoef(factors[:, [6, 7, 15, 16]].T)
    assert related[0, 1] > 0.6
    assert related[2, 3] > 0.6
    assert abs(related[0, 2]) < 0.2


def test_every_structure_of_the_training_can_be_stretched():
    data: Any = registry.create("datasets", Spec.parse("puppets"))
    people = {each.structure: each for each in data.characters().values() if not each.four_legged}
    assert len(people) >= 3
    for structure, character in people.items():
        stretched = StretchedBody(SkinnedBody.of(character))
        vertices, joints = at_rest(stretched, stretched.drawn(np.random.default_rng(1)))
        assert np.isfinite(vertices).all(), structure
        # the end joint of h36m17's head lies on its top
        box = vertices.min(axis=0) - 0.02, vertices.max(axis=0) + 0.02
        assert ((joints > box[0]) & (joints < box[1])).all(), structure
