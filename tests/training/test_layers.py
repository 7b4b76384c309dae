"""Masks, statistics and adversarial training that learned methods share."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import nn

from retarget_bench.training.layers import exported
from retarget_bench.training.layers.adversarial import (
    NknUpdateRule,
    ReplayBuffer,
    cross_entropy,
    least_squares,
)
from retarget_bench.training.layers.masks import frame_mask, masked_mean
from retarget_bench.training.layers.normaliser import Normaliser, statistics


# ------------------------------------------------------------------------------------------- masks
def test_a_mask_has_the_first_frames_of_every_row():
    assert frame_mask(torch.tensor([0, 2, 3]), 3).tolist() == [[0, 0, 0], [1, 1, 0], [1, 1, 1]]


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
