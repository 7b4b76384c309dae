"""Masks, statistics and adversarial training that learned methods share."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import nn
from torch.nn import functional

from retarget_bench.training.layers import exported
from retarget_bench.training.layers.adversarial import (
    NknUpdateRule,
    ReplayBuffer,
    cross_entropy,
    least_squares,
)
from retarget_bench.training.layers.masks import masked_mean
from retarget_bench.training.layers.normaliser import Normaliser, statistics
from retarget_bench.training.layers.temporal_discriminator import FrameNorm, TemporalDiscriminator

# ------------------------------------------------------------------------------------------- masks


def test_a_masked_mean_is_that_of_what_is_real_whatever_stands_elsewhere():
    values = torch.tensor([[1.0, 3.0, torch.nan], [5.0, torch.inf, torch.nan]], requires_grad=True)
    real = torch.tensor([[True, True, False], [True, False, False]])
    mean = masked_mean(values, real, (0, 1))
    assert mean.item() == 3.0
    assert masked_mean(values, real, (1,)).tolist() == [2.0, 5.0]
    mean.backward()
    torch.testing.assert_close(values.grad, real / 3.0)
    assert masked_mean(values, torch.zeros_like(real), (0, 1)).item() == 0.0


# -------------------------------------------------------------------------------------- statistics
def test_statistics_are_those_of_the_samples_and_constants_are_left_alone():
    values = np.random.default_rng(0).normal(3.0, 2.0, (50, 3)).astype(np.float32)
    values[:, 1] = 1e6 + 0.1
    values[:, 2] *= 1e-3
    mean, deviation = statistics(values, constant=1e-9, least=0.01)
    np.testing.assert_allclose(mean, values.astype(np.float64).mean(0))
    assert deviation.tolist() == [pytest.approx(values[:, 0].astype(np.float64).std()), 1.0, 0.01]


def test_a_normaliser_is_the_identity_until_it_is_fitted_and_can_be_inverted():
    normaliser, values = Normaliser(places=6, moves=2), torch.randn(40, 3, 2)
    assert torch.equal(normaliser.normalise("places", values.flatten(1)), values.flatten(1))
    normaliser.fit("places", values.numpy() * 5.0 + 1.0)
    normalised = normaliser.normalise("places", values.flatten(1) * 5.0 + 1.0)
    torch.testing.assert_close(normalised.mean(0), torch.zeros(6), atol=1e-5, rtol=0)
    torch.testing.assert_close(normalised.std(0, unbiased=False), torch.ones(6))
    torch.testing.assert_close(normaliser.restore("places", normalised), values.flatten(1) * 5.0 + 1.0)
    assert set(normaliser.state_dict()) == {
        f"{kind}_{name}" for kind in ("places", "moves") for name in ("mean", "deviation")
    }


def test_exported_tensors_are_copies_and_are_told_by_prefix():
    module = nn.ModuleDict({"one": nn.Linear(2, 1), "one_more": nn.Linear(2, 1)})
    tensors = exported(module)
    nn.init.zeros_(module["one"].weight)
    assert tensors["one.weight"].any()


# ------------------------------------------------------------------------------ adversarial training
@pytest.mark.parametrize("real", [True, False])
def test_losses_of_logits_and_scores(real):
    logits = torch.randn(7)
    expected = torch.full((7,), float(real))
    torch.testing.assert_close(
        cross_entropy(logits, real),
        nn.functional.binary_cross_entropy_with_logits(logits, expected, reduction="none"),
    )
    torch.testing.assert_close(least_squares(logits, real), (logits - expected).square().mean())


def test_a_discriminator_learns_while_it_takes_enough_answers_for_real():
    rule = NknUpdateRule(discriminators=3)
    rule.running.copy_(torch.tensor([0.5, 0.2, 0.5]))
    learns = rule.update([(0, torch.zeros(2)), (1, torch.full((4,), 100.0)), (0, torch.full((2,), 100.0))])
    assert learns == [True, False, False], "the last has seen no answer"
    assert rule.running.tolist() == pytest.approx([0.99 * 0.5 + 0.01 * 0.75, 0.99 * 0.2 + 0.01, 0.5])


def test_a_replay_buffer_mixes_older_answers_with_new_ones():
    torch.manual_seed(0)
    buffer = ReplayBuffer(50, 4, 3)
    first = torch.arange(50.0)[:, None, None].expand(-1, 4, 3)
    assert torch.equal(buffer(first), first), "while it fills, all are seen as they come"
    mixed = buffer(first + 100.0)
    older = mixed[:, 0, 0] < 100.0
    assert 10 < int(older.sum()) < 40
    values = torch.cat([mixed[:, 0, 0], buffer.kept[:, 0, 0]])
    assert len(values.unique()) == 100, "nothing is lost or seen twice"
    again = ReplayBuffer(50, 4, 3)
    again.load_state_dict(buffer.state_dict())
    torch.manual_seed(1)
    one = buffer(first)
    torch.manual_seed(1)
    assert torch.equal(one, again(first))


# ------------------------------------------------------------------------------------ discriminator of time
ROWS = 5


@pytest.fixture
def network() -> TemporalDiscriminator:
    torch.manual_seed(0)
    return TemporalDiscriminator()


def shown(frames: int, seed: int = 1) -> tuple[torch.Tensor, torch.Tensor]:
    numbers = torch.Generator().manual_seed(seed)
    return torch.randn(ROWS, frames, 70, generator=numbers), torch.randn(ROWS, 63, generator=numbers)


def test_is_what_torch_makes_of_the_layers_one_by_one(network):
    """60 frames of motion: 59 differences, then 30, 15, 8, 4, 1."""
    differences, offsets = shown(59)
    hidden, sizes = differences.transpose(1, 2), []
    for number, layer in enumerate(network.layers):
        if number > 1:
            hidden = torch.cat([hidden, offsets[:, :, None].expand(-1, -1, hidden.shape[-1])], 1)
        # TensorFlow's "same" with stride 2: one zero before, behind as many as an even length needs
        hidden = layer(functional.pad(hidden, (1, 1 + hidden.shape[-1] % 2)))
        if number:
            norm = network.norms[number - 1].norm
            hidden = functional.batch_norm(hidden, None, None, norm.weight, norm.bias, training=True)
        hidden = functional.leaky_relu(hidden, 0.2)
        sizes.append(hidden.shape[-1])
    scores = network.last(torch.cat([hidden, offsets[:, :, None].expand(-1, -1, 4)], 1))
    assert sizes == [30, 15, 8, 4]
    assert scores.shape == (ROWS, 1, 1)
    torch.testing.assert_close(network(differences, offsets), scores[:, 0, 0])


@pytest.mark.parametrize("frames", [4, 5, 9, 14, 29, 59, 119])
def test_what_lies_behind_a_row_changes_nothing(network, frames):
    differences, offsets = shown(frames)
    lengths = torch.tensor([frames, max(frames // 2, 1), frames, 1, max(frames - 1, 1)])
    plain = network(differences, offsets, lengths)
    assert plain.isfinite().all()
    rubbish = torch.cat([differences, torch.full((ROWS, 37, 70), 1e6)], 1)
    for row, length in enumerate(lengths):
        rubbish[row, length:] = torch.nan
    torch.testing.assert_close(network(rubbish, offsets, lengths), plain)


def test_statistics_are_those_of_real_frames():
    norm = FrameNorm(3)
    numbers = np.random.default_rng(2)
    hidden = numbers.normal(3.0, 2.0, (2, 3, 6)).astype(np.float32)
    real = np.array([[1, 1, 1, 1, 0, 0], [1, 1, 1, 0, 0, 0]], dtype=bool)
    normed = norm(torch.from_numpy(hidden), torch.from_numpy(real)).detach().numpy()
    flat = hidden.transpose(0, 2, 1)[real]
    expected = (flat - flat.mean(0)) / np.sqrt(flat.var(0) + 1e-5)
    np.testing.assert_allclose(normed.transpose(0, 2, 1)[real], expected, atol=1e-5)
    assert not normed.transpose(0, 2, 1)[~real].any()


def test_drops_its_input_only_while_it_learns(network):
    differences, offsets = shown(59)
    torch.testing.assert_close(network(differences, offsets), network(differences, offsets))
    assert not torch.allclose(network(differences, offsets, learns=True), network(differences, offsets))
