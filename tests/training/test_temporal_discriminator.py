"""NKN's discriminator: its size, and that padding is no part of what it sees."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch.nn import functional

from retarget_bench.training.layers.temporal_discriminator import FrameNorm, TemporalDiscriminator

ROWS = 5


@pytest.fixture
def network() -> TemporalDiscriminator:
    torch.manual_seed(0)
    return TemporalDiscriminator()


def shown(frames: int, seed: int = 1) -> tuple[torch.Tensor, torch.Tensor]:
    numbers = torch.Generator().manual_seed(seed)
    return torch.randn(ROWS, frames, 70, generator=numbers), torch.randn(ROWS, 63, generator=numbers)


def test_has_the_parameters_of_the_published_code(network):
    assert sum(each.numel() for each in network.parameters()) == 280_413


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


def test_a_single_frame_is_left_with_the_bias():
    norm = FrameNorm(2)
    torch.nn.init.constant_(norm.norm.bias, 0.5)
    real = torch.tensor([[True, False, False]])
    normed = norm(torch.randn(1, 2, 3), real)
    torch.testing.assert_close(normed, torch.tensor([[[0.5, 0, 0], [0.5, 0, 0]]]))


def test_drops_its_input_only_while_it_learns(network):
    differences, offsets = shown(59)
    torch.testing.assert_close(network(differences, offsets), network(differences, offsets))
    assert not torch.allclose(network(differences, offsets, learns=True), network(differences, offsets))
