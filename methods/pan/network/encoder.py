"""PAN's encoders: motion to codes of body parts at a quarter of the frames (sections 4 and 5.1), and bodies
to codes (section 5.2)."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ..design import Design
from ..layout import Layout
from .attention import Attention, Blocks, Mean
from .groups import Parts, attending, body_parts, convolved_parts
from .layers import DropoutMask, PartConvolution, PartLinear, dropped, mlp

BASIS = 10_000.0
TOGETHER = 512
"""Frames that go through attention at a time: what they need stays in the cache."""


class Encoder(nn.Module):
    """Embedding of edges, attention within parts, and two convolutions over time of stride 2.

    What the paper leaves open: edges are counted from 0 in eq. 2; padding is by reflection; between two
    interleaved blocks the convolution's output is the part's new token, and edges are averaged over two
    frames. Without attention, a part is the mean of its edges, to which the token that came from a
    convolution is added. Where the body is one part, the first convolution of two widens the token to the
    size of all parts' codes; if a layer of attention follows, the second one does.
    """

    raw: PartConvolution
    edges: Tensor
    code: Tensor
    raw_edges: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.design, self.width = design, layout.edges + 1
        self.early = 1 if design.interleaved else design.layers
        self.parts = len(layout.parts)
        parts = body_parts(layout, design)
        self.rows = attending(parts, design.mutual)
        self.register_buffer("edges", torch.tensor(self.rows.edges), persistent=False)
        self.register_buffer("code", index_code(self.rows.edges, design.width), persistent=False)
        sizes = (4, *design.embedding, design.width)
        self.embedding = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        if design.attention:
            self.tokens = nn.Parameter(0.1 * torch.randn(len(parts), design.width))
            self.layers = nn.ModuleList(Attention(design) for _ in range(design.layers))
            self.blocks = Blocks(self.rows.parts, self.rows.shared, design.heads)
            self.last = Blocks(self.rows.tokens, None, design.heads)
        else:
            placed = tuple(tuple(self.rows.edges.index(edge) for edge in part) for part in parts)
            self.layers = nn.ModuleList(Mean(design, placed) for _ in range(design.layers))
        inner, outer = self._channels()
        self.convolutions = nn.ModuleList(
            nn.Conv1d(read, out, design.kernel, stride=2, groups=len(parts)) for read, out in (inner, outer)
        )
        if design.raw:
            self._add_raw(convolved_parts(layout, design), inner[1])

    def forward(self, motion: Tensor) -> Tensor:
        """``(rows, frames // 4, parts, width)`` from ``(rows, frames, edges + 1, 4)``."""
        rows, frames = motion.shape[:2]
        share = self.design.dropout
        mask = DropoutMask(share, motion.device) if self.training and share > 0.0 else None
        tokens, edges = self._first(motion, mask)
        hidden = self.convolutions[0](self._padded(_over_time(tokens, rows)))
        if self.design.raw:
            raw = motion.index_select(2, self.raw_edges).flatten(2).transpose(1, 2)
            hidden = hidden + self.raw(self._padded(raw))
        hidden = self._rectified(hidden)
        if self.early < len(self.layers):
            tokens = hidden.view(rows, -1, self.design.width, frames // 2)
            tokens = self._second(tokens.permute(0, 3, 1, 2).flatten(0, 1), edges, mask)
            hidden = _over_time(tokens, rows)
        hidden = self._rectified(self.convolutions[1](self._padded(hidden)))
        return hidden.transpose(1, 2).reshape(rows, -1, self.parts, self.design.width)

    def attention(self, motion: Tensor) -> Tensor:
        """Attention of each part's token to each edge in the first layer, the mean over heads.

        ``(rows, frames, parts, edges + 1)`` from ``(rows, frames, edges + 1, 4)``; without dropout. The
        token's attention to itself is left out, so that a part's weights add up to less than 1. Where the
        body is one part there is one. Raises ValueError where the encoder has no attention.
        """
        first = self.layers[0]
        if not isinstance(first, Attention):
            raise ValueError("this encoder was built without attention: there are no weights to show")
        rows = self._with_tokens(self._embedded(self._chosen(motion)))
        weights = first.weights(rows, self.last)
        weights = weights.view(*motion.shape[:2], *weights.shape[1::2])
        result = motion.new_zeros(*motion.shape[:2], len(self.rows.tokens), self.width)
        for token, group in enumerate(self.rows.tokens):
            seen = [self.rows.edges[key - len(self.rows.tokens)] for key in group.keys[1:]]
            result[:, :, token, seen] = weights[:, :, token, 1 : len(group.keys)]
        return result

    def _first(self, motion: Tensor, mask: DropoutMask | None) -> tuple[Tensor, Tensor]:
        """Tokens and edges ``(rows * frames, of them, width)`` before the first convolution."""
        found = []
        for values in torch.split(self._chosen(motion), TOGETHER):
            edges = dropped(self._embedded(values), mask)
            found.append(self._attended(None, edges, 0, self.early, mask))
        return torch.cat([tokens for tokens, _ in found]), torch.cat([edges for _, edges in found])

    def _second(self, tokens: Tensor, edges: Tensor, mask: DropoutMask | None) -> Tensor:
        """Tokens behind the layers that follow the first convolution, which has halved the frames."""
        edges = edges.view(-1, 2, *edges.shape[1:]).mean(1)
        pairs = zip(torch.split(tokens, TOGETHER), torch.split(edges, TOGETHER), strict=True)
        return torch.cat([self._attended(*pair, self.early, len(self.layers), mask)[0] for pair in pairs])

    def _chosen(self, motion: Tensor) -> Tensor:
        """``(rows * frames, edges, 4)`` of the edges that are rows of attention."""
        if len(self.edges) < self.width:
            motion = motion.index_select(2, self.edges)
        return motion.flatten(0, 1)

    def _embedded(self, values: Tensor) -> Tensor:
        """``(frames, edges, width)`` from ``(frames, edges, 4)`` (eq. 1 to 3)."""
        width = self.design.width
        flat = mlp(values.flatten(0, 1), self.embedding, "relu").view(*values.shape[:2], width)
        return torch.add(self.code, flat, alpha=math.sqrt(width) if self.design.scaled else 1.0)

    def _with_tokens(self, edges: Tensor) -> Tensor:
        return torch.cat([self.tokens.expand(len(edges), -1, -1), edges], 1)

    def _attended(
        self, tokens: Tensor | None, edges: Tensor, start: int, stop: int, mask: DropoutMask | None
    ) -> tuple[Tensor, Tensor]:
        """Tokens and edges behind some of the layers; no edges behind the last layer there is."""
        if not self.design.attention:
            means = edges
            for layer in self.layers[start:stop]:
                means, edges = layer(edges)
            return means if tokens is None else tokens + means, edges
        rows = self._with_tokens(edges) if tokens is None else torch.cat([tokens, edges], 1)
        for number, layer in enumerate(self.layers[start:stop], start):
            rows = layer(rows, self.last if number == len(self.layers) - 1 else self.blocks, mask)
        count = len(self.rows.tokens)
        return rows[:, :count], rows[:, count:]

    def _channels(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """How many the two convolutions read and write."""
        width, whole = self.design.width, self.parts * self.design.width
        if self.design.by_part:
            return (whole, whole), (whole, whole)
        inner = width if self.early < self.design.layers else whole
        return (width, inner), (inner, whole)

    def _add_raw(self, parts: Parts, outputs: int) -> None:
        chosen = torch.tensor([edge for part in parts for edge in part])
        self.register_buffer("raw_edges", chosen, persistent=False)
        sizes = [4 * len(part) for part in parts]
        self.raw = PartConvolution(sizes, outputs // len(parts), self.design.kernel)

    def _padded(self, hidden: Tensor) -> Tensor:
        kernel = self.design.kernel
        return functional.pad(hidden, ((kernel - 1) // 2, kernel // 2), mode="reflect")

    def _rectified(self, hidden: Tensor) -> Tensor:
        return functional.leaky_relu(hidden, self.design.leak)


def _over_time(tokens: Tensor, rows: int) -> Tensor:
    """``(rows, parts * width, frames)`` from ``(rows * frames, parts, width)``."""
    return tokens.flatten(1).view(rows, -1, tokens[0].numel()).transpose(1, 2)


def index_code(edges: tuple[int, ...], width: int) -> Tensor:
    """The code of each edge's index ``(edges, width)`` (eq. 2)."""
    steps = torch.arange(0, width, 2, dtype=torch.float64)
    angles = torch.tensor(edges, dtype=torch.float64).unsqueeze(1) / BASIS ** (steps / width)
    return torch.stack([angles.sin(), angles.cos()], -1).flatten(1)[:, :width].float()


class SkeletonEncoder(nn.Module):
    """Three linear layers for each part, from the bones of its edges.

    The root's edge has no bone, and no weights that would read it. Where the body is one part, the layers
    are as wide as those of all parts together.
    """

    chosen: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.shape = (len(layout.parts), design.width)
        self.leak, self.bent, self.share = design.leak, design.skeleton_bent, design.skeleton_share
        parts = [part[:-1] for part in body_parts(layout, design)]
        count, times = len(parts), 1 if design.by_part else len(layout.parts)
        hidden = times * design.skeleton
        chosen = torch.tensor([edge for part in parts for edge in part])
        self.register_buffer("chosen", chosen, persistent=False)
        self.layers = nn.ModuleList(
            [
                PartLinear([3 * len(part) for part in parts], hidden),
                PartLinear([hidden] * count, hidden),
                PartLinear([hidden] * count, times * design.width),
            ]
        )

    def forward(self, bones: Tensor) -> Tensor:
        """``(rows, parts, width)``, multiplied by its share, from ``(rows, edges + 1, 3)``."""
        values = bones.index_select(1, self.chosen)
        for number, layer in enumerate(self.layers):
            values = layer(values.flatten(1))
            if self.bent or number < len(self.layers) - 1:
                values = functional.leaky_relu(values, self.leak)
        return values.reshape(-1, *self.shape) * self.share
