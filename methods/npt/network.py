"""NPT's network: point-wise layers whose normalisation is steered by the vertices of the target."""

from itertools import pairwise
from typing import Literal, cast

import torch
from torch import Tensor, nn
from torch.nn import functional

Pooling = Literal["none", "max"]
POSE_CHANNELS = (64, 128)
"""Of the pose encoder's first two layers."""
REACH = 2.0
"""Largest coordinate that the network can answer, units."""


def normalised(features: Tensor) -> Tensor:
    """Features ``(rows, channels, points)`` with mean 0 and variance 1 over the points of each row and
    channel (instance norm, Ulyanov et al. 2016, without parameters)."""
    return functional.layer_norm(features, features.shape[-1:])


class PointWise(nn.Linear):
    """The same linear layer at every point: a convolution of size 1."""

    def forward(self, features: Tensor) -> Tensor:
        """``(rows, out, points)`` of features ``(rows, in, points)``."""
        return self.weight @ features + self.bias[:, None]


class PoseEncoder(nn.Module):
    """Point-wise layers 3 -> 64 -> 128 -> ``width``, each with instance norm and ReLU."""

    def __init__(self, width: int) -> None:
        super().__init__()
        sizes = (3, *POSE_CHANNELS, width)
        self.layers = nn.ModuleList(PointWise(a, b) for a, b in pairwise(sizes))

    def forward(self, points: Tensor) -> Tensor:
        """``(rows, width, points)`` of points ``(rows, 3, points)``."""
        for layer in self.layers:
            points = functional.relu(normalised(layer(points)))
        return points


class SPAdaIN(nn.Module):
    """Spatially adaptive instance normalisation: features are normalised over the points, then scaled and
    shifted point by point, by linear functions of the target's vertices.

    steady: without the normalisation.
    """

    def __init__(self, channels: int, steady: bool = False) -> None:
        super().__init__()
        self.scale, self.shift, self.steady = PointWise(3, channels), PointWise(3, channels), steady

    def forward(self, features: Tensor, identity: Tensor) -> Tensor:
        """features: ``(rows, channels, points)``, identity: ``(rows, 3, points)``."""
        values = features if self.steady else normalised(features)
        return torch.addcmul(self.shift(identity), self.scale(identity), values)


class SPAdaINBlock(nn.Module):
    """Residual block: two layers, each after SPAdaIN and ReLU, beside one such layer as the short way."""

    def __init__(self, channels: int, steady: bool = False) -> None:
        super().__init__()
        self.styles = nn.ModuleList(SPAdaIN(channels, steady) for _ in range(3))
        self.layers = nn.ModuleList(PointWise(channels, channels) for _ in range(3))

    def forward(self, features: Tensor, identity: Tensor) -> Tensor:
        first, second, short = range(3)
        way = self._layer(second, self._layer(first, features, identity), identity)
        return way + self._layer(short, features, identity)

    def _layer(self, which: int, features: Tensor, identity: Tensor) -> Tensor:
        hidden: Tensor = self.layers[which](functional.relu(self.styles[which](features, identity)))
        return hidden


class PoseTransfer(nn.Module):
    """The whole network: features of the posed points, and the target's vertices, to the posed vertices.

    width:   of the features; the decoder has ``width + 3`` channels, then a half and a quarter of them. At
             1024, as published, it has 6,054,941 parameters.
    pooling: ``none``: feature k of the points goes to vertex k, whichever point that is, so there are as
             many points as vertices. ``max``: the largest over all points goes to every vertex. Then the
             first block does not normalise, which would remove what all vertices have in common.
    """

    def __init__(self, width: int, pooling: Pooling) -> None:
        super().__init__()
        self.width, self.pooling = width, pooling
        self.encoder = PoseEncoder(width)
        sizes = (width + 3, (width + 3) // 2, (width + 3) // 4)
        self.layers = nn.ModuleList(PointWise(a, b) for a, b in pairwise((width + 3, *sizes)))
        self.blocks = nn.ModuleList(
            SPAdaINBlock(size, steady=pooling == "max" and not rank) for rank, size in enumerate(sizes)
        )
        self.answer = PointWise(sizes[-1], 3)

    def forward(self, points: Tensor, identity: Tensor) -> Tensor:
        """``(rows, vertices, 3)``: the target's vertices in the pose of the points; units.

        points: ``(rows, vertices, 3)``, of any number with ``max``, in any order. identity: ``(rows,
        vertices, 3)`` the target's vertices in a pose of rest. Both are centred.
        """
        points, identity = points.transpose(1, 2), identity.transpose(1, 2)
        features = self._joined(self.encoder(points), identity)
        for rank, block in enumerate(self.blocks):
            features = block(self.layers[rank](features) if rank else features, identity)
        return REACH * torch.tanh(self.answer(features)).transpose(1, 2)

    def _joined(self, pose: Tensor, identity: Tensor) -> Tensor:
        """The first layer of features and vertices as one; what all vertices share is computed once."""
        if self.pooling == "max":
            pose = pose.amax(dim=-1, keepdim=True)
        layer = cast(PointWise, self.layers[0])
        ways = layer.weight[:, : self.width], layer.weight[:, self.width :]
        return ways[0] @ pose + ways[1] @ identity + layer.bias[:, None]
