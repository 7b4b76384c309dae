"""PAN's networks: lean and plain ones are the same; who sees whom, how many parameters, dropout."""

from __future__ import annotations

from dataclasses import replace

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

from retarget_bench.methods.pan.network import Decoder, Discriminator, Encoder, SkeletonEncoder
from retarget_bench.methods.pan.network.layers import LEVELS, DropoutMask
from retarget_bench.methods.pan.settings import OWN, PAPER, RELEASED, RELEASED_THREE, Design
from retarget_bench.training.layers.skeletal.layout import Layout

LAYOUTS = {"S23": S23, "S28": S28, "three": THREE}
DESIGNS = {
    "paper": PAPER,
    "released": replace(RELEASED, dropout=0.0),
    "released, the paper's masks": replace(RELEASED, dropout=0.0, conv_mask="paper", bone_mask="paper"),
    "released, mutual": replace(RELEASED, dropout=0.0, mutual=True, padded=False),
    "own": OWN,
}
BUILDS = [(layout, design) for design in DESIGNS.values() for layout in LAYOUTS.values()]
BUILDS.append((JOINTS, replace(RELEASED_THREE, layers=2)))
BUILT = [f"{layout}-{design}" for design in DESIGNS for layout in LAYOUTS] + ["joints-released"]
ABLATIONS: dict[str, dict[str, bool]] = {
    "full": {},
    "no parts": {"by_part": False},
    "no attention": {"attention": False},
    "neither": {"by_part": False, "attention": False},
}
pairs = pytest.mark.parametrize("design", DESIGNS.values(), ids=list(DESIGNS))
structures = pytest.mark.parametrize("layout", LAYOUTS.values(), ids=list(LAYOUTS))
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
    lean_class, plain_class, made = KINDS[kind]
    lean = lean_class(layout, design)
    plain = plain_class(lean, layout, design)
    assert {id(each) for each in plain.parameters()} == {id(own) for own, _, _ in plain.pairs}
    assert {id(each) for each in lean.parameters()} == {id(own) for _, own, _ in plain.pairs}
    values = made(layout)
    ours, theirs = values.clone().requires_grad_(), values.clone().requires_grad_()
    found, expected = lean(ours), plain(theirs)
    close(found, expected)
    weight = torch.randn_like(found)
    (found * weight).sum().backward()
    (expected * weight).sum().backward()
    seen = slice(0, -1) if kind == "skeleton" else slice(None)
    close(ours.grad[:, seen], theirs.grad[:, seen])
    for dense, own, write in plain.pairs:
        close(write(own.grad), dense.grad)


def test_a_long_motion_of_many_pieces_is_what_the_plain_network_says():
    design = DESIGNS["released"]
    lean = Encoder(S23, design)
    seen = motion(S23, rows=3, frames=300)
    with torch.no_grad():
        close(lean(seen), PlainEncoder(lean, S23, design)(seen))


# ------------------------------------------------------------------------------------------- counts
def test_the_plain_networks_have_the_parameters_of_record():
    found = {}
    for name, layout in (("S23", S23), ("S28", S28)):
        lean = [kind(layout, RELEASED) for kind in (Encoder, Decoder, SkeletonEncoder)]
        plain = [
            kind(each, layout, RELEASED)
            for kind, each in zip((PlainEncoder, PlainDecoder, PlainSkeletonEncoder), lean, strict=True)
        ]
        found[name] = (count(*plain[:2]), count(plain[2]))
    assert found == {"S23": (2_250_876, 87_552), "S28": (2_366_096, 90_432)}
    assert sum(map(sum, found.values())) == 4_794_956


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
        kept = sum(
            count(*(kind(layout, design) for kind in (Encoder, Decoder, SkeletonEncoder)))
            for layout in (S23, S28)
        )
        assert sum(stored(layout, design) for layout in (S23, S28)) == record
        assert kept == record - 2 * 3 * 32 * parts


def test_the_discriminators_have_the_parameters_of_record():
    assert [count(Discriminator(3 * (each.edges + 1), RELEASED)) for each in (S23, S28)] == [
        298_241,
        355_841,
    ]


