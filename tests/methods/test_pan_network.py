"""PAN's networks: what their equations say, and that lean and plain networks are the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from pan_reference import (
    S23,
    S28,
    THREE,
    PlainDecoder,
    PlainEncoder,
    PlainSkeletonEncoder,
    convolved,
    reading,
)
from torch import Tensor, nn

from retarget_bench.methods.pan.design import PAPER, RELEASED, Design
from retarget_bench.methods.pan.layout import Layout
from retarget_bench.methods.pan.network import Decoder, Discriminator, Encoder, SkeletonEncoder
from retarget_bench.methods.pan.network.attention import Attention
from retarget_bench.methods.pan.network.dropout import LEVELS, Noise
from retarget_bench.methods.pan.network.plan import Group
from retarget_bench.methods.pan.network.wide import wide

LAYOUTS = {"S23": S23, "S28": S28, "three": THREE}
DESIGNS = {
    "paper": PAPER,
    "released": replace(RELEASED, dropout=0.0),
    "released, its masks": replace(RELEASED, dropout=0.0, conv_mask="released"),
    "released, mutual": replace(RELEASED, dropout=0.0, mutual=True),
}
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


def motion(layout: Layout, rows: int = 2, frames: int = 24) -> Tensor:
    return torch.randn(rows, frames, layout.slots + 1, 4)


def bones(layout: Layout, rows: int = 2) -> Tensor:
    return torch.cat([torch.randn(rows, layout.slots, 3), torch.zeros(rows, 1, 3)], 1)


def codes(layout: Layout, rows: int = 2, frames: int = 6, width: int = 32) -> Tensor:
    return torch.randn(rows, frames, len(layout.parts), width)


def count(*modules: nn.Module) -> int:
    return sum(each.numel() for module in modules for each in module.parameters())


def close(found: Tensor, expected: Tensor) -> None:
    """To 1e-5 of the largest number."""
    scale = max(1.0, float(expected.detach().abs().max()))
    torch.testing.assert_close(found, expected, rtol=0.0, atol=1e-5 * scale)


# ------------------------------------------------------------------------------------- lean and plain
KINDS = {
    "encoder": (Encoder, PlainEncoder, motion),
    "skeleton": (SkeletonEncoder, PlainSkeletonEncoder, bones),
    "decoder": (Decoder, PlainDecoder, codes),
}


@pairs
@structures
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
    """The record counts the released masks, and weights on the bone of the root's slot.

    That bone is zero, so that these weights would never learn: they are left out. With the masks of the
    paper, other slots are read and written.
    """
    for mask, record in (("released", 981_932), ("paper", 966_572)):
        design = replace(RELEASED, conv_mask=mask)
        kept = sum(
            count(*(kind(layout, design) for kind in (Encoder, Decoder, SkeletonEncoder)))
            for layout in (S23, S28)
        )
        of_root = sum(3 * 32 * len(layout.parts) for layout in (S23, S28))
        assert sum(stored(layout, design) for layout in (S23, S28)) == record
        assert kept == record - of_root


def test_the_discriminators_have_the_parameters_of_record():
    assert [count(Discriminator(3 * (each.slots + 1), RELEASED)) for each in (S23, S28)] == [
        298_241,
        355_841,
    ]


# ---------------------------------------------------------------------------------------- equations
def arrays(module: nn.Module) -> list[np.ndarray]:
    return [each.detach().double().numpy() for each in module.parameters()]


def relu(values: np.ndarray) -> np.ndarray:
    return np.maximum(values, 0.0)


def embedded(encoder: Encoder, seen: np.ndarray) -> np.ndarray:
    w0, b0, w1, b1, w2, b2 = arrays(encoder.embedding)
    return relu(relu(seen @ w0.T + b0) @ w1.T + b1) @ w2.T + b2


def test_equation_1_embeds_a_slot_by_three_layers_256_wide():
    encoder = Encoder(S23, PAPER)
    seen = torch.randn(7, 4)
    found = wide(seen.T, encoder.embedding, "relu").T
    assert [len(each) for each in arrays(encoder.embedding)[::2]] == [256, 256, 32]
    close(found, torch.from_numpy(embedded(encoder, seen.double().numpy())).float())


def code_of(j: int, width: int = 32) -> np.ndarray:
    found = np.zeros(width)
    for i in range(width // 2):
        found[2 * i] = np.sin(j / 10_000 ** (2 * i / width))
        found[2 * i + 1] = np.cos(j / 10_000 ** (2 * i / width))
    return found


def test_equation_2_codes_the_index_of_a_slot():
    encoder = Encoder(S28, PAPER)
    expected = np.stack([code_of(slot) for slot in encoder.rows.slots])
    np.testing.assert_allclose(encoder.code.numpy(), expected, atol=1e-6)
    assert sorted(encoder.rows.slots) == list(range(28))


def test_equation_3_adds_embedding_and_code():
    """Seen through equations 4 and 5: the first layer's weights are those of the sums."""
    encoder = Encoder(S23, PAPER)
    seen = motion(S23, rows=1, frames=16)
    slots = embedded(encoder, seen[0, 0].double().numpy()) + np.stack([code_of(j) for j in range(23)])
    token, part = encoder.tokens.detach().double().numpy()[2], [*S23.parts[2], 22]
    weight, bias = arrays(encoder.layers[0])
    asking = token @ weight[:32].T + bias[:32]
    keys = np.stack([token, *slots[part]]) @ weight[32:64].T + bias[32:64]
    scores = np.exp(keys @ asking / np.sqrt(32))
    expected = np.zeros(23)
    expected[part] = (scores / scores.sum())[1:]
    np.testing.assert_allclose(encoder.attention(seen)[0, 0, 2].detach().numpy(), expected, atol=1e-5)


