"""SKIN: sizes of record, weights around joints, skinning against the meshes' own, and training."""

from __future__ import annotations

import numpy as np
import pytest
import skr_material
import torch

from retarget_bench.api import Context
from retarget_bench.errors import NotSupported
from retarget_bench.methods.skin import SKIN
from retarget_bench.methods.skin.network import SkinningPredictor, size
from retarget_bench.methods.skin.posing import transforms_of
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.skinning_torch import skinned
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody, moves_about_hips
from retarget_bench.training.phases import to_device

CPU = torch.device("cpu")
INPUTS = ("distances", "vectors")


def standing(name: str = "ada") -> tuple[np.ndarray, np.ndarray]:
    """Vertices and joints of a body in T-pose."""
    return skr_material.body(name).mesh.vertices, SkinnedBody.of(skr_material.body(name)).resting


@pytest.mark.parametrize(("inputs", "parameters"), [("distances", 77_334), ("vectors", 88_598)])
def test_has_the_parameters_of_the_record(inputs, parameters):
    assert sum(each.numel() for each in SkinningPredictor(inputs).parameters()) == parameters


@pytest.mark.parametrize("inputs", INPUTS)
def test_shares_sum_to_one_and_move_and_grow_with_the_body(inputs):
    method = SKIN(inputs=inputs, joints="truth").using(exported(SkinningPredictor(inputs)))
    points, joints = standing()
    actual = method.shares(points, joints)
    assert actual.shape == (len(points), 22)
    np.testing.assert_allclose(actual.sum(axis=1), 1.0, atol=1e-6)
    moved = np.array([3.0, -1.0, 2.0])
    np.testing.assert_allclose(method.shares(1.3 * points + moved, 1.3 * joints + moved), actual, atol=1e-4)


def test_begins_with_shares_that_fall_with_the_distance():
    torch.manual_seed(0)
    network = SkinningPredictor().eval()
    points, joints = (torch.from_numpy(each.astype(np.float32))[None] for each in standing())
    near = (points.unsqueeze(2) - joints.unsqueeze(1)).norm(dim=-1) / size(joints)
    with torch.no_grad():
        actual = network(points, joints)
    nearest = actual.gather(-1, near.argmin(-1, keepdim=True))
    assert nearest.mean() > 10 / 22  # ten times an even share


@pytest.mark.parametrize("name", skr_material.NAMES)
def test_the_mesh_s_own_weights_pose_it_as_its_skeleton_does(name):
    motion = skr_material.motions()[name].at(slice(0, None, 7))
    character, mesh, moved = motion.character, motion.character.mesh, moves_about_hips(motion)
    ranks = list(Body22(character).joints)
    assert character.structure == "body22"
    matrices, rest = rotation.to_matrix(moved["turns"][:, ranks]), SkinnedBody.of(character).resting
    hips = motion.positions[:, ranks[0]] - np.einsum("fab,b->fa", matrices[:, 0], rest[0])
    shifts, shares = transforms_of(rest, matrices, hips), mesh.weights[:, ranks]
    there = [torch.from_numpy(each) for each in (mesh.vertices, shares, matrices, shifts)]
    np.testing.assert_allclose(skinned(*there).numpy(), mesh.skinned(motion), atol=1e-9)


def test_rows_are_points_where_their_bodies_have_them():
    """The true weights of points by barycentric coordinates leave no more than their mixing does."""
    module = skr_material.skin_training()
    batch = module.draw(np.random.default_rng(0), 6)
    assert batch["points"].shape == (6, 256, 3)
    assert batch["moved"].shape == (6, 4, 256, 3)
    for row in range(6):
        each = np.einsum("fjab,pb->fjpa", batch["matrices"][row], batch["points"][row])
        each += batch["shifts"][row][:, :, None]
        apart = np.linalg.norm(each - batch["moved"][row][:, None], axis=-1).min(axis=1)
        assert apart.mean() < 0.02  # metres, by the best of single joints
    again = module.draw(np.random.default_rng(0), 6)
    assert all(np.array_equal(batch[key], again[key]) for key in batch)


def test_the_loss_is_the_mean_distance_unsquared():
    module = skr_material.skin_training()
    batch = to_device(module.draw(np.random.default_rng(0), 3), CPU)
    loss = module.losses("network", batch, {})["points"].item()
    apart = []
    for row in range(3):
        points, joints = batch["points"][row].numpy(), batch["joints"][row].numpy()
        with torch.no_grad():
            shares = module.network(batch["points"][[row]], batch["joints"][[row]])[0].numpy()
        moves = batch["matrices"][row].numpy(), batch["shifts"][row].numpy()
        each = np.einsum("fjab,pb->fpja", moves[0], points) + moves[1][:, None]  # by every joint alone
        there = np.einsum("pj,fpja->fpa", shares, each)
        unit = np.sqrt(((joints - joints.mean(0)) ** 2).sum(-1).mean())
        apart.append(np.linalg.norm(there - batch["moved"][row].numpy(), axis=-1) / unit)
    assert loss == pytest.approx(np.mean(apart), rel=1e-4)


def test_poses_the_body_that_it_sees():
    motion = skr_material.motions()["ada"].at(slice(0, None, 20))
    body = motion.character
    method = skr_material.skin_training().method()
    assert method.supports(body, body) is None
    answer = method.retarget(motion, body, context=Context())
    expected = body.mesh.skinned(motion)
    assert np.linalg.norm(answer.vertices - expected, axis=-1).mean() < 0.05
    with pytest.raises(NotSupported, match="rotations"):
        method.retarget(body.positions(motion.positions, 30.0), body, context=Context())
    assert "another" in method.supports(body, skr_material.body("boris"))


def test_joints_are_those_that_skr_finds():
    method = SKIN(joints="skr")
    method.__dict__["_regressor"] = skr_material.untrained()
    body = SkinnedBody.of(skr_material.body())
    vertices, faces = body.vertices[:, :3], body.faces
    expected = skr_material.untrained().resting(vertices, faces, 2)
    np.testing.assert_array_equal(method._skeletons(body, 2), expected)
