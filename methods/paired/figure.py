"""Bodies as the network sees them: nothing about them lies outside of what it was trained on.

Generated bodies rest in one ideal T-pose: legs are straight, arms are level, ankles are near the floor. On
rigs that people make, thighs slant, soles are thick, and arms droop. All this is the body's shape, which a
copy of rotations keeps; a network that has never seen it would take it for an error of the pose.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.motion.body22 import JOINTS, PARENTS
from retarget_bench.motion.structures import BODY22
from retarget_bench.training.layers.indices import indices

from .augmentation import SPARED, bones_without, missing

_LEGS = [BODY22.index(f"{side}_{part}") for side in ("left", "right") for part in ("up_leg", "leg", "foot")]
_ABOVE = [max(parent, 0) for parent in PARENTS]


class Figure(NamedTuple):
    """A body as the network sees it.

    offsets: ``(rows, 22, 3)`` metres. height: ``(rows, 1)`` metres. ankle: ``(rows, 1)`` metres, how high
    ankles are above the floor in the reference pose. drop: ``(rows, 1)``, how much lower ankles are than
    the hips, in metres. stretch: ``(rows, 1)``, the drop of this body over the true one's.
    """

    offsets: Tensor
    height: Tensor
    ankle: Tensor
    drop: Tensor
    stretch: Tensor

    def level(self, hips: Tensor) -> Tensor:
        """Heights of hips ``(rows, frames)`` above standing ankles, in heights of the body."""
        return (hips - self.ankle) * self.stretch / self.height


class Figures(nn.Module):
    """Directions and lengths of the bones of the training bodies: of bones that hang from a joint with a
    bone of its own, and of those that also bridge a joint that the body lacks."""

    directions: Tensor
    cosines: Tensor
    lengths: Tensor

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("directions", torch.zeros(2, JOINTS, 3))
        self.register_buffer("cosines", torch.ones(2, JOINTS, 1))
        self.register_buffer("lengths", torch.zeros(2, 2, JOINTS))

    def learn(self, bodies: Iterable[tuple[np.ndarray, np.ndarray]]) -> None:
        """Take over the ranges of bodies, each with its bones ``(22, 3)`` and lengths ``(2,)``, metres."""
        lacking: list[list[str]] = [[], *([name] for name in SPARED), list(SPARED)]
        lacks = torch.from_numpy(np.stack([missing(names) for names in lacking]))
        own = torch.from_numpy(np.stack([offsets / size[0] for offsets, size in bodies]).astype(np.float32))
        bones = bones_without(own[:, None].expand(-1, len(lacking), -1, -1), lacks).flatten(0, 1)
        length = bones.norm(dim=-1)  # (bodies, 22)
        bridging = _bridging(bones)
        for kind in (0, 1):
            of_kind = ((bridging == bool(kind)) & (length > 0)).unsqueeze(-1)
            unit = bones / length.clamp(min=1e-9).unsqueeze(-1) * of_kind
            mean = nn.functional.normalize(unit.sum(0), dim=-1)
            cosine = torch.where(of_kind, (unit * mean).sum(-1, keepdim=True), 1.0)
            self.directions[kind], self.cosines[kind] = mean, cosine.amin(0)
            shares = length.unsqueeze(-1)
            self.lengths[kind, 0] = torch.where(of_kind, shares, torch.inf).amin(0).squeeze(-1)
            self.lengths[kind, 1] = torch.where(of_kind, shares, 0.0).amax(0).squeeze(-1)
        self.lengths.clamp_(max=1.0)

    def forward(self, body: Mapping[str, Tensor]) -> Figure:
        """body: ``offsets`` ``(rows, 22, 3)`` and ``lengths`` ``(rows, 2)``, metres."""
        height = body["lengths"][:, :1]
        bones = body["offsets"] / height.unsqueeze(-1)
        length = bones.norm(dim=-1, keepdim=True)
        kind = _bridging(bones).unsqueeze(-1)
        mean, cosine = (torch.where(kind, each[1], each[0]) for each in (self.directions, self.cosines))
        shortest, longest = (
            torch.where(kind[..., 0], self.lengths[1, end], self.lengths[0, end]) for end in (0, 1)
        )
        unit = bones / length.clamp(min=1e-9)
        along = (unit * mean).sum(-1, keepdim=True)
        aside = nn.functional.normalize(unit - along * mean, dim=-1)
        near = cosine * mean + (1 - cosine.square()).clamp(min=0).sqrt() * aside
        unit = torch.where(along < cosine, near, unit)
        clipped = torch.minimum(torch.maximum(length, shortest.unsqueeze(-1)), longest.unsqueeze(-1))
        clipped = torch.where(length > 0, clipped, 0.0) * unit * height.unsqueeze(-1)
        drop = _drop(body["offsets"])
        return Figure(
            clipped, height, body["lengths"][:, 1:] - drop, drop, _drop(clipped) / drop.clamp(min=1e-6)
        )


def _bridging(bones: Tensor) -> Tensor:
    """``(rows, 22)``: bones whose parent is a joint of no length, other than the hips."""
    none = ~bones.any(-1)
    none[:, 0] = False
    return none[:, indices(_ABOVE, none)]


def _drop(offsets: Tensor) -> Tensor:
    """``(rows, 1)`` metres: from the hips down to the ankles, the mean of both legs."""
    legs = offsets[:, indices(_LEGS, offsets), 1].view(-1, 2, 3)
    return -legs.sum(-1).mean(-1, keepdim=True)
