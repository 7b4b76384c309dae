"""Convolutions in time by way of frequencies are torch's own."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from retarget_bench.methods.humot.network import layers as temporal
from retarget_bench.methods.humot.network.layers import STRETCH, TemporalConvolution


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
