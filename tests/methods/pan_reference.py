"""PAN's networks built the plain way: dense layers times masks of 0 and 1, all rows attending to all.

Each takes over the weights of one of ours. ``pairs`` lists, for every parameter here, the parameter of ours
and the function that writes one shape in the other: for weights, and so for gradients.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.methods.pan.network import Decoder, Encoder, SkeletonEncoder
from retarget_bench.methods.pan.settings import Design
from retarget_bench.training.layers.skeletal.layout import Layout

HIDDEN = -1e20

NAMES = ("left leg", "right leg", "spine", "head", "left arm", "right arm")
S23 = Layout(
    (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 13, 12, 15, 16, 17, 12, 19, 20, 21),
    (None,) * 23,
    NAMES,
    ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11), (11, 12, 13), (11, 14, 15, 16, 17), (11, 18, 19, 20, 21)),
)
S28 = Layout(
    (-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 0, 11, 12, 13, 14, 15, 16, 14, 18, 19, 20, 21, 14, 23, 24, 25, 26),
    (None,) * 28,
    NAMES,
    (
        (0, 1, 2, 3, 4),
        (5, 6, 7, 8, 9),
        (10, 11, 12, 13),
        (13, 14, 15, 16),
        (13, 17, 18, 19, 20, 21),
        (13, 22, 23, 24, 25, 26),
    ),
)
THREE = Layout(
    (-1, 0, 1, 0, 3, 0, 5, 6, 6, 8, 6, 10),
    (None,) * 12,
    ("legs", "spine", "head"),
    ((0, 1, 2, 3), (4, 5), (5, 6)),
)
"""Two legs, a spine, a head; arms that no part encodes."""
JOINTS = Layout(THREE.parents, THREE.roles, THREE.names, ((1, 2, 3, 4), (5, 6), (7,)), "joints")
"""The same, by joints."""

Write = Callable[[Tensor], Tensor]
Pairs = list[tuple[nn.Parameter, nn.Parameter, Write]]


def same(values: Tensor) -> Tensor:
    return values


class Masked(nn.Module):
    """A dense linear layer (one tap) or convolution, times its mask."""

    def __init__(
        self, weight: nn.Parameter, bias: nn.Parameter, mask: Tensor, write: Write, stride: int = 0
    ) -> None:
        super().__init__()
        self.weight = nn.Parameter(write(weight.data))
        self.bias = nn.Parameter(bias.data.flatten().clone())
        self.register_buffer("mask", mask)
        self.stride = stride
        self.pairs: Pairs = [(self.weight, weight, write), (self.bias, bias, torch.flatten)]

    def forward(self, values: Tensor) -> Tensor:
        weight = self.weight * self.mask
        if not self.stride:
            return functional.linear(values, weight, self.bias)
        reach = weight.shape[2] // 2
        padded = functional.pad(values, (reach, reach), mode="reflect")
        return functional.conv1d(padded, weight, self.bias, self.stride)


def gathered(pairs: Pairs, module: nn.Module) -> Pairs:
    return pairs + [pair for each in module.modules() if isinstance(each, Masked) for pair in each.pairs]


def copied(lean: nn.Module, plain: nn.Module, names: dict[str, str]) -> Pairs:
    """Parameters of the plain network, by name, take over those of the lean one."""
    own, other = dict(lean.named_parameters()), dict(plain.named_parameters())
    assert set(names.values()) == set(other)
    for lean_name, name in names.items():
        other[name].data.copy_(own[lean_name].data)
    return [(other[name], own[each], same) for each, name in names.items()]


# --------------------------------------------------------------------------------------------- masks
def parts_with_root(layout: Layout) -> list[list[int]]:
    """The hips too, where a layout is of joints."""
    first = [0] if layout.slots == "joints" else []
    return [[*first, *part, layout.edges] for part in layout.parts]


def convolved(layout: Layout, design: Design) -> list[list[int]]:
    if design.conv_mask == "paper":
        return parts_with_root(layout)
    return [[*(s - 1 for s in part if s >= 1), layout.edges] for part in layout.parts]


def read_bones(layout: Layout, design: Design) -> list[list[int]]:
    """The bones that each part reads, by edge; released: numbers of edges taken for those of joints."""
    if design.bone_mask == "paper":
        return [list(part) for part in layout.parts]
    return [[*(s - 1 for s in part if s >= 1), layout.edges - 1] for part in layout.parts]


def reading(layout: Layout, design: Design) -> list[list[int]]:
    """The parts that write each edge."""
    parts = convolved(layout, design)
    readers = [[p for p, part in enumerate(parts) if s in part] for s in range(layout.edges + 1)]
    return [own or list(range(len(parts))) for own in readers]


def blocks(count: int, rows: int, columns: int) -> Tensor:
    """1 on the diagonal's blocks."""
    return torch.kron(torch.eye(count), torch.ones(rows, columns))


