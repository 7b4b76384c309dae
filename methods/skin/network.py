"""The skinning predictor (Table 7 of the paper): from where a point lies to its shares of 22 joints."""

from typing import Literal

import torch
from torch import Tensor, nn

from retarget_bench.motion.body22 import JOINTS

Inputs = Literal["distances", "vectors"]
HIDDEN, DROPOUT = 256, 0.2
_SHARP, _START = 10.0, 0.02
"""Before training: how fast shares fall with the distance, and the deviation of all other last weights."""


class SkinningPredictor(nn.Module):
    """A field of skinning weights around a skeleton in T-pose.

    inputs: ``distances`` of a point to the joints, as section 3.4 has it (77,334 parameters), or
    ``vectors`` from them, the 66 numbers of Table 7 (88,598). Both in units of the skeleton's size.
    """

    def __init__(self, inputs: Inputs = "distances", dropout: float = DROPOUT) -> None:
        super().__init__()
        self.inputs = inputs
        self.first = nn.Linear(JOINTS if inputs == "distances" else 3 * JOINTS, HIDDEN)
        self.second, self.last = nn.Linear(HIDDEN, HIDDEN), nn.Linear(HIDDEN, JOINTS)
        self.dropped = nn.Dropout(dropout)
        self._begin_near_joints()

    @torch.no_grad()
    def _begin_near_joints(self) -> None:
        """Weights with which a point follows the joints that it is near. From random ones, training ends
        where whole limbs follow the trunk, five times as far off."""
        for layer in (self.first, self.second):
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
        nn.init.normal_(self.last.weight, std=_START)
        nn.init.zeros_(self.last.bias)
        parts = torch.eye(self.first.in_features)
        if self.inputs == "vectors":  # the sum of the parts' sizes in the place of the distance
            parts = torch.cat([parts, -parts])
        joint = parts.abs().argmax(1) // (parts.shape[1] // JOINTS)
        used = len(parts)
        self.first.weight[:used] = parts
        self.second.weight[:JOINTS] = 0.0
        self.second.weight[joint, torch.arange(used)] = 1.0
        self.last.weight[:, :JOINTS] = -_SHARP * torch.eye(JOINTS)

    def forward(self, points: Tensor, joints: Tensor) -> Tensor:
        """Shares ``(rows, V, 22)``, summing to 1, of points ``(rows, V, 3)`` about joints ``(rows, 22, 3)``
        in T-pose, metres."""
        apart = (points.unsqueeze(2) - joints.unsqueeze(1)) / size(joints)[:, None, None, None]
        near = torch.linalg.vector_norm(apart, dim=-1)
        inputs = near if self.inputs == "distances" else apart.flatten(2)
        hidden = self.dropped(self.first(inputs).relu())
        hidden = self.dropped(self.second(hidden).relu())
        return self.last(hidden).float().softmax(-1)


def size(joints: Tensor) -> Tensor:
    """``(rows,)`` metres: root mean square distance of joints ``(rows, 22, 3)`` from their mean."""
    away = joints - joints.mean(1, keepdim=True)
    return away.square().sum(-1).mean(1).sqrt()
