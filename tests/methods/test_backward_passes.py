"""Hand-written backward passes against their plain forms: values and gradients."""

from __future__ import annotations

from itertools import pairwise

import plain_passes as plain
import pytest
import torch

from retarget_bench.methods.humot.network import attention, block
from retarget_bench.methods.humot.network.tokens import RaggedTokens
from retarget_bench.methods.pan.network import layers
from retarget_bench.methods.pan.network.layers import DropoutMask

WIDTH = 8
COUNTS = {"one size": [3, 3], "mixed": [2, 4, 1]}


def agree(ours, theirs, tensors, *rest):
    """Both forms give the same, and the same gradients of random sums."""
    found = []
    for form in (ours, theirs):
        leaves = [each.detach().clone().requires_grad_() for each in tensors]
        torch.manual_seed(1)
        given = form(leaves, *rest)
        given = given if isinstance(given, tuple) else (given,)
        draw = torch.Generator().manual_seed(2)
        total = sum((each * torch.randn(each.shape, generator=draw)).sum() for each in given)
        found.append((*given, *torch.autograd.grad(total, leaves)))
    for one, other in zip(*found, strict=True):
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

    agree(through(layers._mlp), through(plain.mlp), drawn((192, inputs), *shapes))


def ragged_of(kind: str, padded: bool) -> RaggedTokens:
    counts = COUNTS[kind]
    frames = None
    if padded:
        frames = torch.ones(len(counts), 5, dtype=torch.bool)
        frames[0, 3:] = False
    return RaggedTokens(counts, 5, frames, torch.device("cpu"))


def tokens_of(ragged: RaggedTokens) -> torch.Tensor:
    return drawn((ragged.total, 5, WIDTH))[0].index_fill(0, ragged.blank, 0.0)


@pytest.mark.parametrize("padded", [False, True])
@pytest.mark.parametrize("wanted", [False, True])
@pytest.mark.parametrize("kind", COUNTS)
def test_sums_over_tokens_of_humot(kind, wanted, padded):
    ragged = ragged_of(kind, padded)

    def through(form):
        return lambda tensors: tuple(each for each in form(*tensors, ragged, wanted) if each is not None)

    tensors = [tokens_of(ragged), *drawn((WIDTH,), (WIDTH,))]
    agree(through(attention._summed), through(plain.summed), tensors)


@pytest.mark.parametrize("kind", COUNTS)
def test_mixing_of_channels_of_humot(kind):
    ragged = ragged_of(kind, False)
    rows = len(ragged.counts)
    tensors = [tokens_of(ragged), tokens_of(ragged), *drawn((rows, WIDTH, WIDTH), (rows, WIDTH))]

    def through(form):
        def call(given):
            made = form(*given, ragged)
            return made.index_fill(0, ragged.blank, 0.0)  # nothing reads blank tracks

        return call

    agree(through(attention._mixed), through(plain.mixed), tensors)


@pytest.mark.parametrize("kind", COUNTS)
def test_the_feed_forward_layers_of_humot(kind):
    ragged = ragged_of(kind, False)
    shapes = ((WIDTH,), (WIDTH,), (24, WIDTH), (24,), (WIDTH, 24), (WIDTH,))

    def through(form):
        return lambda tensors: form(tensors[0], ragged.pieces, *tensors[1:])

    agree(through(block._feed_forward), through(plain.fed), [tokens_of(ragged), *drawn(*shapes)])
