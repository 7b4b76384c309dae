"""Losses of NKN. Time comes first: ``(frames, rows, ...)``.

Weights and terms of Villegas et al., CVPR 2018: sums over the numbers of a frame, in normalised units but
for smoothness, over the real frames of a batch. ``training.py`` divides them by all of these; in the
variant ``released``, as in the authors' code, those of rows whose target is the source by the frames of
these rows.
"""

import torch
from torch import Tensor

from retarget_bench.training.layers.kinematic.features import Variant
from retarget_bench.training.layers.kinematic.pose import MOVES

TWIST, SMOOTH, ADVERSARIAL = 10.0, 0.01, 0.001


def apart(a: Tensor, b: Tensor, real: Tensor) -> tuple[Tensor, Tensor]:
    """Sums over real frames of squared differences of poses ``(frames, rows, channels)``: those of places,
    and those of movements. real: ``(frames, rows)``."""
    squares = (a - b).square() * real.unsqueeze(-1)
    return squares[..., :-MOVES].sum(), squares[..., -MOVES:].sum()


def drift(a: Tensor, b: Tensor, real: Tensor) -> Tensor:
    """The sum over real frames of squared differences of all movements so far, which a small error in the
    same direction in every frame makes large. Not in the paper; for poses as in ``apart``."""
    apart = ((a - b)[..., -MOVES:] * real.unsqueeze(-1)).cumsum(0)
    return (apart.square().sum(-1) * real).sum()


def smooth(poses: Tensor, real: Tensor) -> Tensor:
    """The sum over real frames of squared changes of movements. poses: in centimetres and radians."""
    moves = poses[..., -MOVES:]
    return ((moves[1:] - moves[:-1]).square().sum(-1) * real[1:]).sum()


def differences(poses: Tensor, variant: Variant = "own") -> Tensor:
    """``(rows, frames - 1, channels)``, rows first: what the discriminator sees of poses
    ``(frames, rows, channels)`` in centimetres: changes of places, and the movements in between, which
    ``released`` poses have beside the first of two frames and ours beside the second."""
    places = poses[1:, :, :-MOVES] - poses[:-1, :, :-MOVES]
    moves = poses[:-1] if variant == "released" else poses[1:]
    return torch.cat([places, moves[..., -MOVES:]], -1).transpose(0, 1)