def attention_mask(layout: Layout, design: Design) -> Tensor:
    """``(rows, rows)``: 0 where a row sees another, else hidden."""
    parts, count = parts_with_root(layout), len(layout.parts)
    size = count + layout.edges + 1
    sees = torch.eye(size, dtype=torch.bool)
    sees[count:, count:] = False
    for token, part in enumerate(parts):
        rows = [count + edge for edge in part]
        sees[token, rows] = True
        for row in rows:
            sees[row, rows] = True
            sees[row, token] = sees[row, token] | design.mutual
    if design.root_alone:
        common = [size - 1] if layout.slots == "edges" else [count, size - 1]
        for row in common:
            sees[row] = False
            sees[row, common] = True
    return torch.where(sees, 0.0, HIDDEN)


# ------------------------------------------------------------------------------------------- encoder
class PlainEncoder(nn.Module):
    """Takes all rows through all layers, and drops edges at the end."""

    def __init__(self, lean: Encoder, layout: Layout, design: Design) -> None:
        super().__init__()
        count, edges = len(layout.parts), layout.edges + 1
        width, kernel = design.width, design.kernel
        self.design, self.count = design, count
        sizes = (4, *design.embedding, width)
        self.embedding = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(sizes))
        names = {name: name for name, _ in self.embedding.named_parameters()}
        self.pairs = copied(lean.embedding, self.embedding, names)
        self.tokens = nn.Parameter(lean.tokens.data.clone())
        self.pairs.append((self.tokens, lean.tokens, same))
        self.register_buffer("mask", attention_mask(layout, design))
        self.register_buffer("code", sinusoids(edges, width))
        self.layers = nn.ModuleList(self._layer(each) for each in lean.layers)
        self.first, self.second = (self._convolution(each) for each in lean.convolutions)
        self.raw = None
        if design.raw:
            parts = convolved(layout, design)
            rows = [(p, 4 * edge + c) for p, part in enumerate(parts) for edge in part for c in range(4)]

            def write(values: Tensor) -> Tensor:
                dense = values.new_zeros(count * width, 4 * edges, kernel)
                for (part, column), row in zip(rows, values, strict=True):
                    dense[part * width : (part + 1) * width, column] = row
                return dense

            mask = write(torch.ones_like(lean.raw.weight))
            self.raw = Masked(lean.raw.weight, lean.raw.bias, mask, write, 2)
        self.pairs = gathered(self.pairs, self)

    def _layer(self, lean: nn.Module) -> nn.Module:
        design = self.design
        within = {"qkv.weight": "in_proj_weight", "qkv.bias": "in_proj_bias"}
        if not design.feedforward:
            plain = nn.MultiheadAttention(design.width, design.heads, design.dropout, batch_first=True)
            plain.out_proj.weight = plain.out_proj.bias = None
            self.pairs += copied(lean, plain, within)
            return plain
        layer = nn.TransformerEncoderLayer(
            design.width, design.heads, design.feedforward, design.dropout, "gelu", batch_first=True
        )
        names = {name: f"self_attn.{other}" for name, other in within.items()}
        for name in ("weight", "bias"):
            names[f"block.out.{name}"] = f"self_attn.out_proj.{name}"
            for k in range(2):
                names[f"block.feed.{k}.{name}"] = f"linear{k + 1}.{name}"
                names[f"block.norms.{k}.{name}"] = f"norm{k + 1}.{name}"
        self.pairs += copied(lean, layer, names)
        return layer

    def _convolution(self, lean: nn.Conv1d) -> Masked:
        count, width = self.count, self.design.width

        def write(values: Tensor) -> Tensor:
            return blocks(count, width, width).unsqueeze(2) * values.repeat(1, count, 1)

        return Masked(lean.weight, lean.bias, blocks(count, width, width).unsqueeze(2), write, 2)

    def forward(self, motion: Tensor) -> Tensor:
        rows, frames = motion.shape[:2]
        design = self.design
        values = motion
        for layer in self.embedding[:-1]:
            values = functional.relu(layer(values))
        values = (
            self.embedding[-1](values) * (math.sqrt(design.width) if design.scaled else 1.0) + self.code
        )
        edges = functional.dropout(values, design.dropout, self.training)
        tokens = self.tokens.expand(rows, frames, -1, -1)
        split = 1 if design.interleaved else len(self.layers)
        tokens, edges = self._attended(tokens, edges, 0, split)
        hidden = self.first(tokens.flatten(2).transpose(1, 2))
        if self.raw is not None:
            hidden = hidden + self.raw(motion.flatten(2).transpose(1, 2))
        hidden = functional.leaky_relu(hidden, design.leak).transpose(1, 2)
        if split < len(self.layers):
            edges = 0.5 * (edges[:, ::2] + edges[:, 1::2])
            tokens = hidden.unflatten(2, (self.count, -1))
            hidden = self._attended(tokens, edges, split, len(self.layers))[0].flatten(2)
        hidden = functional.leaky_relu(self.second(hidden.transpose(1, 2)), design.leak)
        return hidden.transpose(1, 2).unflatten(2, (self.count, -1))

    def _attended(self, tokens: Tensor, edges: Tensor, start: int, stop: int) -> tuple[Tensor, Tensor]:
        shape = edges.shape[:2]
        rows = torch.cat([tokens, edges], 2).flatten(0, 1)
        for layer in self.layers[start:stop]:
            released = self.design.feedforward > 0
            rows = layer(rows, src_mask=self.mask) if released else self._bare(layer, rows)
        rows = rows.unflatten(0, shape)
        return rows[:, :, : self.count], rows[:, :, self.count :]

    def _bare(self, layer: nn.MultiheadAttention, rows: Tensor) -> Tensor:
        width = self.design.width
        projected = functional.linear(rows, layer.in_proj_weight, layer.in_proj_bias)
        asking, keys, values = projected.split(width, -1)
        return ((asking @ keys.transpose(1, 2) + self.mask) / math.sqrt(width)).softmax(-1) @ values