# --------------------------------------------------------------------------------- who learns, who sees
@presets
@structures
@pytest.mark.parametrize("ablation", ABLATIONS)
def test_gradients_reach_every_parameter(layout, preset, ablation):
    design = replace(preset, leak=0.2, padded=False, **ABLATIONS[ablation])
    nets = [Encoder(layout, design), SkeletonEncoder(layout, design), Decoder(layout, design)]
    encoder, skeleton, decoder = nets
    answer = decoder(encoder(motion(layout)) + skeleton(bones(layout)).unsqueeze(1))
    assert answer.shape == motion(layout).shape
    (answer * torch.randn_like(answer)).sum().backward()
    for net in nets:
        for name, each in net.named_parameters():
            assert each.grad is not None, name
            if name.startswith("embedding"):  # some of the hidden numbers may rest at all that is seen here
                assert each.grad.any(), name
                continue
            untouched = (each.grad == 0).flatten(1).all(1) if each.ndim > 1 else each.grad == 0
            if name.endswith("qkv.bias"):  # a bias of keys moves all scores of a query alike
                untouched = untouched[torch.arange(3 * design.width) // design.width != 1]
            assert not untouched.any(), name


@pairs
@structures
def test_nobody_outside_a_part_changes_its_code(layout, design):
    """A part hears its own edges, the root's, and what shares an edge of it; nobody else."""
    encoder = Encoder(layout, replace(design, layers=1, mutual=False, leak=0.2))
    seen = motion(layout, rows=1, frames=16)
    before = encoder(seen).detach()
    parts = [
        set(own) | set(also) for own, also in zip(layout.parts, convolved(layout, design), strict=True)
    ]
    for edge in range(layout.edges + 1):
        moved = seen.clone()
        moved[:, :, edge] += 1.0
        changed = (encoder(moved) != before).flatten(0, 1).any(0).any(1).tolist()
        for part, own in enumerate(parts):
            assert changed[part] == (edge in own or edge == layout.edges), (edge, part)


def test_the_decoder_of_parts_writes_a_slot_from_its_parts_alone():
    decoder = Decoder(S28, OWN)
    code = codes(S28, rows=1)
    before = decoder(code).detach()
    for part in range(6):
        moved = code.clone()
        moved[:, :, part] += 1.0
        changed = (decoder(moved) != before)[0].any(0).any(1)
        assert changed.nonzero()[:, 0].tolist() == [*S28.parts[part], 27]


def test_a_slot_of_no_part_is_written_from_all():
    decoder = Decoder(THREE, OWN)
    code = codes(THREE, rows=1)
    for part in range(3):
        moved = code.clone()
        moved[:, :, part] += 1.0
        assert (decoder(moved) != decoder(code))[0, :, 7:].any(0).all()


@presets
def test_attention_is_frame_by_frame_and_adds_up(preset):
    encoder = Encoder(S28, preset).eval()
    seen = motion(S28, rows=2, frames=20)
    weights = encoder.attention(seen)
    assert weights.shape == (2, 20, 6, 28)
    torch.testing.assert_close(encoder.attention(seen[:, 7:8]), weights[:, 7:8], rtol=0.0, atol=1e-6)
    for part, own in enumerate(S28.parts):
        outside = torch.ones(28, dtype=torch.bool)
        outside[[*own, 27]] = False
        assert (weights[:, :, part, outside] == 0).all()
        assert (weights[:, :, part, ~outside] > 0).all()
    total = weights.sum(-1)
    assert ((total > 0) & (total < 1)).all()


def test_without_attention_there_are_no_weights():
    with pytest.raises(ValueError, match="without attention"):
        Encoder(S23, replace(PAPER, attention=False)).attention(motion(S23))


@presets
def test_rows_do_not_meet(preset):
    encoder, decoder = Encoder(S23, preset).eval(), Decoder(S23, preset)
    seen = motion(S23, rows=5)
    order = torch.tensor([3, 0, 4, 1, 2])
    close(encoder(seen[order]), encoder(seen)[order])
    close(encoder(seen[2:3]), encoder(seen)[2:3])
    code = encoder(seen)
    close(decoder(code[order]), decoder(code)[order])


# ------------------------------------------------------------------------------------------- dropout
def test_dropout_leaves_out_its_share_and_keeps_the_mean():
    mask = DropoutMask(0.2, torch.device("cpu"))
    values = torch.ones(400, 1000)
    kept = mask.factors(mask.bytes(400, 1000), values)
    share = round(0.2 * LEVELS) / LEVELS
    assert set(kept.unique().tolist()) == {0.0, kept.max().item()}
    assert kept.max().item() == pytest.approx(1 / (1 - share))
    spread = np.sqrt(share * (1 - share) / kept.numel())
    assert abs((kept == 0).double().mean().item() - share) < 5 * spread
    for axis in (0, 1):  # neighbours do not know of each other
        left, right = kept.narrow(axis, 0, 399), kept.narrow(axis, 1, 399)
        both = ((left == 0) & (right == 0)).double().mean().item()
        assert abs(both - share**2) < 5 * np.sqrt(share**2 / left.numel())


@presets
def test_dropout_is_of_training_and_of_the_seed(preset):
    encoder = Encoder(S23, replace(preset, dropout=0.2))
    seen = motion(S23)

    def passed(seed: int) -> tuple[Tensor, Tensor]:
        torch.manual_seed(seed)
        encoder.zero_grad()
        code = encoder(seen)
        code.square().sum().backward()
        return code.detach(), encoder.embedding[0].weight.grad.clone()

    for one, other in zip(passed(1), passed(1), strict=True):
        assert torch.equal(one, other)
    assert not torch.equal(passed(1)[0], passed(2)[0])
    encoder.eval()
    assert torch.equal(passed(1)[0], passed(2)[0])


def test_gradients_go_through_the_same_dropout():
    """A step along the gradient changes the loss as the gradient says, with the mask held."""
    encoder = Encoder(S23, RELEASED).double()
    seen = motion(S23, frames=16).double()
    way = [torch.randn_like(each) for each in encoder.parameters()]

    def loss(step: float) -> Tensor:
        torch.manual_seed(5)
        shifted = {
            name: each + step * along
            for (name, each), along in zip(encoder.named_parameters(), way, strict=True)
        }
        return torch.func.functional_call(encoder, shifted, (seen,)).square().sum()

    slope = torch.autograd.grad(loss(0.0), list(encoder.parameters()))
    expected = sum((one * along).sum() for one, along in zip(slope, way, strict=True))
    with torch.no_grad():
        found = (loss(1e-8) - loss(-1e-8)) / 2e-8  # so small that hardly a rectifier turns
    torch.testing.assert_close(found, expected, rtol=1e-5, atol=0.0)
