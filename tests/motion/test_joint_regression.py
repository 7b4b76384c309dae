"""Joints under a surface: against a closed form, the joints that skinned it, and other surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.joint_regression import joint_positions
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import registry

PUPPETS = ("ada", "boulder", "lena", "rex")
"""Of four structures, one of them stout and one on four legs."""


@pytest.fixture(scope="module")
def motions() -> dict:
    """A clip of each body, half a second."""
    data, by_target = registry.create("datasets", "puppets[size=tiny]"), {}
    for split in data.card.splits:
        for info in data.cases("retarget", split):
            if info.target in PUPPETS and info.target not in by_target:
                by_target[info.target] = data.load(info).reference.at(slice(10, 25))
    return by_target


@pytest.mark.parametrize("name", PUPPETS)
def test_joints_come_back_from_the_skin_that_they_moved(motions, name):
    motion = motions[name]
    mesh = motion.character.mesh
    off = np.linalg.norm(
        joint_positions(mesh, motion.skeleton, mesh.skinned(motion)) - motion.positions, axis=2
    )
    assert off.mean() < 2e-4
    assert off.max() < 1e-3


def two_boxes(shared: float) -> tuple[Character, Mesh]:
    """An arm of two boxes; of each one's vertices the other joint has a share. A third joint has none."""
    box = np.array([[x, y, z] for x in (0.0, 0.4) for y in (-0.1, 0.1) for z in (-0.1, 0.1)])
    vertices = np.concatenate([box, box + np.array([0.5, 0.0, 0.0])])
    weights = np.zeros((16, 3))
    weights[:8, 0] = weights[8:, 1] = 1.0 - shared
    weights[8:, 0] = weights[:8, 1] = shared
    skeleton = Skeleton(
        ("a", "b", "tip"), np.array([-1, 0, 1]), np.array([[0.0, 0, 0], [0.45, 0, 0], [0.5, 0, 0]])
    )
    return Character.of("arm", skeleton), Mesh(vertices, np.array([[0, 1, 2]]), weights)


@pytest.mark.parametrize("shared", [0.0, 0.1, 0.3])
def test_an_elbow_bent_by_a_right_angle(shared):
    body, mesh = two_boxes(shared)
    turns = rotation.identity(1, 3)
    turns[0, 1] = rotation.from_rotation_vector(np.array([0.0, 0.0, np.pi / 2]))
    skin = mesh.skinned(body.motion(turns, np.array([[1.0, 2.0, 3.0]]), 30.0))
    expected = np.array([[1.0, 2.0, 3.0], [1.45, 2.0, 3.0], [1.45, 2.5, 3.0]])
    np.testing.assert_allclose(
        joint_positions(mesh, body.skeleton, skin)[0], expected, atol=2e-3 * shared + 1e-7
    )


def test_no_frame_and_no_flesh_at_the_root():
    body, mesh = two_boxes(0.0)
    assert joint_positions(mesh, body.skeleton, np.zeros((0, 16, 3))).shape == (0, 3, 3)
    only_second = replace(mesh, weights=np.tile([0.0, 1.0, 0.0], (16, 1)))
    positions = joint_positions(only_second, body.skeleton, mesh.vertices[None] + (0.0, 1.0, 0.0))
    np.testing.assert_allclose(positions[0], mesh.bound(body.skeleton)[0] + (0.0, 1.0, 0.0), atol=1e-9)
