"""Retargeting by PAN: whole clips, or long ones in pieces that overlap by what the networks see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from .structure import Structure, arranged

PIECE = 2048
"""Frames that go through the networks at once: memory does not grow with a clip's length."""
MARGIN = 64
"""Frames on both sides of a piece that are seen with it: more than four convolutions reach."""
STEP = 4
"""What a number of frames has to be a multiple of."""
LEAST = 16
"""Frames: shorter clips are lengthened, since convolutions mirror what is beyond the ends."""


def answered(
    source: Structure,
    target: Structure,
    slots: np.ndarray,
    bones: np.ndarray,
    statistics: Statistic,
    carried: bool,
) -> np.ndarray:
    """``(rows, frames, slots + 1, 4)`` of the targets.

    slots: ``(rows, frames, slots + 1, 4)`` of the sources. bones: ``(rows, slots + 1, 3)``.
    statistics: mean and deviation of each source and of each target. carried: see ``Form.path``.
    """
    frames = slots.shape[1]
    device = target.mean.device
    whole = torch.from_numpy(_lengthened(slots)).to(device)
    given, wanted = (each.to(device) for each in statistics)
    seen = (whole - given[:, :1]) / given[:, 1:]
    body = torch.from_numpy(bones).to(device)
    out = []
    with torch.inference_mode():
        for first in range(0, whole.shape[1], PIECE):
            start, end = max(first - MARGIN, 0), min(first + PIECE + MARGIN, whole.shape[1])
            code = arranged(source.encoder(seen[:, start:end]), source.layout, target.layout)
            answer = target.answer(code, body)
            out.append(answer[:, first - start :][:, :PIECE])
    plain = torch.cat(out, 1)[:, :frames] * wanted[:, 1:] + wanted[:, :1]
    if carried:
        plain[:, :, -1] += whole[:, :frames, -1] - wanted[:, 0, -1:]
    return np.asarray(plain.cpu().numpy())


Statistic = tuple[Tensor, Tensor]
"""Each ``(rows, 2, slots + 1, 4)``: mean, deviation."""


def _lengthened(slots: np.ndarray) -> np.ndarray:
    """With the last frame repeated up to a number of frames that the networks take."""
    frames = slots.shape[1]
    wanted = max(-(-frames // STEP) * STEP, LEAST)
    return np.pad(slots, ((0, 0), (0, wanted - frames), (0, 0), (0, 0)), mode="edge").astype(np.float32)


def rows_of(structures: Mapping[str, Structure], name: str, which: Sequence[int]) -> Tensor:
    """``(rows, 2, slots + 1, 4)`` a structure's statistics."""
    chosen = structures[name]
    return torch.stack([chosen.mean[list(which)], chosen.deviation[list(which)]], 1)
