"""SKR: sizes of record, points in any order and number, gradients against dense ones, training, weights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import skr_material
import torch
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.api import Context
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.skr import SKR
from retarget_bench.methods.skr.inference import joints_of, placed
from retarget_bench.methods.skr.network import Frame, SkeletonRegressor, largest
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import Body22
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import weights
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.skinned_body import SkinnedBody, moves_about_hips
from retarget_bench.training.learned_method import of_weights
from retarget_bench.training.phases import to_device
from tests.examples import examples

CPU = torch.device("cpu")


# ---------------------------------------------------------------------------------------------- network
@pytest.mark.parametrize(("features", "parameters"), [(False, 1_612_875), (True, 3_466_251)])
def test_has_the_parameters_of_the_record(features, parameters):
    assert sum(each.numel() for each in SkeletonRegressor(features).parameters()) == parameters


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
@pytest.mark.parametrize("count", [200, 700])
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


@given(seed=st.integers(0, 99))
@examples(10)
def test_four_views_of_few_points_know_neither_left_from_right_nor_front_from_back(seed):
    """All of few points are in every view, so a mirror exchanges the sides and changes nothing else."""
    network, points = skr_material.regressor(), skr_material.points(200, 1, seed)
    joints = joints_of(network, points, 4)
    for mirror in ([-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]):
        again = joints_of(network, [each * np.array(mirror, np.float32) for each in points], 4)
        np.testing.assert_allclose(again[:, OTHER_SIDE] * mirror, joints, atol=1e-5)


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


def test_reduced_precision_only_chooses_the_points():
    module = skr_material.skr_training()
    batch = to_device(module.draw(np.random.default_rng(0), 4), CPU)
    exact = module.losses("network", batch, {})["joints"]
    with torch.autocast("cpu", torch.bfloat16):
        rough = module.losses("network", batch, {})["joints"]
    assert rough.dtype == torch.float32
    assert rough.item() == pytest.approx(exact.item(), rel=0.02)


# ------------------------------------------------------------------------------------------- the method
def test_weights_bring_the_parameters_that_they_were_trained_with(tmp_path):
    trained = SKR(network="table5", direction="world")
    card = {"method": "skr", "version": trained.card.version, "facts": trained.facts()}
    weights.write(tmp_path, "weights", exported(skr_material.regressor(features=True)), card)
    method = of_weights("skr", str(tmp_path), views=2)
    assert (method.facts(), method.config.views, method.untrained) == (trained.facts(), 2, "")
    complete = registry.create("methods", Spec("correspondence_free", {"skr": str(tmp_path)}))
    assert complete.stages["skr"].facts() == trained.facts()
    with pytest.raises(BenchError, match="nowhere"):
        of_weights("skr", str(tmp_path / "nowhere"))


def test_answers_for_points_and_for_motions_of_the_same_body():
    motion = skr_material.motions()["ada"]
    motion = motion.at(slice(3))
    answer = skr_material.untrained().retarget(motion, motion.character, context=Context(seed=3))
    assert answer.frames == 3
    assert np.isfinite(answer.positions).all()
    again = skr_material.untrained().retarget(motion, motion.character, context=Context(seed=3))
    np.testing.assert_array_equal(answer.positions, again.positions)
    places = motion.character.positions(motion.positions, motion.fps)
    with pytest.raises(NotSupported, match="points"):
        skr_material.untrained().retarget(places, motion.character, context=Context())


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


def test_joints_at_rest_are_drawn_again_and_again():
    method, mesh = skr_material.untrained(), skr_material.body().mesh
    drawn = method.resting(mesh.vertices, mesh.faces, 4)
    assert drawn.shape == (4, 22, 3)
    assert len(np.unique(drawn[:, 0, 1])) == 4
    np.testing.assert_array_equal(drawn, method.resting(mesh.vertices, mesh.faces, 4))


def test_says_what_it_cannot_do():
    method, ada, sumo = skr_material.untrained(), skr_material.body(), skr_material.body("boris")
    assert method.supports(ada, ada) is None
    assert "another" in method.supports(ada, sumo)
    assert "mesh" in method.unfit(replace(ada, skin=None))
