"""SAME's network: the authors' arrays, plain loops, and that rows do not see each other."""

from __future__ import annotations

import numpy as np
import pytest
import same_material
import torch

from retarget_bench.methods.same.bodies import body
from retarget_bench.methods.same.graph import Graphs, Nodes, matrices
from retarget_bench.methods.same.network import Autoencoder, GraphAttention

NAMES = tuple(same_material.BODIES)


def graphs(*names: str) -> Graphs:
    return Graphs.of([Nodes.of(body(same_material.BODIES[name])) for name in names])


def network() -> Autoencoder:
    return same_material.training_module().network.eval()


def seen(count: int, frames: int = 3, seed: int = 0) -> torch.Tensor:
    return torch.randn(count, frames, 26, generator=torch.Generator().manual_seed(seed))


def relative(answer: torch.Tensor, expected: np.ndarray) -> float:
    return float(np.abs(answer.numpy() - expected).max() / np.abs(expected).max())


# ------------------------------------------------------------------------------------------ the authors'


@pytest.mark.parametrize("pair", same_material.PAIRS)
def test_forward_is_the_authors(real_data, tmp_path, pair) -> None:
    arrays = same_material.oracle(real_data)
    model = same_material.released(arrays, tmp_path)
    inside: dict[str, torch.Tensor] = {}
    for kind, layers in (("encoder", model.encoder), ("decoder", model.decoder)):
        for number, layer in enumerate(layers):
            layer.register_forward_hook(
                lambda _, __, out, name=f"{kind}_conv{number}": inside.update({name: out})
            )
    features = torch.from_numpy(arrays[f"{pair}/source/features"][..., 6:]).transpose(0, 1)
    sides = [Graphs.of([same_material.nodes(arrays, f"{pair}/{side}")]) for side in ("source", "target")]
    with torch.no_grad():
        codes = model.encode(model.scale.restore("pose", features), sides[0])
        answer = model.decode(codes, sides[1])
    assert relative(codes[0], arrays[f"{pair}/output/z"]) < 1e-5
    assert relative(answer.root[0], arrays[f"{pair}/output/r"]) < 1e-5
    assert relative(answer.columns.transpose(0, 1), arrays[f"{pair}/output/q6"]) < 1e-5
    assert relative(answer.contact.T[..., None], arrays[f"{pair}/output/c"]) < 1e-5
    assert len(inside) == 8
    for name, inner_values in inside.items():
        assert relative(inner_values[:, 0], arrays[f"{pair}/between/{name}"]) < 1e-5, name


# ----------------------------------------------------------------------------------------- plain loops
@pytest.mark.parametrize("heads", [1, 3])
def test_attention_is_a_softmax_over_neighbours(heads) -> None:
    torch.manual_seed(0)
    layer = GraphAttention(5, 4, heads)
    torch.nn.init.normal_(layer.bias)
    side = graphs("small")
    inputs = torch.randn(len(side.row), 2, 5)
    with torch.no_grad():
        actual = layer(inputs, side)
        values = layer.linear(inputs).unflatten(-1, (heads, 4)).double()
    near: dict[int, list[int]] = {node: [node] for node in range(len(side.row))}
    for node, other in zip(side.receivers.tolist(), side.senders.tolist(), strict=True):
        near[node].append(other)
    for node, others in near.items():
        for frame in range(2):
            for head in range(heads):
                own = values[node, frame, head] @ layer.asking[head].double()
                logits = torch.stack(
                    [own + values[k, frame, head] @ layer.asked[head].double() for k in others]
                )
                share = torch.softmax(torch.where(logits > 0, logits, 0.2 * logits), 0)
                expected = sum(s * values[k, frame, head] for s, k in zip(share, others, strict=True))
                expected = expected + layer.bias[4 * head : 4 * head + 4]
                torch.testing.assert_close(
                    actual[node, frame, 4 * head : 4 * head + 4].double(),
                    expected.detach(),
                    atol=1e-5,
                    rtol=1e-5,
                )


def test_two_columns_are_a_rotation() -> None:
    rotations = matrices(torch.randn(50, 6, dtype=torch.float64))
    eye = torch.eye(3, dtype=torch.float64).expand(50, -1, -1)
    torch.testing.assert_close(rotations.mT @ rotations, eye)
    torch.testing.assert_close(torch.linalg.det(rotations), torch.ones(50, dtype=torch.float64))
    torch.testing.assert_close(matrices(torch.cat([rotations[..., 0], rotations[..., 1]], -1)), rotations)


# ------------------------------------------------------------------------------------ rows and frames
def test_rows_do_not_see_each_other() -> None:
    model, together = network(), graphs(*NAMES)
    features = seen(len(together.row))
    with torch.no_grad():
        codes = model.encode(features, together)
        answer = model.decode(codes, together)
        for row, name in enumerate(NAMES):
            alone, own = graphs(name), together.row == row
            code = model.encode(features[own], alone)
            torch.testing.assert_close(code[0], codes[row], atol=1e-5, rtol=1e-5)
            one = model.decode(code, alone)
            torch.testing.assert_close(one.columns, answer.columns[own], atol=1e-5, rtol=1e-5)
            torch.testing.assert_close(one.root[0], answer.root[row], atol=1e-3, rtol=1e-5)


def test_what_nodes_say_of_the_hips_moves_is_not_read() -> None:
    model, side = network(), graphs("plain")
    features = seen(len(side.row))
    other = features.clone()
    other[1:, :, 9:13] = 7.0
    with torch.no_grad():
        assert torch.equal(model.encode(features, side), model.encode(other, side))
        other[0, :, 9:13] = 7.0
        assert not torch.equal(model.encode(features, side), model.encode(other, side))
