"""The hand-written backward pass of PAN's MLP against its plain form: values and gradients."""

from __future__ import annotations

from itertools import pairwise

import pytest
import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.methods.pan.network import layers
from retarget_bench.methods.pan.network.layers import DropoutMask


def plain(values: Tensor, activation: str, mask: DropoutMask | None, *weights: Tensor) -> Tensor:
    """What the function gives, with the gradient left to autograd."""
    *inner, last, bias = weights
    for weight, shift in zip(inner[::2], inner[1::2], strict=True):
        values = getattr(functional, activation)(functional.linear(values, weight, shift))
    if mask is not None:
        values = values * mask.factors(mask.bytes(*values.shape), values)
    return functional.linear(values, last, bias)


def agree(own, reference, tensors, *rest):
    """Both forms give the same, and the same gradients of random sums."""
    results = []
    for form in (own, reference):
        leaves = [each.detach().clone().requires_grad_() for each in tensors]
        torch.manual_seed(1)
        outputs = form(leaves, *rest)
        outputs = outputs if isinstance(outputs, tuple) else (outputs,)
        draw = torch.Generator().manual_seed(2)
        total = sum((each * torch.randn(each.shape, generator=draw)).sum() for each in outputs)
        results.append((*outputs, *torch.autograd.grad(total, leaves)))
    for one, other in zip(*results, strict=True):
        torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-4)


def drawn(*shapes):
    draw = torch.Generator().manual_seed(0)
    return [torch.randn(shape, generator=draw) for shape in shapes]


@pytest.mark.parametrize("share", [None, 0.2])
@pytest.mark.parametrize("activation", ["relu", "gelu"])
@pytest.mark.parametrize("inputs", [4, 32], ids=["few inputs", "many inputs"])
@pytest.mark.parametrize("hidden", [1, 2])
def test_the_mlp_of_pan(activation, inputs, hidden, share, monkeypatch):
    monkeypatch.setattr(layers, "CACHED", 1 << 11)  # several pieces
    sizes = [inputs, *[48] * hidden, 8]
    shapes = [shape for i, o in pairwise(sizes) for shape in ((o, i), (o,))]

    def through(form):
        def call(tensors):
            mask = None if share is None else DropoutMask(share, torch.device("cpu"))
            return form(tensors[0], activation, mask, *tensors[1:])

        return call

    agree(through(layers._mlp), through(plain), drawn((192, inputs), *shapes))
