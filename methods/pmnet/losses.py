"""Losses of PMnet, as the published code has them. Time comes first: ``(frames, rows, ...)``.

Sums over the numbers of a frame and over real frames, in normalised units; ``training.py`` divides them.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from retarget_bench.training.layers.kinematic.features import Variant
from retarget_bench.training.layers.kinematic.pose import MOVES

TWIST, FEATURES, ADVERSARIAL = 10.0, 20.0, 2.0
LIMBS = ("_leg", "_foot", "_arm", "_forearm")
"""Ends of the roles of joints that weigh twice: knees, feet, arms and fore-arms."""
UPPER = "_up_leg"


def emphasis(roles: Sequence[str | None]) -> list[float]:
    """The weight of each joint."""
    names = [role or "" for role in roles]
    return [2.0 if each.endswith(LIMBS) and not each.endswith(UPPER) else 1.0 for each in names]


def places(a: Tensor, b: Tensor, weights: Tensor, real: Tensor) -> Tensor:
    """Squared differences of places ``(frames, rows, 3 joints)``, times weights ``(joints,)``."""
    squares = (a - b).square().reshape(*a.shape[:-1], -1, 3).sum(-1) @ weights
    return (squares * real).sum()


def squares(a: Tensor, b: Tensor, real: Tensor) -> Tensor:
    """Squared differences of ``(frames, rows, numbers)``."""
    return ((a - b).square().sum(-1) * real).sum()


def trajectory(places: Tensor, moves: Tensor, variant: Variant) -> Tensor:
    """``(rows, frames, 3)``, rows first: the mean of all joints in the world, which the discriminator sees.

    places: ``(frames, rows, 3 joints)``. moves: ``(frames, rows, 4)``, of ``released`` poses those to the
    next frame, of ours those since the frame before. A body begins at the origin and faces ahead.
    """
    still = torch.zeros_like(moves[:1])
    moves = torch.cat([still, moves[:-1] if variant == "released" else moves[1:]])
    turn = moves[..., MOVES - 1].cumsum(0)
    middle = _turned(places.reshape(*places.shape[:-1], -1, 3).mean(-2), turn)
    return (middle + _turned(moves[..., : MOVES - 1], turn).cumsum(0)).transpose(0, 1)


def _turned(vectors: Tensor, turn: Tensor) -> Tensor:
    """Left, up, forward ``(..., 3)`` as vectors of the world, where the body faces by angles ``(...)``."""
    (left, up, forward), sine, cosine = vectors.unbind(-1), turn.sin(), turn.cos()
    return torch.stack([left * cosine + forward * sine, up, forward * cosine - left * sine], -1)
