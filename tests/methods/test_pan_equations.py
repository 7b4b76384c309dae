"""Equations 1 to 9 of PAN, each against plain NumPy from the formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from pan_reference import S23, S28, bones, close, codes, motion
from torch import nn

from retarget_bench.methods.pan.network import Decoder, Discriminator, Encoder, SkeletonEncoder
from retarget_bench.methods.pan.network.attention import Attention
from retarget_bench.methods.pan.network.layers import DropoutMask, mlp
from retarget_bench.methods.pan.settings import PAPER


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def arrays(module: nn.Module) -> list[np.ndarray]:
    return [each.detach().double().numpy() for each in module.parameters()]


def relu(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, 0.0)


def embedded(encoder: Encoder, values: np.ndarray) -> np.ndarray:
    w0, b0, w1, b1, w2, b2 = arrays(encoder.embedding)
    return relu(relu(values @ w0.T + b0) @ w1.T + b1) @ w2.T + b2


def test_equation_1_embeds_a_slot_by_three_layers_256_wide():
    encoder = Encoder(S23, PAPER)
    inputs = torch.randn(7, 4)
    embedding = mlp(inputs, encoder.embedding, "relu")
    assert [len(each) for each in arrays(encoder.embedding)[::2]] == [256, 256, 32]
    close(embedding, torch.from_numpy(embedded(encoder, inputs.double().numpy())).float())


def code_of(j: int, width: int = 32) -> np.ndarray:
    code = np.zeros(width)
    for i in range(width // 2):
        code[2 * i] = np.sin(j / 10_000 ** (2 * i / width))
        code[2 * i + 1] = np.cos(j / 10_000 ** (2 * i / width))
    return code


def test_equation_2_codes_the_index_of_a_slot():
    encoder = Encoder(S28, PAPER)
    expected = np.stack([code_of(edge) for edge in encoder.edges.tolist()])
    np.testing.assert_allclose(encoder.code.numpy(), expected, atol=1e-6)
    assert sorted(encoder.edges.tolist()) == list(range(28))


def test_equation_3_adds_embedding_and_code():
    """Seen through equations 4 and 5: the first layer's weights are those of the sums."""
    encoder = Encoder(S23, PAPER)
    inputs = motion(S23, rows=1, frames=16)
    edges = embedded(encoder, inputs[0, 0].double().numpy()) + np.stack([code_of(j) for j in range(23)])
    token, part = encoder.tokens.detach().double().numpy()[2], [*S23.parts[2], 22]
    weight, bias = arrays(encoder.layers[0])
    asking = token @ weight[:32].T + bias[:32]
    keys = np.stack([token, *edges[part]]) @ weight[32:64].T + bias[32:64]
    scores = np.exp(keys @ asking / np.sqrt(32))
    expected = np.zeros(23)
    expected[part] = (scores / scores.sum())[1:]
    np.testing.assert_allclose(encoder.attention(inputs)[0, 0, 2].detach().numpy(), expected, atol=1e-5)


def attended(layer: Attention, rows: np.ndarray, sees: np.ndarray, heads: int) -> np.ndarray:
    """Equations 4 and 5 for ``(rows, width)``."""
    weight, bias = arrays(layer.qkv)
    asking, keys, values = np.split(rows @ weight.T + bias, 3, axis=1)
    size = rows.shape[1] // heads
    parts = []
    for head in range(heads):
        own = slice(head * size, (head + 1) * size)
        scores = (asking[:, own] @ keys[:, own].T + np.where(sees, 0.0, -np.inf)) / np.sqrt(size)
        scores = np.exp(scores - scores.max(1, keepdims=True))
        parts.append(scores / scores.sum(1, keepdims=True) @ values[:, own])
    return np.concatenate(parts, 1)


