"""HuMoT's losses: eq. 1 and 2, for rows that differ in joints and frames."""

import torch
from torch import Tensor

from retarget_bench.training.contract import Batch
from retarget_bench.training.layers.masks import masked_mean

SHORT = 1e-4
"""Metres: a bone this short has no length to be a multiple of."""


def reconstruction(answer: Tensor, truth: Tensor, joints: Tensor, frames: Tensor) -> Tensor:
    """Eq. 1: the mean squared distance of joints, m^2.

    answer, truth: ``(rows, frames, joints, 3)`` metres. joints, frames: ``(rows, joints)`` and
    ``(rows, frames)`` bool, what is real.
    """
    real = frames.unsqueeze(2) & joints.unsqueeze(1)
    apart = (answer - truth).square().sum(-1)
    return masked_mean(apart, real, (1, 2)).mean()


def bones(answer: Tensor, truth: Tensor, parents: Tensor, frames: Tensor) -> Tensor:
    """Eq. 2: the variance over time of predicted over true bone lengths, the mean over bones.

    parents: ``(rows, joints)``, -1 where there is no bone: at padding, and where no ancestor is kept.
    """
    above = parents.clamp(min=0)[:, None, :, None].expand(-1, answer.shape[1], -1, 3)
    true = torch.linalg.vector_norm(truth - truth.gather(2, above), dim=-1)
    long = (parents >= 0) & ((true > SHORT) | ~frames.unsqueeze(2)).all(1)
    vectors = torch.where(long[:, None, :, None], answer - answer.gather(2, above), 1.0)
    ratio = torch.linalg.vector_norm(vectors, dim=-1) / torch.where(long.unsqueeze(1), true, 1.0).clamp(
        min=SHORT
    )
    real = frames.unsqueeze(2).expand_as(ratio)
    mean = masked_mean(ratio, real, (1,)).unsqueeze(1)
    varied = masked_mean((ratio - mean).square(), real, (1,))
    return masked_mean(varied, long, (1,)).mean()


def losses(answer: Tensor, target: Batch, frames: Tensor, consistency: float) -> dict[str, Tensor]:
    """``reconstruction``, and ``bones`` with its weight unless that is zero."""
    truth = target["places"]
    terms = {"reconstruction": reconstruction(answer, truth, target["joints"], frames)}
    if consistency:
        terms["bones"] = consistency * bones(answer, truth, target["parents"], frames)
    return terms
