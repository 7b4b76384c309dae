"""Tables, layers of discriminators, weights and sums that stand beside the answers of SAN's authors."""

from __future__ import annotations

# ruff: noqa: F811  (fixtures of another file are parameters here)
import numpy as np
import pytest
import torch
from test_san_oracles import (  # noqa: F401  (fixtures)
    BOTH,
    RELEASED,
    Oracle,
    character,
    close,
    discriminator_of,
    listed,
    oracle,
    recorded,
    seen,
    slots,
    step,
)

from retarget_bench.methods.san import San
from retarget_bench.methods.san.skeleton import Edges, Levels, layout_of
from retarget_bench.training.layers.skeletal.discriminators import discriminator_loss
from retarget_bench.training.layers.skeletal.end_effectors import NEAR, RESTING


def levels_of(recorded: Oracle) -> Levels:
    body = character(recorded, 0, "any")
    return RELEASED.levels(layout_of(body.skeleton.parents.tolist(), body.roles))


def pooling(groups: tuple[tuple[int, ...], ...], width: int, *, mean: bool) -> torch.Tensor:
    """The matrix that makes one slot of each group, or with a transposition each group of one slot."""
    matrix = torch.zeros(len(groups), sum(map(len, groups)))
    for row, group in zip(matrix, groups, strict=True):
        row[list(group)] = 1.0 / len(group) if mean else 1.0
    return torch.kron(matrix, torch.eye(width))


@pytest.mark.parametrize(
    ("name", "level", "width", "mean"),
    [
        ("auto_encoder/enc.layers.0.1", "first", 8, True),
        ("auto_encoder/enc.layers.1.1", "chains", 16, True),
        ("auto_encoder/dec.layers.0.1", "chains", 16, False),
        ("auto_encoder/dec.unpools.0", "chains", 16, False),
        ("auto_encoder/dec.layers.1.1", "first", 8, False),
        ("auto_encoder/dec.unpools.1", "first", 8, False),
        ("static_encoder/layers.0.1", "first", 6, True),
        ("discriminator/layers.0.2", "first", 6, True),
        ("discriminator/layers.1.1", "pairs", 12, True),
    ],
)
def test_poolings_are_their_matrices(recorded, name, level, width, mean):
    matrix = pooling(getattr(levels_of(recorded), level), width, mean=mean)
    expected = recorded[f"pool_weight/{name}"]
    torch.testing.assert_close(matrix if mean else matrix.T, expected, rtol=0, atol=0)


def test_tables_of_both_networks_are_theirs(recorded):
    """Discriminators have the trees, neighbours and first pooling of auto-encoders."""
    levels, edges = levels_of(recorded), Edges.of(recorded["structure/parents"].tolist())
    _, left = edges.pooled()
    for level, tree in enumerate((edges, left)):
        for network in ("auto_encoder", "discriminator"):
            assert [list(pair) for pair in tree.pairs] == recorded[f"edges/{network}/{level}"].tolist()
            assert levels.neighbours[level] == listed(recorded[f"neighbours/{network}/{level}"])
    assert levels.first == listed(recorded["pooling_list/discriminator/0"])
    assert [list(pair) for pair in edges.pairs] == recorded["structure/edges"].tolist()
    assert recorded["structure/fk_topology"].tolist() == [-1, *recorded["structure/parents"][1:]]
    assert recorded["structure/fk_rotation_map"].tolist() == [joint for _, joint in edges.pairs]
    assert not len(recorded["edges/auto_encoder/2"])  # they list none behind whole chains


def test_layers_of_discriminators_answer_as_theirs(recorded):
    """Of the input, with running statistics: behind the first pooling, and scores before the sigmoid."""
    judge = discriminator_of(recorded).eval()
    shown: list[torch.Tensor] = []
    judge.last.register_forward_pre_hook(lambda module, inputs: shown.append(inputs[0]))
    with torch.no_grad():
        scores = judge(recorded["output/fk_bone_vectors"].flatten(2).unflatten(2, (-1, 3)))
        close(shown[0], recorded["between/discriminator_layer0"])
        close(judge.last(shown[0]), recorded["between/discriminator_layer1"])
    close(scores, recorded["between/discriminator_layer1"].sigmoid())


def test_weights_are_theirs(oracle):
    record, weights = oracle("step"), San(variant="released").settings.weights
    actual = {
        "rec_quaternion": 1.0,
        "rec_global": weights.root,
        "rec_position": weights.positions,
        "lambda_rec": weights.reconstruction,
        "cycle": weights.cycle,
        "ee": weights.ends,
        "gan": weights.adversarial,
        "ee_at_rest": RESTING,
        "ee_rest_threshold": NEAR,
    }
    reference = {name.split("/")[1] for name in record.names if name.startswith("weight/")}
    assert reference == set(actual)
    for name, each in actual.items():
        assert each == pytest.approx(float(record[f"weight/{name}"]), rel=1e-6), name


@pytest.mark.parametrize("number", [0, 1])
def test_each_discriminator_s_loss_is_theirs(step, oracle, number):
    """They see the generator's answers first, which changes their running statistics and not the loss."""
    record, name = oracle("step"), BOTH[number]
    real, fake = next((real, fake) for there, real, fake in step.memory["shown"] if there == name)
    judge = discriminator_of(oracle(name))
    loss = discriminator_loss(judge(real), judge(fake)).item()
    assert loss == pytest.approx(float(record[f"loss/D_loss_{number}"]), rel=1e-5)
    assert loss == pytest.approx(float(record["loss/sum/loss_Ds"][number]), rel=1e-5)
    after = record[f"step/{name}/discriminator_buffers_after/layers.0.1.num_batches_tracked"]
    norm = step.module.modules["discriminator"].discriminators[name].norm
    assert norm.num_batches_tracked.item() == int(after) == 3


@pytest.mark.parametrize("name", BOTH)
def test_ends_of_the_sources_move_as_theirs(step, oracle, name):
    record, arrays = oracle("step"), oracle(name)
    rows = record[f"step/{name}/character"]
    which = torch.from_numpy(rows.astype(np.int64)) + 1
    edges = step.module._structures[name].plain(slots(arrays["input/motion"]), which)
    real = step.module._real(name, {"edges": edges, **seen(arrays, rows, frames=64)})
    ends = real.in_heights[:, :, arrays["structure/ee_ids"].tolist()].detach()
    # differences of positions about a height away, in single precision
    assert (10 * ends.diff(dim=1) - record[f"step/{name}/end_velocities"]).abs().max() < 1e-5
