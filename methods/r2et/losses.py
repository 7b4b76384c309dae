"""Losses of R2ET's skeleton-aware network (Zhang et al., CVPR 2023, section 3.4), as the published code
weights them: sums over the numbers of a frame, means over real frames ``(rows, frames)``."""

import torch
from torch import Tensor

from retarget_bench.motion.structures import BODY22

TWIST, ADVERSARIAL, SEMANTICS = 10.0, 2.0, 100.0
_LIMBS = [
    BODY22.index(f"{side}_{part}")
    for side in ("left", "right")
    for part in ("leg", "foot", "arm", "forearm")
]


def joint_weights() -> Tensor:
    """``(22,)``: positions of knees, ankles, shoulders and elbows count twice."""
    weights = torch.ones(len(BODY22))
    weights[_LIMBS] = 2.0
    return weights


def frame_mean(values: Tensor, real: Tensor) -> Tensor:
    """The mean over real frames of the sum over the numbers of a frame ``(rows, frames, ...)``; 0 where
    there is none."""
    sums = values.flatten(2).sum(2)
    return torch.where(real, sums, sums.new_zeros(())).sum() / real.sum().clamp(min=1)


def positions(predicted: Tensor, truth: Tensor, weights: Tensor, real: Tensor) -> Tensor:
    """Squared differences of positions ``(rows, frames, 22, 3)``, weighted by joint."""
    return frame_mean((predicted - truth).square() * weights.unsqueeze(-1), real)


def rotations(predicted: Tensor, truth: Tensor, real: Tensor) -> Tensor:
    """Squared differences of quaternions ``(rows, frames, 22, 4)``, each ``truth`` with the sign that
    brings it nearer: q and -q are one rotation."""
    near = torch.where((predicted * truth).sum(-1, keepdim=True) < 0, -truth, truth)
    return frame_mean((predicted - near).square(), real)


def semantics_matrix(positions: Tensor) -> Tensor:
    """``(..., 22, 22)`` distances between all joints ``(..., 22, 3)``, every row divided by its sum.

    The paper divides by the body's height before; that cancels out.
    """
    apart = torch.cdist(positions, positions, compute_mode="donot_use_mm_for_euclid_dist")
    return apart / apart.sum(-1, keepdim=True).clamp(min=1e-6)


def semantics(predicted: Tensor, truth: Tensor, real: Tensor) -> Tensor:
    """Squared differences of the semantics matrices of positions ``(rows, frames, 22, 3)``."""
    return frame_mean((semantics_matrix(predicted) - semantics_matrix(truth)).square(), real)
