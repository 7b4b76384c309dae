"""Indices of joints that stay on a device."""

from collections.abc import Sequence
from functools import lru_cache

import torch
from torch import Tensor


def indices(numbers: Sequence[int], like: Tensor) -> Tensor:
    """Numbers as a tensor on the device of another.

    Each time that torch indexes with a list, it copies it to the GPU and waits; this is copied once.
    """
    return _cached(tuple(numbers), like.device)


@lru_cache(maxsize=1024)
@torch.inference_mode(False)  # what is kept has to serve where gradients are wanted, too
def _cached(numbers: tuple[int, ...], device: torch.device) -> Tensor:
    return torch.tensor(numbers, dtype=torch.long, device=device)
