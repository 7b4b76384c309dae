"""PAN's networks (Hu et al., TVCG 2023): encoders of motion and skeletons, decoder, discriminator.

Frames are a multiple of 4. Channels of edges and bones are those of ``skeletal/features.py``.

Weights that a mask would blot out do not exist: what differs in size between parts is stored end to end.
"""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.layers.skeletal.layout import Layout

from ..settings import Design
from .attention import Attention, Mean
from .layers import DropoutMask, EdgeConvolution, PartConvolution, PartLinear, dropped, mlp

Parts = tuple[tuple[int, ...], ...]
BASIS = 10_000.0
TOGETHER = 512
"""Frames that go through attention at a time: what they need stays in the cache."""


def body_parts(layout: Layout, design: Design) -> Parts:
    """The edges of each part for attention, with those of every part: the root's is the last.

    Where the body is one part, that is every edge that is of a part.
    """
    return tuple(tuple(sorted({*part, *layout.common})) for part in _own_edges(layout, design))


def _own_edges(layout: Layout, design: Design) -> Parts:
    return layout.parts if design.by_part else (tuple(sorted(set().union(*layout.parts))),)


def seen_bones(layout: Layout, design: Design) -> Parts:
    """The edges whose bones the encoder of skeletons reads for each part.

    The released code looks up the numbers of edges among bones stored by joint, the root first: it reads
    the bone before each edge's own, and the last one (which it takes for the root's) for every part. The
    root's own, before the first edge's, has no length and no weights unless ``root_bone`` is set.
    """
    parts = _own_edges(layout, design)
    if design.bone_mask == "paper" or not design.by_part:
        return parts
    first, count = int(not design.root_bone), layout.edges + 1
    return tuple(
        (*((edge - 1) % count for edge in part if edge >= first), layout.edges - 1) for part in parts
    )


def convolved_parts(layout: Layout, design: Design) -> Parts:
    """The edges of each part for convolutions. The released code shifts all but the root's by one, so
    that the last one is of no part."""
    parts = body_parts(layout, design)
    if design.conv_mask == "paper" or not design.by_part:
        return parts
    return tuple((*(edge - 1 for edge in part[:-1] if edge > 0), part[-1]) for part in parts)


def written(layout: Layout, design: Design) -> Parts:
    """The edges that the decoder writes from each part.

    An edge in several parts is written from each of them; the root's edge and edges in no part are
    written from all parts.
    """
    parts = convolved_parts(layout, design)
    everywhere = set(range(layout.edges)) - {edge for part in parts for edge in part}
    return tuple(tuple(sorted({*part, *everywhere})) for part in parts)


def attending(layout: Layout, design: Design) -> tuple[tuple[int, ...], Tensor]:
    """The edges that are of a part, and which rows see which ``(rows, rows)`` bool.

    Rows are the tokens of the parts, then these edges. A token sees itself and its part; an edge those
    that share a part with it, and if ``mutual`` the tokens of its parts. See ``Design.root_alone`` too.
    """
    parts = body_parts(layout, design)
    edges = tuple(sorted({edge for part in parts for edge in part}))
    own = torch.tensor([[edge in part for edge in edges] for part in parts])
    tokens = torch.cat([torch.eye(len(parts), dtype=torch.bool), own], 1)
    together = (own.unsqueeze(1) & own.unsqueeze(2)).any(0)
    rows = torch.cat([own.T & design.mutual, together], 1)
    if design.root_alone:
        common = torch.tensor([edge in layout.common for edge in edges])
        rows[common] = torch.cat([torch.zeros(len(parts), dtype=torch.bool), common])
    return edges, torch.cat([tokens, rows])