def attended(layer: Attention, rows: np.ndarray, sees: np.ndarray, heads: int) -> np.ndarray:
    """Equations 4 and 5 for ``(rows, width)``."""
    weight, bias = arrays(layer.qkv)
    asking, keys, values = np.split(rows @ weight.T + bias, 3, axis=1)
    size = rows.shape[1] // heads
    found = []
    for head in range(heads):
        own = slice(head * size, (head + 1) * size)
        scores = (asking[:, own] @ keys[:, own].T + np.where(sees, 0.0, -np.inf)) / np.sqrt(size)
        scores = np.exp(scores - scores.max(1, keepdims=True))
        found.append(scores / scores.sum(1, keepdims=True) @ values[:, own])
    return np.concatenate(found, 1)


@pytest.mark.parametrize("heads", [1, 2])
def test_equations_4_and_5_are_masked_attention(heads):
    layer = Attention(replace(PAPER, heads=heads))
    nn.init.normal_(layer.qkv.bias)
    rows = torch.randn(32, 6, 5)
    groups = (Group(slice(0, 2), (0, 1, 4)), Group(slice(2, 3), (2, 5)), Group(slice(3, 6), (5, 3, 4)))
    sees = np.zeros((6, 6), dtype=bool)
    for group in groups:
        for query in range(6)[group.queries]:
            sees[query, list(group.keys)] = True
    found = layer(rows, groups, None)
    for frame in range(5):
        expected = attended(layer, rows[..., frame].T.double().numpy(), sees, heads)
        np.testing.assert_allclose(found[..., frame].T.detach().numpy(), expected, atol=1e-5)


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
    seen = motion(S23, rows=1, frames=20)
    tokens, _ = encoder._first(seen, None)
    found = encoder(seen)[0].detach().numpy()
    assert found.shape == (5, 6, 32)
    for part in range(6):
        values = tokens[:, part].T.detach().double().numpy()
        for layer in encoder.convolutions:
            weight, bias = arrays(layer)
            own = slice(part * 32, (part + 1) * 32)
            assert weight.shape == (192, 32, 15)
            values = relu(convolved_by_hand(values, weight[own], bias[own], 2))
        np.testing.assert_allclose(found[:, part], values, atol=1e-5)


def test_equation_7_encodes_the_bones_of_a_part():
    encoder = SkeletonEncoder(S28, PAPER)
    lengths = bones(S28, rows=1)
    found = encoder(lengths)[0].detach().numpy()
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
        np.testing.assert_allclose(found[number], values, atol=1e-5)


def doubled(values: np.ndarray) -> np.ndarray:
    """Twice the frames: a quarter of a frame before and behind each of them."""
    places = np.clip((np.arange(2 * len(values)) + 0.5) / 2 - 0.5, 0, len(values) - 1)
    below = np.floor(places).astype(int)
    share = (places - below)[:, None]
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
    seen = torch.randn(2, 20, 12)
    scores = flat(seen).detach().double().numpy()
    assert scores.shape == (2, 20 - 15 + 1)
    np.testing.assert_allclose(squashed(seen).detach().numpy(), 1 / (1 + np.exp(-scores)), atol=1e-6)


# --------------------------------------------------------------------------------- who learns, who sees
@presets
@structures
@pytest.mark.parametrize("ablation", ABLATIONS)
def test_gradients_reach_every_parameter(layout, preset, ablation):
    design = replace(preset, leak=0.2, **ABLATIONS[ablation])
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
    """A part hears its own slots, the root's, and what shares a slot of it; nobody else."""
    encoder = Encoder(layout, replace(design, layers=1, mutual=False, leak=0.2))
    seen = motion(layout, rows=1, frames=16)
    before = encoder(seen).detach()
    parts = [
        set(own) | set(also) for own, also in zip(layout.parts, convolved(layout, design), strict=True)
    ]
    for slot in range(layout.slots + 1):
        moved = seen.clone()
        moved[:, :, slot] += 1.0
        changed = (encoder(moved) != before).flatten(0, 1).any(0).any(1).tolist()
        for part, own in enumerate(parts):
            assert changed[part] == (slot in own or slot == layout.slots), (slot, part)


def test_the_decoder_of_parts_writes_a_slot_from_its_parts_alone():
    decoder = Decoder(S28, RELEASED)
    code = codes(S28, rows=1)
    before = decoder(code).detach()
    for part in range(6):
        moved = code.clone()
        moved[:, :, part] += 1.0
        changed = (decoder(moved) != before)[0].any(0).any(1)
        assert changed.nonzero()[:, 0].tolist() == [*S28.parts[part], 27]


def test_a_slot_of_no_part_is_written_from_all():
    decoder = Decoder(THREE, RELEASED)
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
    noise = Noise(0.2, torch.device("cpu"))
    values = torch.ones(400, 1000)
    kept = noise.kept(noise.bytes(400, 1000), values)
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
    """A step along the gradient changes the loss as the gradient says, with the noise held."""
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