def sinusoids(edges: int, width: int) -> Tensor:
    code = torch.zeros(edges, width)
    for j in range(edges):
        for i in range(width // 2):
            angle = j / 10000 ** (2 * i / width)
            code[j, 2 * i], code[j, 2 * i + 1] = math.sin(angle), math.cos(angle)
    return code


# ------------------------------------------------------------------------------------ bones, decoder
class PlainSkeletonEncoder(nn.Module):
    """Reads the bones of all edges, the root's too, in every layer but for the mask."""

    def __init__(self, lean: SkeletonEncoder, layout: Layout, design: Design) -> None:
        super().__init__()
        self.design, self.count = design, len(layout.parts)
        read = read_bones(layout, design)
        rows = [(p, 3 * edge + c) for p, part in enumerate(read) for edge in part for c in range(3)]
        first, *rest = lean.layers
        hidden = design.skeleton

        def write(values: Tensor) -> Tensor:
            dense = values.new_zeros(self.count * hidden, 3 * (layout.edges + 1))
            for (part, column), row in zip(rows, values, strict=True):
                dense[part * hidden : (part + 1) * hidden, column] = row
            return dense

        mask = write(torch.ones_like(first.weight))
        if design.bone_mask == "paper":
            mask[:, -3:] = 1.0
        else:
            mask[:hidden, -3:] = 1.0  # of the first part's first edge, taken for the root's bone
        self.layers = nn.ModuleList([Masked(first.weight, first.bias, mask, write)])
        for each in rest:
            outputs = each.weight.shape[1]

            def widened(values: Tensor, outputs: int = outputs) -> Tensor:
                parts = values.view(self.count, hidden, outputs).transpose(1, 2)
                return torch.block_diag(*parts)

            mask = blocks(self.count, outputs, hidden)
            self.layers.append(Masked(each.weight, each.bias, mask, widened))
        self.pairs = gathered([], self)

    def forward(self, bones: Tensor) -> Tensor:
        values = bones.flatten(1)
        for number, layer in enumerate(self.layers):
            values = layer(values)
            if number < 2 or self.design.skeleton_bent:
                values = functional.leaky_relu(values, self.design.leak)
        return values.unflatten(1, (self.count, -1)) * self.design.skeleton_share


class PlainDecoder(nn.Module):
    def __init__(self, lean: Decoder, layout: Layout, design: Design) -> None:
        super().__init__()
        self.design, self.edges = design, layout.edges + 1
        count, width, kernel = len(layout.parts), design.width, design.kernel
        if design.decoder == "full":
            self.inner, self.outer = (
                Masked(each.weight, each.bias, torch.ones_like(each.weight), torch.clone, 1)
                for each in (lean.inner, lean.outer)
            )
        else:
            mask = blocks(count, width, width).unsqueeze(2)
            self.inner = Masked(
                lean.inner.weight, lean.inner.bias, mask, lambda v: mask * v.repeat(1, count, 1), 1
            )
            read = reading(layout, design)
            rows = [
                (4 * edge + c, part)
                for part in range(count)
                for edge in range(self.edges)
                if part in read[edge]
                for c in range(4)
            ]

            def write(values: Tensor) -> Tensor:
                dense = values.new_zeros(4 * self.edges, count * width, kernel)
                for (channel, part), row in zip(rows, values, strict=True):
                    dense[channel, part * width : (part + 1) * width] = row
                return dense

            weight = lean.outer.weight
            self.outer = Masked(weight, lean.outer.bias, write(torch.ones_like(weight)), write, 1)
        self.pairs = gathered([], self)

    def forward(self, code: Tensor) -> Tensor:
        hidden = functional.leaky_relu(
            self.inner(doubled(code.flatten(2).transpose(1, 2))), self.design.leak
        )
        motion = self.outer(doubled(hidden)).transpose(1, 2).unflatten(2, (self.edges, 4))
        if self.design.padded:
            motion = motion.clone()
            motion[..., -1, 3] = 0.0
        return motion


def doubled(values: Tensor) -> Tensor:
    return functional.interpolate(values, scale_factor=2, mode="linear")


# --------------------------------------------------------------------------------- what tests begin with
def motion(layout: Layout, rows: int = 2, frames: int = 24) -> Tensor:
    return torch.randn(rows, frames, layout.edges + 1, 4)


def bones(layout: Layout, rows: int = 2) -> Tensor:
    return torch.cat([torch.randn(rows, layout.edges, 3), torch.zeros(rows, 1, 3)], 1)


def codes(layout: Layout, rows: int = 2, frames: int = 6, width: int = 32) -> Tensor:
    return torch.randn(rows, frames, len(layout.parts), width)


def close(answer: Tensor, expected: Tensor) -> None:
    """To 1e-5 of the largest number."""
    scale = max(1.0, float(expected.detach().abs().max()))
    torch.testing.assert_close(answer, expected, rtol=0.0, atol=1e-5 * scale)
