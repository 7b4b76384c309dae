"""HuMoT's networks: as many parameters as said, the same as plain ones, blind to padding and neighbours."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from humot_reference import PlainDecoder, PlainEncoder, batch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.humot.network import Decoder, Encoder
from retarget_bench.methods.humot.network import block as blocks
from retarget_bench.methods.humot.network import layers as temporal
from retarget_bench.methods.humot.network.layers import STRETCH, TemporalConvolution
from retarget_bench.methods.humot.network.tokens import RaggedTokens
from retarget_bench.methods.humot.settings import PAPER_COUNT, SMALL, TEXT, Design
from tests.examples import examples

TINY = {"width": 16, "latent": 8, "heads": 4, "blocks": (2, 2), "template": (4, 6), "motion": (3, 5, 8)}
DESIGNS = {
    "batch": replace(TEXT, **TINY),
    "batch, free of parameters": replace(PAPER_COUNT, **TINY),
    "layer": replace(SMALL, **TINY),
    "layer, free of parameters": replace(SMALL, **TINY, affine=False, biased=True),
}
every_design = pytest.mark.parametrize("design", DESIGNS.values(), ids=list(DESIGNS))
by_token = [design for design in DESIGNS.values() if design.norm == "layer"]
SIZES = {
    "alike": ([5, 5, 5], [12, 12, 12]),
    "joints differ": ([9, 3, 5], [12, 12, 12]),
    "both differ": ([9, 2, 15], [12, 7, 9]),
    "next to nothing": ([2, 1], [3, 1]),
    "long": ([7, 20], [110, 95]),
}
Batch = tuple[Tensor, Tensor, Tensor, Tensor]


def networks(design: Design, seed: int = 0) -> tuple[Encoder, Decoder]:
    """With all parameters off their starting values, and running statistics of something."""
    torch.manual_seed(seed)
    encoder, decoder = Encoder(design), Decoder(design)
    with torch.no_grad():
        for each in (*encoder.parameters(), *decoder.parameters()):
            each += 0.05 * torch.randn_like(each)
        through(encoder, decoder, batch([6, 4], [10, 10], seed=9))
    return encoder, decoder


def through(encoder: nn.Module, decoder: nn.Module, sequences: Batch) -> tuple[Tensor, Tensor]:
    """Code and positions."""
    positions, template, joints, frames = sequences
    if not isinstance(encoder, Encoder):  # plain ones see the masks
        code = encoder(positions, template, joints, frames)
        return code, decoder(code, template, joints, frames)
    source_tokens, target_tokens = RaggedTokens.between(joints.numpy(), joints.numpy(), frames.numpy())
    code = encoder(positions, template, source_tokens)
    return code, decoder(code, template, target_tokens)


def doubled(sequences: Batch) -> Batch:
    positions, template, joints, frames = sequences
    return positions.double(), template.double(), joints, frames


def gradients(encoder: nn.Module, decoder: nn.Module, sequences: Batch) -> list[Tensor]:
    """Code, positions, and gradients by all parameters of a sum that means nothing."""
    code, places = through(encoder, decoder, sequences)
    (places.square() + places).sum().backward()
    grads = [each.grad for module in (encoder, decoder) for each in module.parameters()]
    return [code, places, *grads]


# ---------------------------------------------------------------------------------------- what they are


@every_design
@pytest.mark.parametrize("training", [True, False])
@pytest.mark.parametrize("sizes", SIZES.values(), ids=list(SIZES))
def test_the_same_as_plain_networks(design, sizes, training):
    encoder, decoder = networks(design)
    lean = [net.double().train(training) for net in (encoder, decoder)]
    plain = [PlainEncoder(encoder).train(training), PlainDecoder(decoder).train(training)]
    sequences = doubled(batch(*sizes))
    actual, expected = gradients(*lean, sequences), gradients(*plain, sequences)
    for one, other in zip(actual, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-9, rtol=1e-9)
    for own, other in zip(lean, plain, strict=True):
        for one, two in zip(own.buffers(), other.buffers(), strict=True):
            torch.testing.assert_close(one, two, atol=1e-12, rtol=1e-12)


# ------------------------------------------------------------------------- padding and neighbours
sequences = st.lists(st.tuples(st.integers(1, 9), st.integers(1, 12)), min_size=1, max_size=4)
more = st.tuples(st.integers(0, 4), st.integers(0, 5))


def alone(sequences: Batch, row: int) -> Batch:
    """One of them without padding."""
    positions, template, joints, frames = (each[row] for each in sequences)
    positions = positions[frames][:, joints]
    ones = torch.ones(1, len(template[joints]), dtype=torch.bool), torch.ones(1, len(positions)).bool()
    return positions[None], template[joints][None], *ones


def padded(sequences: Batch, joints: int, frames: int) -> Batch:
    """With so much more of both, and with junk where there is nothing."""
    positions, template, real, lasting = sequences
    positions = nn.functional.pad(positions, (0, 0, 0, joints, 0, frames))
    template = nn.functional.pad(template, (0, 0, 0, joints))
    real, lasting = nn.functional.pad(real, (0, joints)), nn.functional.pad(lasting, (0, frames))
    positions[~(real.unsqueeze(1) & lasting.unsqueeze(2))] = torch.nan
    template[~real] = torch.nan
    return positions, template, real, lasting


@torch.no_grad()
def check_alone(nets: tuple[Encoder, Decoder], inputs: Batch) -> None:
    code, places = through(*nets, inputs)
    for row in range(len(code)):
        joints, frames = inputs[2][row], inputs[3][row]
        own_code, own_places = through(*nets, alone(inputs, row))
        torch.testing.assert_close(code[row, frames], own_code[0], atol=1e-5, rtol=1e-5)
        torch.testing.assert_close(places[row, frames][:, joints], own_places[0], atol=1e-5, rtol=1e-5)
        assert not code[row, ~frames].any()
        assert not places[row, ~frames].any()
        assert not places[row, :, ~joints].any()


@every_design
@examples(12)
@given(sizes=sequences, more=more, seed=st.integers(0, 99))
def test_answers_are_those_of_a_sequence_alone(design, sizes, more, seed):
    inputs = padded(batch([one for one, _ in sizes], [two for _, two in sizes], seed), *more)
    check_alone(tuple(net.eval() for net in networks(design)), inputs)


@pytest.mark.parametrize("design", by_token, ids=["affine", "free of parameters"])
@examples(12)
@given(sizes=sequences, more=more, seed=st.integers(0, 99))
def test_by_tokens_so_are_those_in_training(design, sizes, more, seed):
    inputs = padded(batch([one for one, _ in sizes], [two for _, two in sizes], seed), *more)
    check_alone(tuple(net.train() for net in networks(design)), inputs)


@every_design
def test_a_joint_left_out_anywhere_is_not_there(design):
    positions, template, joints, frames = batch([8, 8], [9, 9])
    joints[0, [0, 4]] = False
    joints[1, [3, 7]] = False
    check_alone(tuple(net.eval() for net in networks(design)), (positions, template, joints, frames))


@every_design
def test_long_motions_are_read_in_parts_to_the_same_effect(design, monkeypatch):
    nets = tuple(net.eval() for net in networks(design))
    inputs = batch([23, 9], [100, 81])
    expected = through(*nets, inputs)
    monkeypatch.setattr(blocks, "LONG", 1)
    monkeypatch.setattr(blocks, "SIDE", (5, 7))
    with torch.no_grad():
        actual = through(*nets, inputs)
    for one, other in zip(actual, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-5, rtol=1e-5)


# ------------------------------------------------------------------------------------- convolutions in time
@pytest.fixture(autouse=True)
def _by_frequency(monkeypatch: pytest.MonkeyPatch) -> None:
    torch.manual_seed(0)
    monkeypatch.setattr(temporal, "FEWEST", 1)
    monkeypatch.setattr(temporal, "NARROWEST", 1)


@pytest.mark.parametrize("kernel", [1, 3, 9, 15])
@pytest.mark.parametrize("frames", [1, 2, 7, 30, STRETCH, STRETCH + 1, 3 * STRETCH - 5])
def test_values_and_gradients_are_torchs(frames, kernel):
    layer = TemporalConvolution(3, 4, kernel).double()
    values = torch.randn(5, frames, 3, dtype=torch.float64, requires_grad=True)
    upstream = torch.randn(5, frames, 4, dtype=torch.float64)
    expected = functional.conv1d(values.transpose(1, 2), layer.weight, layer.bias, padding=kernel // 2)
    expected = expected.transpose(1, 2)
    actual = layer(values)
    torch.testing.assert_close(actual, expected, atol=1e-12, rtol=1e-12)
    variables = [values, layer.weight, layer.bias]
    own_gradients = torch.autograd.grad(actual, variables, upstream)
    reference_gradients = torch.autograd.grad(expected, variables, upstream)
    for one, other in zip(own_gradients, reference_gradients, strict=True):
        torch.testing.assert_close(one, other, atol=1e-11, rtol=1e-11)


def test_few_and_many_joints_are_treated_alike(monkeypatch):
    layer = TemporalConvolution(32, 32, 9)
    values = torch.randn(6, 30, 32)
    by_frequency = layer(values)
    monkeypatch.setattr(temporal, "FEWEST", 7)
    torch.testing.assert_close(by_frequency, layer(values), atol=1e-5, rtol=1e-5)


def test_an_even_number_of_taps_is_refused():
    with pytest.raises(ValueError, match="odd number of taps, not 8"):
        TemporalConvolution(3, 4, 8)