@pytest.mark.parametrize("heads", [1, 2])
def test_equations_4_and_5_are_masked_attention(heads):
    layer = Attention(replace(PAPER, heads=heads))
    nn.init.normal_(layer.qkv.bias)
    rows = torch.randn(5, 6, 32)
    sees = np.zeros((6, 6), dtype=bool)
    for queries, keys in [((0, 1), (0, 1, 4)), ((2,), (2, 5)), ((3, 4, 5), (3, 4, 5))]:
        sees[np.ix_(queries, keys)] = True
    sees[4, 5] = False
    hidden = torch.zeros(6, 6).masked_fill(~torch.from_numpy(sees), -torch.inf)
    actual = layer(rows, hidden, None)
    torch.testing.assert_close(layer(rows, hidden[:3], DropoutMask(0.0, rows.device)), actual[:, :3])
    for frame in range(5):
        expected = attended(layer, rows[frame].double().numpy(), sees, heads)
        np.testing.assert_allclose(actual[frame].detach().numpy(), expected, atol=1e-5)


def reflected(values: np.ndarray, reach: int) -> np.ndarray:
    return np.concatenate([values[reach:0:-1], values, values[-2 : -reach - 2 : -1]])


def convolved_by_hand(values: np.ndarray, weight: np.ndarray, bias: np.ndarray, stride: int) -> np.ndarray:
    """``(frames, outputs)`` of ``(frames, inputs)``, reflected at both ends."""
    taps = weight.shape[2]
    padded = reflected(values, taps // 2)
    return np.stack(
        [
            np.einsum("ti,oit->o", padded[start : start + taps], weight) + bias
            for start in range(0, len(values), stride)
        ]
    )


def test_equation_6_convolves_each_part_for_itself():
    """With one layer of attention nothing stands between the two convolutions."""
    encoder = Encoder(S23, replace(PAPER, layers=1))
    inputs = motion(S23, rows=1, frames=20)
    tokens, _ = encoder._first(inputs, None)
    actual = encoder(inputs)[0].detach().numpy()
    assert actual.shape == (5, 6, 32)
    for part in range(6):
        values = tokens[:, part].detach().double().numpy()
        for layer in encoder.convolutions:
            weight, bias = arrays(layer)
            own = slice(part * 32, (part + 1) * 32)
            assert weight.shape == (192, 32, 15)
            values = relu(convolved_by_hand(values, weight[own], bias[own], 2))
        np.testing.assert_allclose(actual[:, part], values, atol=1e-5)


def test_equation_7_encodes_the_bones_of_a_part():
    encoder = SkeletonEncoder(S28, PAPER)
    lengths = bones(S28, rows=1)
    actual = encoder(lengths)[0].detach().numpy()
    start = 0
    for number, part in enumerate(S28.parts):
        values = lengths[0, list(part)].flatten().double().numpy()
        for depth, layer in enumerate(encoder.layers):
            weight, bias = arrays(layer)
            size = len(values)
            row = start if depth == 0 else number * size
            values = values @ weight[row : row + size] + bias[number]
            values = relu(values) if depth < 2 else values
        start += 3 * len(part)
        np.testing.assert_allclose(actual[number], values, atol=1e-5)


def doubled(values: np.ndarray) -> np.ndarray:
    """Twice the frames: a quarter of a frame before and behind each of them."""
    positions = np.clip((np.arange(2 * len(values)) + 0.5) / 2 - 0.5, 0, len(values) - 1)
    below = np.floor(positions).astype(int)
    share = (positions - below)[:, None]
    return (1 - share) * values[below] + share * values[np.minimum(below + 1, len(values) - 1)]


def test_equation_8_decodes_all_parts_together():
    decoder = Decoder(S23, PAPER)
    code = codes(S23, rows=1)
    values = code[0].flatten(1).double().numpy()
    values = relu(convolved_by_hand(doubled(values), *arrays(decoder.inner), 1))
    values = convolved_by_hand(doubled(values), *arrays(decoder.outer), 1)
    np.testing.assert_allclose(decoder(code)[0].flatten(1).detach().numpy(), values, atol=1e-5)


def test_equation_9_squashes_scores():
    squashed = Discriminator(12, PAPER)
    flat = Discriminator(12, replace(PAPER, squashed=False))
    flat.load_state_dict(squashed.state_dict())
    inputs = torch.randn(2, 20, 12)
    scores = flat(inputs).detach().double().numpy()
    assert scores.shape == (2, 20 - 15 + 1)
    np.testing.assert_allclose(squashed(inputs).detach().numpy(), 1 / (1 + np.exp(-scores)), atol=1e-6)