class Encoder(nn.Module):
    """Embedding of edges, attention within parts, and two convolutions over time of stride 2.

    What the paper leaves open: edges are counted from 0 in eq. 2; padding is by reflection; between two
    interleaved blocks the convolution's output is the part's new token, and edges are averaged over two
    frames. Without attention, a part is the mean of its edges, to which the token that came from a
    convolution is added. Where the body is one part, the first convolution of two widens the token to the
    size of all parts' codes; if a layer of attention follows, the second one does.
    """

    edges: Tensor
    hidden: Tensor
    code: Tensor
    raw_edges: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.design, self.width = design, layout.edges + 1
        self.early = 1 if design.interleaved else design.layers
        self.parts = len(layout.parts)
        parts = body_parts(layout, design)
        self.count = len(parts)
        edges, sees = attending(layout, design)
        hidden = torch.zeros(sees.shape).masked_fill(~sees, -torch.inf)
        self.register_buffer("edges", torch.tensor(edges), persistent=False)
        self.register_buffer("hidden", hidden, persistent=False)
        self.register_buffer("code", index_code(edges, design.width), persistent=False)
        sizes = (4, *design.embedding, design.width)
        self.embedding = nn.ModuleList(nn.Linear(*each) for each in pairwise(sizes))
        if design.attention:
            self.tokens = nn.Parameter(0.1 * torch.randn(len(parts), design.width))
            self.layers = nn.ModuleList(Attention(design) for _ in range(design.layers))
        else:
            placed = tuple(tuple(edges.index(edge) for edge in part) for part in parts)
            self.layers = nn.ModuleList(Mean(design, placed) for _ in range(design.layers))
        inner, outer = self._channels()
        self.convolutions = nn.ModuleList(
            nn.Conv1d(read, out, design.kernel, stride=2, groups=len(parts)) for read, out in (inner, outer)
        )
        if design.raw:
            raw = convolved_parts(layout, design)
            chosen = torch.tensor([edge for part in raw for edge in part])
            self.register_buffer("raw_edges", chosen, persistent=False)
            channels = [4 * len(part) for part in raw]
            self.raw = PartConvolution(channels, inner[1] // len(raw), design.kernel)

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
        weights = first.weights(rows, self.hidden[: self.count]).mean(1)
        result = motion.new_zeros(*motion.shape[:2], self.count, self.width)
        result[..., self.edges] = weights[..., self.count :].view(*result.shape[:3], -1)
        return result

    def _first(self, motion: Tensor, mask: DropoutMask | None) -> tuple[Tensor, Tensor]:
        """Tokens and edges ``(rows * frames, of them, width)`` before the first convolution."""
        attended = []
        for values in torch.split(self._chosen(motion), TOGETHER):
            edges = dropped(self._embedded(values), mask)
            attended.append(self._attended(None, edges, 0, self.early, mask))
        return torch.cat([tokens for tokens, _ in attended]), torch.cat([edges for _, edges in attended])

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
            last = number == len(self.layers) - 1
            rows = layer(rows, self.hidden[: self.count] if last else self.hidden, mask)
        return rows[:, : self.count], rows[:, self.count :]

    def _channels(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Numbers of channels that the two convolutions read and write."""
        width, total = self.design.width, self.parts * self.design.width
        if self.design.by_part:
            return (total, total), (total, total)
        inner = width if self.early < self.design.layers else total
        return (width, inner), (inner, total)

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
    """Three linear layers for each part, from the bones of its edges (``seen_bones``).

    The root's edge has no bone, and no weights that would read it. Where the body is one part, the layers
    are as wide as those of all parts together.
    """

    chosen: Tensor

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        self.shape = (len(layout.parts), design.width)
        self.leak, self.bent, self.share = design.leak, design.skeleton_bent, design.skeleton_share
        parts = seen_bones(layout, design)
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


class Decoder(nn.Module):
    """Twice: frames doubled by linear interpolation, then a convolution; rectified but for the last time.

    ``full`` reads all parts everywhere, as the paper says. ``parts``: the first convolution stays within
    parts, and the second one reads the parts that an edge is written from. Padding is by reflection, of
    which the paper says nothing. What ``Design.padded`` names is zero.
    """

    def __init__(self, layout: Layout, design: Design) -> None:
        super().__init__()
        count, width, kernel = len(layout.parts), design.width, design.kernel
        self.leak, self.edges, self.padding = design.leak, layout.edges + 1, int(design.padded)
        self.reach = ((kernel - 1) // 2, kernel // 2)
        apart = design.decoder == "parts" and design.by_part
        self.inner = nn.Conv1d(count * width, count * width, kernel, groups=count if apart else 1)
        self.outer = (
            EdgeConvolution(written(layout, design), width, kernel)
            if apart
            else nn.Conv1d(count * width, 4 * self.edges, kernel)
        )

    def forward(self, code: Tensor) -> Tensor:
        """``(rows, frames, edges + 1, 4)`` from ``(rows, frames // 4, parts, width)``."""
        hidden = code.flatten(2).transpose(1, 2)
        hidden = functional.leaky_relu(self.inner(self._wider(hidden)), self.leak)
        motion = self.outer(self._wider(hidden)).transpose(1, 2)
        if self.padding:
            motion = functional.pad(motion[..., : -self.padding], (0, self.padding))
        return motion.unflatten(2, (self.edges, 4))

    def _wider(self, hidden: Tensor) -> Tensor:
        double = functional.interpolate(hidden, scale_factor=2, mode="linear", align_corners=False)
        return functional.pad(double, self.reach, mode="reflect")


class Discriminator(nn.Module):
    """A convolution over time without padding, then two layers on single frames.

    channels: numbers per frame. With ``squashed`` the scores end in a sigmoid (eq. 9). The paper does not
    say how many layers there are: they are the released code's.
    """

    def __init__(self, channels: int, design: Design) -> None:
        super().__init__()
        self.leak, self.squashed = design.leak, design.squashed
        self.layers = nn.ModuleList(
            [
                nn.Conv1d(channels, design.judging, design.kernel),
                nn.Conv1d(design.judging, design.judging // 2, 1),
                nn.Conv1d(design.judging // 2, 1, 1),
            ]
        )

    def forward(self, motion: Tensor) -> Tensor:
        """Scores ``(rows, frames - kernel + 1)`` from ``(rows, frames, channels)``."""
        hidden = motion.transpose(1, 2)
        for layer in self.layers[:-1]:
            hidden = functional.leaky_relu(layer(hidden), self.leak)
        scores: Tensor = self.layers[-1](hidden).squeeze(1)
        return scores.sigmoid() if self.squashed else scores
