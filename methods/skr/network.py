"""The skeleton regressor (Table 5 of the paper): PointNet (Qi et al. 2017) from points to 22 joints."""

from typing import NamedTuple, Self

import torch
from torch import Tensor, nn

from retarget_bench.motion.body22 import JOINTS

WIDE, DEEP, DROPOUT = 64, 1024, 0.3
"""Numbers a point has before and at the maximum over points, and the paper's dropout."""
_START = 0.02
"""Deviation of the last layer's weights before training: answers begin near the points' mean."""
_SMALLEST = 1e-9
"""Metres: points that lie closer together than this are one point, of no size."""


class TransformNet(nn.Module):
    """STN(k): a matrix ``(k, k)`` for a set of points of k numbers each; the identity before training."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.size = size
        self.first, self.second = nn.Linear(size, WIDE), nn.Linear(WIDE, 2 * WIDE)
        self.third = nn.Linear(2 * WIDE, DEEP)
        self.fourth, self.fifth = nn.Linear(DEEP, DEEP // 2), nn.Linear(DEEP // 2, DEEP // 4)
        self.last = nn.Linear(DEEP // 4, size * size)
        for each in (self.first, self.second, self.third, self.fourth, self.fifth):
            _of_relu(each)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self, points: Tensor, search: torch.dtype) -> Tensor:
        """``(rows, k, k)`` from points ``(rows, V, k)``; search: see ``largest``."""
        wide = self.second(self.first(points).relu()).relu()
        hidden = largest(wide, self.third, search).relu()
        hidden = self.last(self.fifth(self.fourth(hidden).relu()).relu())
        matrix: Tensor = hidden.unflatten(-1, (self.size, self.size))
        return matrix + torch.eye(self.size, device=matrix.device)


class SkeletonRegressor(nn.Module):
    """22 joints of any number of points in any order.

    The points are seen from a frame of their own (``Frame``), which is given back to the answer.

    principal: the frame has the level direction along which the points spread most, else the world's.
    features: also transform the 64 features of the points, as Table 5 has it (3,466,251 parameters); the
    1.6 M parameters that the paper states are those without (1,612,875).
    """

    def __init__(self, features: bool = False, dropout: float = DROPOUT, principal: bool = True) -> None:
        super().__init__()
        self.principal = principal
        self.turned = TransformNet(3)
        self.first = nn.Linear(3, WIDE)
        self.mixed = TransformNet(WIDE) if features else None
        self.second, self.third = nn.Linear(WIDE, 2 * WIDE), nn.Linear(2 * WIDE, DEEP)
        self.fourth, self.fifth = nn.Linear(DEEP, DEEP // 2), nn.Linear(DEEP // 2, DEEP // 4)
        self.dropped = nn.Dropout(dropout)
        self.last = nn.Linear(DEEP // 4, 3 * JOINTS)
        for each in (self.first, self.second, self.third, self.fourth, self.fifth):
            _of_relu(each)
        nn.init.normal_(self.last.weight, std=_START)
        nn.init.zeros_(self.last.bias)

    def forward(self, points: Tensor) -> Tensor:
        """Joints ``(rows, 22, 3)`` metres under points ``(rows, V, 3)`` metres."""
        frame = self.frame(points)
        return frame.back(self.estimate(frame.into(points)))

    def frame(self, points: Tensor) -> "Frame":
        """The frame that points ``(rows, V, 3)`` metres are seen from."""
        return Frame.of(points, self.principal)

    def estimate(self, points: Tensor) -> Tensor:
        """Joints ``(rows, 22, 3)`` for points ``(rows, V, 3)``, both as they look from the points' frame.

        Under autocast the search for the largest numbers is all that has reduced precision: the places of
        points have to be exact, and nothing else takes long.
        """
        kind = points.device.type
        search = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else points.dtype
        with torch.autocast(kind, enabled=False):
            hidden = self.first(points @ self.turned(points, search)).relu()
            if self.mixed is not None:
                hidden = hidden @ self.mixed(hidden, search)
            hidden = largest(self.second(hidden).relu(), self.third, search).relu()
            hidden = self.dropped(self.fifth(self.fourth(hidden).relu()).relu())
            joints: Tensor = self.last(hidden).unflatten(-1, (JOINTS, 3))
        return joints


def _of_relu(layer: nn.Linear) -> None:
    """Weights that keep the size of numbers through a layer and its ReLU (He et al. 2015): there is no
    batch normalisation that would bring them back."""
    nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
    nn.init.zeros_(layer.bias)


class Frame(NamedTuple):
    """Frames that sets of points are seen from, so that answers move, grow and turn with them.

    middle: ``(rows, 1, 3)`` metres, the mean of the points. unit: ``(rows, 1, 1)`` metres, their root mean
    square distance from it. turn: ``(rows, 3, 3)``, see ``level_axes``; None: the world's directions.
    """

    middle: Tensor
    unit: Tensor
    turn: Tensor | None

    @classmethod
    def of(cls, points: Tensor, principal: bool) -> Self:
        middle = points.mean(1, keepdim=True)
        away = points - middle
        unit = away.square().sum(-1, keepdim=True).mean(1, keepdim=True).sqrt().clamp_min(_SMALLEST)
        return cls(middle, unit, level_axes(away) if principal else None)

    def into(self, places: Tensor) -> Tensor:
        """Places ``(rows, n, 3)`` metres as they look from here."""
        local = (places - self.middle) / self.unit
        return local if self.turn is None else local @ self.turn

    def back(self, local: Tensor) -> Tensor:
        """The inverse of ``into``."""
        turned = local if self.turn is None else local @ self.turn.transpose(1, 2)
        return self.middle + self.unit * turned


def level_axes(away: Tensor) -> Tensor:
    """``(rows, 3, 3)``: points ``(rows, V, 3)`` about their mean, times this, vary most along x of all
    level directions. Which end of the body is on which side is left open.
    """
    x, z = away[..., 0], away[..., 2]
    angle = 0.5 * torch.atan2(2.0 * (x * z).mean(1), (x * x - z * z).mean(1))
    cos, sin, none = angle.cos(), angle.sin(), torch.zeros_like(angle)
    rows = [cos, none, -sin, none, none + 1.0, none, sin, none, cos]
    return torch.stack(rows, -1).view(-1, 3, 3)


def largest(points: Tensor, layer: nn.Linear, search: torch.dtype = torch.float32) -> Tensor:
    """``(rows, out)``: the maximum over points of ``layer`` applied to points ``(rows, V, in)``.

    Only the points where the maximum is have a gradient: they are looked for without one, row by row, so
    that a row fits into the processor's cache, and their numbers are computed once more with it. This
    spares two thirds of a training step.

    search: precision in which they are looked for. The numbers themselves have the points' own.
    """
    weight = layer.weight
    if not torch.is_grad_enabled():
        return torch.stack([(each @ weight.t()).amax(0) for each in points]) + layer.bias
    with torch.no_grad():
        rough = weight.to(search)
        # the indices of ``max`` take half the time of ``argmax``
        where = torch.stack([(rough @ each.t()).max(1)[1] for each in points.to(search)])
    rows, count, size = points.shape
    flat = (where + count * torch.arange(rows, device=where.device).unsqueeze(1)).flatten()
    chosen = points.reshape(-1, size).index_select(0, flat).view(rows, -1, size)
    return (chosen * weight).sum(-1) + layer.bias
