"""SAME while it is trained: rows, losses, that it learns, its weights."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
import torch
import training_material

from retarget_bench.methods.same import Same, losses
from retarget_bench.methods.same.bodies import body
from retarget_bench.methods.same.features import CONTACT, POSITION, ROOT
from retarget_bench.methods.same.graph import places
from retarget_bench.methods.same.training import CUT, DEEPEST, cut


# ------------------------------------------------------------------------------------------------- rows
def test_a_row_is_one_performance_by_two_bodies() -> None:
    module = same_material.training_module()
    data = training_material.training_data(Same(), same_material.BODIES, (30, 11))
    shapes = {name: body(each).shape for name, each in data.characters.items()}
    both = set()
    for seed in range(60):
        starts_by_body = []
        for nodes, features in module._row(np.random.default_rng(seed)):
            (name,) = (n for n, shape in shapes.items() if nodes.shape[0].tolist() == shape[0].tolist())
            order = [shapes[name].tolist().index(each.tolist()) for each in nodes.shape]
            starts = {
                (clip.name, start)
                for clip in data.clips[name]
                for start in clip.starts(same_material.WINDOW)
                if np.array_equal(
                    clip.arrays["nodes"][start : start + same_material.WINDOW, order].swapaxes(0, 1),
                    features,
                )
            }
            starts_by_body.append((name, starts))
        assert starts_by_body[0][1] & starts_by_body[1][1]
        both.add((starts_by_body[0][0], starts_by_body[1][0]))
    assert len(both) == 9  # bodies in all pairs, onto themselves too


def test_cut_bodies_are_whole_graphs() -> None:
    numbers = np.random.default_rng(0)
    parents = body(same_material.BODIES["plain"]).skeleton.parents
    forks = np.flatnonzero(np.bincount(parents[1:]) > 1)
    lost = []
    for _ in range(400):
        kept = cut(numbers, parents)
        assert np.isin(parents[kept[1:]], kept).all()
        assert np.isin(forks, kept).all()
        assert kept[0] == 0
        lost.append(len(parents) - len(kept))
    assert max(lost) == DEEPEST
    assert abs(np.mean(np.array(lost) > 0) - CUT) < 0.08


def test_statistics_are_of_the_clips() -> None:
    module = same_material.training_module()
    data = training_material.training_data(Same(), same_material.BODIES, (30, 11))
    every = [clip.arrays["nodes"] for clips in data.clips.values() for clip in clips]
    flat = np.concatenate([each.reshape(-1, 26) for each in every])
    mean, deviation = module.network.scale.pose_mean.numpy(), module.network.scale.pose_deviation.numpy()
    np.testing.assert_allclose(mean[POSITION], flat[:, POSITION].mean(0), atol=1e-3)
    np.testing.assert_allclose(deviation[POSITION], flat[:, POSITION].std(0), rtol=1e-3)
    root = np.concatenate([each[:, 0, ROOT] for each in every])
    np.testing.assert_allclose(mean[ROOT], root.mean(0), atol=1e-3)
    np.testing.assert_allclose(deviation[ROOT], root.std(0), rtol=1e-3)
    assert (mean[CONTACT.start], deviation[CONTACT.start]) == (0.0, 1.0)


def test_clips_shorter_than_a_window_are_left_out() -> None:
    assert len(same_material.training_module((30, 5))._performances) == 1


# ----------------------------------------------------------------------------------------------- losses
def whole(module, rows=4):
    """A batch, its truth, and an answer beside it."""
    side = training_material.batch(module, rows)["target"]
    truth = losses.performed(side["features"], side["graphs"])
    with torch.no_grad():
        codes = module.network.encode(side["features"], side["graphs"])
        answer = losses.answered(module.network.decode(codes, side["graphs"]), side["graphs"])
    return side["graphs"], truth, answer


def treading(graphs, truth, answer):
    """The same, on the floor: an answer of a network at first, and a dance, are neither near it nor in
    contact, and what is lost there would be zero whatever its formula."""
    numbers = torch.Generator().manual_seed(1)
    shape = answer.world.shape[:-1]
    world = answer.world.clone()
    world[..., 1] = 8.0 * torch.rand(shape, generator=numbers) - 3.0
    return (
        graphs,
        truth._replace(contact=torch.rand(shape, generator=numbers)),
        answer._replace(world=world),
    )


def test_kinematics_of_the_truth_are_its_places() -> None:
    module = same_material.training_module()
    graphs, truth, _ = whole(module)
    actual = places(graphs, truth.turned, truth.root[..., 3])
    torch.testing.assert_close(actual, truth.local, atol=2e-3, rtol=0)


def test_losses_are_the_formulas() -> None:
    module = same_material.training_module()
    graphs, truth, answer = treading(*whole(module))
    unit = module.network.scale.pose_deviation[ROOT]
    actual = {name: float(each) for name, each in losses.terms(answer, truth, graphs, unit).items()}
    a, t = (type(x)(*(each.double().numpy() for each in x)) for x in (answer, truth))
    turning = graphs.turning.numpy()
    speed = np.linalg.norm(a.world[:, 1:] - a.world[:, :-1], axis=-1)
    low = np.clip(1 - a.world[:, 1:, 1] / 3, 0, 1)
    jerk = a.world[:, 3:] - 3 * a.world[:, 2:-1] + 3 * a.world[:, 1:-2] - a.world[:, :-3]
    step = (a.world[:, 1:] - a.world[:, :-1]) - (t.world[:, 1:] - t.world[:, :-1])
    expected = {
        "rotations": ((a.turned - t.turned)[turning] ** 2).mean(),
        "positions": ((a.local - t.local) ** 2).mean(),
        "root": (((a.root - t.root) / unit.numpy()) ** 2).mean(),
        "velocities": (step**2).mean(),
        "contacts": ((a.contact - t.contact) ** 2).mean(),
        "still": (t.contact[:, 1:] * speed).mean(),
        "floor": (np.minimum(a.world[..., 1], 0) ** 2).mean(),
        "slide": ((speed * low) ** 2).mean(),
        "jerk": ((jerk * 30**3 * 1e-5) ** 2).sum(-1).mean(),
    }
    assert {*expected, "codes"} == set(losses.WEIGHTS)
    for name, each in expected.items():
        assert each > 0.0, name
        assert actual[name] == pytest.approx(each, rel=1e-4), name


def test_terms_are_weighed_as_released() -> None:
    """As docs/methods.md says; codes of both performances are held together."""
    module = same_material.training_module()
    batch = training_material.batch(module, 4)
    with torch.no_grad():
        actual = {name: float(each) for name, each in module.losses("network", batch, {}).items()}
        source, target = batch["source"], batch["target"]
        codes = [module.network.encode(side["features"], side["graphs"]) for side in (source, target)]
        graphs = target["graphs"]
        answer = losses.answered(module.network.decode(codes[0], graphs), graphs)
        truth = losses.performed(target["features"], graphs)
        plain = losses.terms(answer, truth, graphs, module.network.scale.pose_deviation[ROOT])
    plain["codes"] = (codes[0] - codes[1]).square().mean()
    weights = {"rotations": 5, "positions": 0.01, "root": 10, "velocities": 1, "contacts": 1}
    weights |= {"still": 6, "codes": 1, "floor": 0.1, "slide": 6, "jerk": 0.2}
    assert weights == losses.WEIGHTS  # some terms are zero here, and would hide it
    expected = {name: weight * float(plain[name]) for name, weight in weights.items()}
    assert actual == pytest.approx(expected, rel=1e-5)


def test_the_world_is_a_product_of_the_moves() -> None:
    graphs, truth, _ = whole(same_material.training_module())
    root, local = truth.root.double().numpy(), truth.local.double().numpy()
    for row in range(len(graphs.hips)):
        nodes = (graphs.row == row).numpy()
        frame = np.eye(4)
        for k, (turn, left, ahead, _) in enumerate(root[row]):
            cos, sin = np.cos(turn), np.sin(turn)
            move = [[cos, 0, sin, left], [0, 1, 0, 0], [-sin, 0, cos, ahead], [0, 0, 0, 1]]
            frame = frame @ np.array(move)
            expected = local[nodes, k] @ frame[:3, :3].T + frame[:3, 3]
            np.testing.assert_allclose(truth.world[nodes, k].numpy(), expected, atol=1e-3)
