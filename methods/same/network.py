"""SAME's network: graph attention from a pose on any body to a code, and from a code to a pose."""

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.training.layers.normaliser import Normaliser

from .features import INPUTS, ROOT
from .graph import Graphs

SHAPE, CODE, HEADS, WIDTH, LAYERS = 6, 32, 16, 16, 3
"""Numbers of a node at rest and of a code; heads of attention, their numbers, hidden layers."""
SLOPE = 0.2


class Answer(NamedTuple):
    """A pose on every body, over ``frames``.

    root: ``(rows, frames, 4)`` turn, steps left and ahead (cm) and height (cm) of the hips. columns:
    ``(nodes, frames, 6)`` of local rotations, not orthonormal. contact: ``(nodes, frames)``, about 0 to 1.
    """

    root: Tensor
    columns: Tensor
    contact: Tensor


class GraphAttention(nn.Module):
    """A layer of a graph attention network (Velickovic et al., 2018): nodes attend to themselves, to what
    they hang from and to what hangs from them. Heads are put beside each other."""

    def __init__(self, inputs: int, outputs: int, heads: int) -> None:
        super().__init__()
        self.linear = nn.Linear(inputs, heads * outputs, bias=False)
        self.asking = nn.Parameter(torch.empty(heads, outputs))
        self.asked = nn.Parameter(torch.empty(heads, outputs))
        self.bias = nn.Parameter(torch.zeros(heads * outputs))
        for weight in (self.linear.weight, self.asking, self.asked):
            nn.init.xavier_uniform_(weight)

    def forward(self, nodes: Tensor, graphs: Graphs) -> Tensor:
        """``(nodes, frames, heads * outputs)`` from ``(nodes, frames, inputs)``."""
        # logits are linear in what is given: reading them off it is cheaper than off the values
        weight = self.linear.weight.view(*self.asked.shape, -1)
        sides = torch.cat([(each.unsqueeze(-1) * weight).sum(1) for each in (self.asking, self.asked)])
        to, of = functional.linear(nodes, sides).float().chunk(2, -1)
        values = self.linear(nodes).unflatten(-1, self.asked.shape)
        receivers, senders = graphs.receivers, graphs.senders
        own = functional.leaky_relu(to + of, SLOPE)
        across = functional.leaky_relu(to.index_select(0, receivers) + of.index_select(0, senders), SLOPE)
        with torch.no_grad():  # a softmax does not depend on what is taken off
            index = receivers.view(-1, 1, 1).expand_as(across)
            most = own.scatter_reduce(0, index, across, "amax")
        own, across = (own - most).exp(), (across - most.index_select(0, receivers)).exp()
        total = own.index_add(0, receivers, across)
        mixed = values * (own / total).unsqueeze(-1)
        share = across / total.index_select(0, receivers)
        mixed.index_add_(0, receivers, values.index_select(0, senders) * share.unsqueeze(-1))
        return mixed.flatten(-2) + self.bias


class Autoencoder(nn.Module):
    """Encoder and decoder, which see of bodies their graphs alone: 298,947 parameters."""

    def __init__(self) -> None:
        super().__init__()
        self.scale = Normaliser(shape=SHAPE, pose=INPUTS)
        self.encoder = nn.ModuleList(_layers(SHAPE + INPUTS, CODE, beside=0))
        self.decoder = nn.ModuleList(_layers(SHAPE + CODE, ROOT.stop - ROOT.start + 7, beside=SHAPE))

    def encode(self, inputs: Tensor, graphs: Graphs) -> Tensor:
        """Codes ``(rows, frames, 32)`` of motions as ``features.see`` has them ``(nodes, frames, 26)``."""
        pose = self.scale.normalise("pose", inputs)
        lacking = torch.ones(len(inputs), 1, 1, dtype=torch.bool, device=inputs.device)
        lacking[graphs.hips] = False
        of_root = torch.zeros(INPUTS, dtype=torch.bool, device=inputs.device)
        of_root[ROOT] = True
        pose = pose.masked_fill(lacking & of_root, 0.0)
        nodes = torch.cat([self._shape(graphs, inputs.shape[1]), pose], -1)
        for number, layer in enumerate(self.encoder):
            nodes = layer(functional.relu(nodes) if number else nodes, graphs)
        row = graphs.row.view(-1, 1, 1).expand_as(nodes)
        pooled = nodes.new_zeros(len(graphs.hips), *nodes.shape[1:])
        return pooled.scatter_reduce(0, row, nodes, "amax", include_self=False)

    def decode(self, codes: Tensor, graphs: Graphs) -> Answer:
        """The pose that codes ``(rows, frames, 32)`` mean on bodies."""
        shape = self._shape(graphs, codes.shape[1])
        nodes = codes[graphs.row]
        for number, layer in enumerate(self.decoder):
            nodes = layer(torch.cat([functional.relu(nodes) if number else nodes, shape], -1), graphs)
        mean, deviation = (self.scale.get_buffer(f"pose_{name}") for name in ("mean", "deviation"))
        root = nodes[graphs.hips, :, :4] * deviation[ROOT] + mean[ROOT]
        return Answer(root, nodes[..., 4:10] * deviation[:6] + mean[:6], nodes[..., 10])

    def _shape(self, graphs: Graphs, frames: int) -> Tensor:
        shape = self.scale.normalise("shape", graphs.shape)
        return shape.unsqueeze(1).expand(-1, frames, -1)


def _layers(inputs: int, outputs: int, beside: int) -> list[GraphAttention]:
    """beside: how many numbers every layer but the first sees beside the one before it."""
    widths = (inputs, *[HEADS * WIDTH + beside] * LAYERS)
    hidden = [GraphAttention(width, WIDTH, HEADS) for width in widths[:-1]]
    return [*hidden, GraphAttention(widths[-1], outputs, 1)]
