"""SKR and SKIN: points in any order and number, gradients, training, stretched bodies, skinning."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import skr_material
import torch

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.skin import SKIN
from retarget_bench.methods.skin.network import SkinningPredictor, size
from retarget_bench.methods.skin.posing import transforms_of
from retarget_bench.methods.skr import SKR
from retarget_bench.methods.skr.inference import joints_of, placed
from retarget_bench.methods.skr.network import Frame, largest
from retarget_bench.methods.skr.stretching import PARTS, StretchedBody
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import PARENTS, Body22
from retarget_bench.motion.skinning_torch import skinned
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody, moves_about_hips
from retarget_bench.training.learned_method import of_weights
from retarget_bench.training.phases import to_device
from retarget_bench.training.record import Record

CPU = torch.device("cpu")


# ---------------------------------------------------------------------------------------------- network


@pytest.mark.parametrize("views", [1, 2, 4])
@pytest.mark.parametrize("features", [False, True])
def test_order_of_points_changes_nothing(features, views):
    network = skr_material.regressor(features=features)
    points = skr_material.points(1100, 1)[0]
    shuffled = points[np.random.default_rng(1).permutation(len(points))]
    one, other = (joints_of(network, [each], views) for each in (points, shuffled))
    # single precision: a point in another row of a matrix product is rounded otherwise
    np.testing.assert_allclose(one, other, atol=1e-5, rtol=0)
    assert np.ptp(one, axis=1).max() > 0.01


def test_frames_of_any_numbers_of_points_stand_for_themselves():
    network = skr_material.regressor()
    frames = [skr_material.points(count, 1, count)[0] for count in (1, 7, 7, 300, 300, 300, 2000, 7)]
    together = joints_of(network, frames)
    assert np.isfinite(together).all()
    for frame, answer in zip(frames, together, strict=True):
        np.testing.assert_allclose(joints_of(network, [frame])[0], answer, atol=1e-5)


def test_answers_move_turn_and_grow_with_the_points():
    network = skr_material.regressor()
    points = skr_material.points(400, 1)[0].astype(np.float64)
    turn = rotation.to_matrix(rotation.about(np.array([0.0, 1.0, 0.0]), 0.3))
    moved = 1.7 * points @ turn.T + [5.0, 0.2, -3.0]
    one, other = joints_of(network, [points])[0], joints_of(network, [moved])[0]
    np.testing.assert_allclose(1.7 * one @ turn.T + [5.0, 0.2, -3.0], other, atol=1e-4)


OTHER_SIDE = [0, 1, 2, 3, 4, 5, 10, 11, 12, 13, 6, 7, 8, 9, 18, 19, 20, 21, 14, 15, 16, 17]
"""Of every one of the 22 joints, written out."""


@pytest.mark.parametrize("views", [2, 4])
@pytest.mark.parametrize("count", [200, 700, 703])
def test_views_share_the_points_and_their_mean_is_the_answer(count, views):
    """Written plainly: sorted by height, every second or fourth point to a view if that leaves 128."""
    network, answers = skr_material.regressor(), []
    points = [each.astype(np.float64) for each in skr_material.points(count, 2)]
    middle = np.stack([each.mean(axis=0) for each in points])[:, None]
    for number, signs in enumerate([(1, 1, 1), (-1, 1, -1), (-1, 1, 1), (1, 1, -1)][:views]):
        near = [(each - each.mean(axis=0))[np.argsort(each[:, 1])] for each in points]
        near = [each[number::views] if count >= 128 * views else each for each in near]
        joints = joints_of(network, [each * signs for each in near]) * signs
        answers.append(joints[:, OTHER_SIDE] if np.prod(signs) < 0 else joints)
    assert np.ptp(answers, axis=0).max() > 1e-3
    expected = np.mean(answers, axis=0) + middle
    np.testing.assert_allclose(joints_of(network, points, views), expected, atol=1e-5)


def test_the_world_s_direction_is_kept_on_request():
    points = torch.from_numpy(np.stack(skr_material.points(100)))
    frame = Frame.of(points, principal=False)
    assert frame.turn is None
    torch.testing.assert_close(frame.back(frame.into(points)), points)


def test_seen_points_spread_most_to_the_sides():
    numbers = np.random.default_rng(0)
    points = torch.from_numpy(numbers.normal(size=(3, 900, 3)) * [0.1, 0.2, 0.5])
    oriented = Frame.of(points, principal=True).into(points)
    # the directions of largest variance, by an eigenvalue decomposition of the level covariance
    level = points[..., [0, 2]] - points[..., [0, 2]].mean(1, keepdim=True)
    largest_variance = torch.linalg.eigvalsh(level.transpose(1, 2) @ level)[:, -1]
    unit = Frame.of(points, principal=True).unit[:, 0, 0]
    torch.testing.assert_close((oriented[..., 0] * unit[:, None]).square().sum(1), largest_variance)


@pytest.mark.parametrize("search", [torch.float32, torch.float64])
def test_maximum_and_its_gradient_are_those_of_the_dense_layer(search):
    torch.manual_seed(0)
    layer = torch.nn.Linear(16, 40).double()
    points = torch.randn(3, 50, 16, dtype=torch.float64, requires_grad=True)
    pull = torch.randn(3, 40, dtype=torch.float64)
    results = []
    for make in (lambda: largest(points, layer, search), lambda: layer(points).max(1)[0]):
        points.grad = None
        layer.zero_grad()
        answer = make()
        (answer * pull).sum().backward()
        results.append([answer.detach(), points.grad.clone(), layer.weight.grad.clone(), layer.bias.grad])
    for one, other in zip(*results, strict=True):
        torch.testing.assert_close(one, other)
    with torch.no_grad():
        torch.testing.assert_close(largest(points, layer, search), results[0][0])


# --------------------------------------------------------------------------------------------- training
def test_bodies_are_posed_as_their_motion_has_them():
    motion = skr_material.motions()["boris"]
    character, arrays = motion.character, moves_about_hips(motion)
    body, hips = SkinnedBody.of(character), motion.positions[:, Body22(character).joints[0]]
    expected = character.mesh.skinned(motion)
    for frame in (0, 17, motion.frames - 1):
        posed = body.posed(arrays["turns"][frame], arrays["shifts"][frame])
        np.testing.assert_allclose(posed + hips[frame], expected[frame], atol=2e-6)
    joints = motion.positions[:, list(Body22(character).joints)] - hips[:, None]
    np.testing.assert_allclose(arrays["joints"], joints, atol=1e-12)


def test_rows_are_new_points_on_turned_bodies():
    module = skr_material.skr_training()
    batch = module.draw(np.random.default_rng(0), 12)
    count = batch["points"].shape[1]
    assert batch["points"].shape == (12, count, 3)
    assert batch["joints"].shape == (12, 22, 3)
    assert 48 <= count <= 80
    again = module.draw(np.random.default_rng(0), 12)
    other = module.draw(np.random.default_rng(1), 12)
    assert all(np.array_equal(batch[key], again[key]) for key in batch)
    assert not np.array_equal(batch["joints"], other["joints"])
    # turned as the points are: joints lie in the box around dense points
    dense = skr_material.skr_training(fewest=2000, most=2000).draw(np.random.default_rng(0), 12)
    assert (dense["joints"] > dense["points"].min(1, keepdims=True)).all()
    assert (dense["joints"] < dense["points"].max(1, keepdims=True)).all()
    across = batch["joints"][:, 6] - batch["joints"][:, 10]
    assert np.ptp(np.arctan2(across[:, 2], across[:, 0])) > np.pi


def test_the_loss_is_the_mean_square_in_units_of_the_points():
    module = skr_material.skr_training(direction="world")
    batch = to_device(module.draw(np.random.default_rng(0), 5), CPU)
    loss = module.losses("network", batch, {})["joints"].item()
    points, joints = batch["points"].double().numpy(), batch["joints"].double().numpy()
    with torch.no_grad():
        answer = module.network(batch["points"]).double().numpy()
    unit = np.sqrt(((points - points.mean(1, keepdims=True)) ** 2).sum(-1).mean(1))
    assert loss == pytest.approx((((answer - joints) / unit[:, None, None]) ** 2).mean(), rel=1e-4)


# ------------------------------------------------------------------------------------------- the method
def test_weights_bring_the_parameters_that_they_were_trained_with(tmp_path):
    trained = SKR(network="table5", direction="world")
    card = Record(method="skr", version=trained.card.version, facts=trained.facts())
    weights.write(tmp_path, "weights", exported(skr_material.regressor(features=True)), card)
    method = of_weights("skr", str(tmp_path), views=2)
    assert (method.facts(), method.config.views, method.untrained) == (trained.facts(), 2, "")
    complete = registry.create("methods", Spec("correspondence_free", {"skr": str(tmp_path)}))
    assert complete.stages["skr"].facts() == trained.facts()
    with pytest.raises(BenchError, match="nowhere"):
        of_weights("skr", str(tmp_path / "nowhere"))


def test_joints_that_are_none_of_the_22_stay_on_their_bones():
    data = registry.create("datasets", Spec.parse("puppets"))
    clips = {n: each for bodies in data.training().values() for n, each in bodies.items()}
    name = next(n for n, body in data.characters().items() if body.structure == "body28" and n in clips)
    motion = clips[name][0].at(slice(0, None, 10))
    body = Body22(motion.character)
    positions = placed(motion.character, motion.positions[:, list(body.joints)])
    apart = np.linalg.norm(positions - motion.positions, axis=-1)
    assert apart[:, list(body.joints)].max() < 1e-12
    # tips and split bones: within the turn of a hand or head that its own joint alone cannot show
    assert apart.max() < 0.12 * motion.character.height
    assert apart.mean() < 0.01 * motion.character.height


def test_says_what_it_cannot_do():
    method, ada, sumo = skr_material.untrained(), skr_material.body(), skr_material.body("boris")
    assert method.supports(ada, ada) is None
    assert "another" in method.supports(ada, sumo)
    assert "mesh" in method.unfit(replace(ada, skin=None))


def test_reduced_precision_only_chooses_the_points():
    module = skr_material.skr_training()
    batch = to_device(module.draw(np.random.default_rng(0), 4), CPU)
    exact = module.losses("network", batch, {})["joints"]
    with torch.autocast("cpu", torch.bfloat16):
        rough = module.losses("network", batch, {})["joints"]
    assert rough.dtype == torch.float32
    assert rough.item() == pytest.approx(exact.item(), rel=0.02)


def test_joints_at_rest_are_drawn_again_and_again():
    method, mesh = skr_material.untrained(), skr_material.body().mesh
    drawn = method.resting(mesh.vertices, mesh.faces, 4)
    assert drawn.shape == (4, 22, 3)
    assert len(np.unique(drawn[:, 0, 1])) == 4
    np.testing.assert_array_equal(drawn, method.resting(mesh.vertices, mesh.faces, 4))


# ----------------------------------------------------------------------------------------- stretched bodies
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


def test_bones_keep_their_stretched_lengths_in_every_pose():
    stretched, arrays = body()
    stretch = stretched.drawn(np.random.default_rng(3))
    rest = lengths(at_rest(stretched, stretch)[1])
    for frame in (0, 25, 50):
        posed = stretched.posed(stretch, arrays["turns"][frame], arrays["shifts"][frame])[1]
        np.testing.assert_allclose(lengths(posed), rest, rtol=1e-9)


# ----------------------------------------------------------------------------------------------------- SKIN
INPUTS = ("distances", "vectors")


def standing(name: str = "ada") -> tuple[np.ndarray, np.ndarray]:
    """Vertices and joints of a body in T-pose."""
    return skr_material.body(name).mesh.vertices, SkinnedBody.of(skr_material.body(name)).resting


@pytest.mark.parametrize("inputs", INPUTS)
def test_shares_sum_to_one_and_move_and_grow_with_the_body(inputs):
    method = SKIN(inputs=inputs, joints="truth").using(exported(SkinningPredictor(inputs)))
    points, joints = standing()
    actual = method.shares(points, joints)
    assert actual.shape == (len(points), 22)
    np.testing.assert_allclose(actual.sum(axis=1), 1.0, atol=1e-6)
    moved = np.array([3.0, -1.0, 2.0])
    np.testing.assert_allclose(method.shares(1.3 * points + moved, 1.3 * joints + moved), actual, atol=1e-4)


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


def test_begins_with_shares_that_fall_with_the_distance():
    torch.manual_seed(0)
    network = SkinningPredictor().eval()
    points, joints = (torch.from_numpy(each.astype(np.float32))[None] for each in standing())
    near = (points.unsqueeze(2) - joints.unsqueeze(1)).norm(dim=-1) / size(joints)
    with torch.no_grad():
        actual = network(points, joints)
    nearest = actual.gather(-1, near.argmin(-1, keepdim=True))
    assert nearest.mean() > 10 / 22  # ten times an even share
