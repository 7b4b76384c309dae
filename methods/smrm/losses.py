"""The terms of eq. 2. Every mean is over real frames; what stands behind a row's length never counts."""

import torch
from torch import Tensor

from retarget_bench.training.layers.masks import masked_mean


def mean(values: Tensor, real: Tensor) -> Tensor:
    """The mean of values ``(rows, frames, ...)`` over real frames ``(rows, frames)``; 0 where none is."""
    return masked_mean(values.flatten(2).mean(2), real, (0, 1))


def squares(a: Tensor, b: Tensor, real: Tensor) -> Tensor:
    """Mean squared difference of ``(rows, frames, ...)``."""
    return mean((a - b).square(), real)


def rotations(predicted: Tensor, truth: Tensor, real: Tensor) -> Tensor:
    """Mean squared difference of quaternions ``(rows, frames, joints, 4)``, each ``truth`` with the sign
    that brings it nearer: q and -q are one rotation."""
    near = torch.where((predicted * truth).sum(-1, keepdim=True) < 0, -truth, truth)
    return squares(predicted, near, real)


def acceleration(path: Tensor, real: Tensor) -> Tensor:
    """Mean length of the second difference of places ``(rows, frames, 3)``, per frame squared."""
    if path.shape[1] < 3:
        return path.sum() * 0.0
    bend = path.diff(n=2, dim=1)
    return mean(torch.linalg.vector_norm(bend, dim=-1, keepdim=True), real[:, 2:])
