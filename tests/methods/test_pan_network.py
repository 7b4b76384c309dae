"""PAN's networks: lean and plain ones are the same; who sees whom, how many parameters, dropout."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from pan_reference import (
    JOINTS,
    S23,
    S28,
    THREE,
    PlainDecoder,
    PlainEncoder,
    PlainSkeletonEncoder,
    bones,
    close,
    codes,
    convolved,
    motion,
    reading,
)
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.pan.network import Decoder, Discriminator, Encoder, SkeletonEncoder, layers
from retarget_bench.methods.pan.network.layers import LEVELS, DropoutMask
from retarget_bench.methods.pan.settings import VARIANTS, Design
from retarget_bench.training.layers.skeletal.layout import Layout

PAPER, RELEASED = VARIANTS["paper"].design, VARIANTS["released"].design
LAYOUTS = {"S23": S23, "S28": S28, "three": THREE}
DESIGNS = {
    "paper": PAPER,
    "released": replace(RELEASED, dropout=0.0),
    "released, the paper's masks": replace(RELEASED, dropout=0.0, conv_mask="paper", bone_mask="paper"),
    "released, mutual": replace(RELEASED, dropout=0.0, mutual=True, padded=False),
    "own": VARIANTS["own"].design,
}
BUILDS = [(layout, design) for design in DESIGNS.values() for layout in LAYOUTS.values()]
BUILDS.append((JOINTS, replace(VARIANTS["released_three"].design, layers=2)))
BUILT = [f"{layout}-{design}" for design in DESIGNS for layout in LAYOUTS] + ["joints-released"]
presets = pytest.mark.parametrize("preset", [PAPER, RELEASED], ids=["paper", "released"])


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def count(*modules: nn.Module) -> int:
    return sum(each.numel() for module in modules for each in module.parameters())


# ------------------------------------------------------------------------------------- lean and plain
KINDS = {
    "encoder": (Encoder, PlainEncoder, motion),
    "skeleton": (SkeletonEncoder, PlainSkeletonEncoder, bones),
    "decoder": (Decoder, PlainDecoder, codes),
}


@pytest.mark.parametrize(("layout", "design"), BUILDS, ids=BUILT)
@pytest.mark.parametrize("kind", KINDS)
def test_lean_and_plain_networks_agree_in_values_and_gradients(kind, layout, design):
    lean_class, plain_class, make = KINDS[kind]
    lean = lean_class(layout, design)
    plain = plain_class(lean, layout, design)
    assert {id(each) for each in plain.parameters()} == {id(own) for own, _, _ in plain.pairs}
    assert {id(each) for each in lean.parameters()} == {id(own) for _, own, _ in plain.pairs}
    values = make(layout)
    own_values, plain_values = values.clone().requires_grad_(), values.clone().requires_grad_()
    actual, expected = lean(own_values), plain(plain_values)
    close(actual, expected)
    weight = torch.randn_like(actual)
    (actual * weight).sum().backward()
    (expected * weight).sum().backward()
    compared = slice(0, -1) if kind == "skeleton" else slice(None)
    close(own_values.grad[:, compared], plain_values.grad[:, compared])
    for dense, own, write in plain.pairs:
        close(write(own.grad), dense.grad)


def test_a_long_motion_of_many_pieces_is_what_the_plain_network_says():
    design = DESIGNS["released"]
    lean = Encoder(S23, design)
    inputs = motion(S23, rows=3, frames=300)
    with torch.no_grad():
        close(lean(inputs), PlainEncoder(lean, S23, design)(inputs))


def test_equation_9_squashes_scores():
    squashed = Discriminator(12, PAPER)
    flat = Discriminator(12, replace(PAPER, squashed=False))
    flat.load_state_dict(squashed.state_dict())
    inputs = torch.randn(2, 20, 12)
    scores = flat(inputs).detach().double().numpy()
    assert scores.shape == (2, 20 - 15 + 1)
    np.testing.assert_allclose(squashed(inputs).detach().numpy(), 1 / (1 + np.exp(-scores)), atol=1e-6)


# ------------------------------------------------------------------------------------------- counts
def test_the_plain_networks_have_the_parameters_of_record():
    counts = {}
    for name, layout in (("S23", S23), ("S28", S28)):
        lean = [kind(layout, RELEASED) for kind in (Encoder, Decoder, SkeletonEncoder)]
        plain = [
            kind(each, layout, RELEASED)
            for kind, each in zip((PlainEncoder, PlainDecoder, PlainSkeletonEncoder), lean, strict=True)
        ]
        counts[name] = (count(*plain[:2]), count(plain[2]))
    assert counts == {"S23": (2_250_876, 87_552), "S28": (2_366_096, 90_432)}
    assert sum(map(sum, counts.values())) == 4_794_956


def stored(layout: Layout, design: Design) -> int:
    """What the mask of the released networks leaves, and bones of the root: by counting who reads whom."""
    width, taps, inner = design.width, design.kernel, design.feedforward
    parts = len(layout.parts)
    embedding = 4 * 512 + 512 + 512 * width + width
    layer = 4 * (width * width + width) + 2 * width * inner + inner + width + 4 * width
    within = parts * (width * width * taps + width)
    raw = sum(4 * len(part) * width * taps + width for part in convolved(layout, design))
    outer = sum(4 * (len(own) * width * taps + 1) for own in reading(layout, design))
    first = sum(3 * (len(part) + 1) * 32 + 32 for part in layout.parts)
    skeleton = first + parts * 2 * (32 * 32 + 32)
    return embedding + parts * width + 2 * layer + 3 * within + raw + outer + skeleton


def test_what_is_stored_is_what_the_mask_leaves():
    """The record counts the released masks, and weights on a bone that is zero, the root's, which are
    left out here, since they would never learn: of the first part in the released masks, else of all parts.
    """
    for mask, record, parts in (("released", 981_932, 1), ("paper", 966_572, 6)):
        design = replace(RELEASED, conv_mask=mask, bone_mask=mask)
        stored_weights = sum(
            count(*(kind(layout, design) for kind in (Encoder, Decoder, SkeletonEncoder)))
            for layout in (S23, S28)
        )
        assert sum(stored(layout, design) for layout in (S23, S28)) == record
        assert stored_weights == record - 2 * 3 * 32 * parts


def test_the_discriminators_have_the_parameters_of_record():
    assert [count(Discriminator(3 * (each.edges + 1), RELEASED)) for each in (S23, S28)] == [
        298_241,
        355_841,
    ]


# ------------------------------------------------------------------------------------------- dropout
def test_dropout_leaves_out_its_share_and_keeps_the_mean():
    mask = DropoutMask(0.2, torch.device("cpu"))
    values = torch.ones(400, 1000)
    factors = mask.factors(mask.bytes(400, 1000), values)
    share = round(0.2 * LEVELS) / LEVELS
    assert set(factors.unique().tolist()) == {0.0, factors.max().item()}
    assert factors.max().item() == pytest.approx(1 / (1 - share))
    spread = np.sqrt(share * (1 - share) / factors.numel())
    assert abs((factors == 0).double().mean().item() - share) < 5 * spread
    for axis in (0, 1):  # neighbours do not know of each other
        left, right = factors.narrow(axis, 0, 399), factors.narrow(axis, 1, 399)
        both = ((left == 0) & (right == 0)).double().mean().item()
        assert abs(both - share**2) < 5 * np.sqrt(share**2 / left.numel())


@presets
def test_dropout_is_of_training_and_of_the_seed(preset):
    encoder = Encoder(S23, replace(preset, dropout=0.2))
    inputs = motion(S23)

    def passed(seed: int) -> tuple[Tensor, Tensor]:
        torch.manual_seed(seed)
        encoder.zero_grad()
        code = encoder(inputs)
        code.square().sum().backward()
        return code.detach(), encoder.embedding[0].weight.grad.clone()

    for one, other in zip(passed(1), passed(1), strict=True):
        assert torch.equal(one, other)
    assert not torch.equal(passed(1)[0], passed(2)[0])
    encoder.eval()
    assert torch.equal(passed(1)[0], passed(2)[0])


# ------------------------------------------------------------------------------------- gradients of the MLP
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
