"""Meshes follow the joints: against closed forms and a plain loop over vertices."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton


def body() -> Character:
    offsets = np.array([[0.1, 1.0, 0.2], [0.0, 0.5, 0.0], [0.0, 0.4, 0.1]])
    return Character.of("stick", Skeleton(("a", "b", "c"), np.array([-1, 0, 1]), offsets))


def moved(frames: int, seed: int = 4) -> Motion:
    chance = np.random.default_rng(seed)
    turns = rotation.from_rotation_vector(chance.normal(size=(frames, 3, 3)))
    return body().motion(turns, chance.normal(size=(frames, 3)), 30.0)


def skin(pose: np.ndarray | None = None) -> Mesh:
    chance = np.random.default_rng(2)
    weights = chance.random((9, 3))
    return Mesh(
        chance.normal(size=(9, 3)),
        np.array([[0, 1, 2], [3, 4, 5]]),
        weights / weights.sum(axis=1, keepdims=True),
        pose,
    )


@pytest.mark.parametrize("posed", [False, True])
def test_the_meshs_own_pose_gives_its_vertices(posed):
    pose = moved(1).rotations[0] if posed else None
    mesh = skin(pose)
    at_rest = rotation.identity(1, 3) if pose is None else pose[None]
    still = body().motion(at_rest, body().skeleton.offsets[:1], 30.0)
    np.testing.assert_allclose(mesh.skinned(still)[0], mesh.vertices, atol=1e-12)


def test_it_is_linear_blend_skinning_over_more_frames_than_a_block():
    mesh, motion = skin(), moved(130)
    rest = motion.skeleton.rest_positions
    for frame in (0, 63, 64, 129):
        for vertex in range(9):
            expected = np.zeros(3)
            for joint in range(3):
                turn = rotation.to_matrix(motion.global_rotations[frame, joint])
                place = motion.positions[frame, joint] + turn @ (mesh.vertices[vertex] - rest[joint])
                expected += mesh.weights[vertex, joint] * place
            np.testing.assert_allclose(mesh.skinned(motion)[frame, vertex], expected, atol=1e-12)


def test_what_does_not_fit_is_refused():
    mesh = skin()
    with pytest.raises(SkeletonError, match="other indices"):
        Mesh(mesh.vertices, mesh.faces + 5, mesh.weights)
    with pytest.raises(SkeletonError, match="needs vertices"):
        Mesh(mesh.vertices, mesh.faces, mesh.weights[:5])
    with pytest.raises(SkeletonError, match="pose of shape"):
        Mesh(mesh.vertices, mesh.faces, mesh.weights, rotation.identity(2))
    two = Mesh(mesh.vertices, mesh.faces, mesh.weights[:, :2])
    with pytest.raises(SkeletonError, match="cannot follow a body of 3 joints"):
        two.skinned(moved(1))
