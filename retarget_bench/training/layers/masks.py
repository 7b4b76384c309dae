"""Masks of rows that differ in length, and means over what they keep."""

import torch
from torch import Tensor


def frame_mask(lengths: Tensor, frames: int) -> Tensor:
    """``(rows, frames)`` bool: the first ``lengths`` ``(rows,)`` frames of each row."""
    return torch.arange(frames, device=lengths.device) < lengths.unsqueeze(1)


def time_first_mask(lengths: Tensor, frames: int) -> Tensor:
    """``(frames, rows)``: 1 at the first ``lengths`` ``(rows,)`` frames of each row, 0 at padding."""
    return frame_mask(lengths, frames).T.float()


def masked_mean(values: Tensor, real: Tensor, over: tuple[int, ...]) -> Tensor:
    """The mean over dimensions of the values at which ``real`` is true; 0 where there is none.

    values, real: of one shape. What is masked may be anything, also not a number.
    """
    count = real.sum(over).clamp(min=1)
    return torch.where(real, values, values.new_zeros(())).sum(over) / count
