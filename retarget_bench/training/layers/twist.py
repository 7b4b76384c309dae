"""The loss on joints that twist (Villegas et al., CVPR 2018, section 3.3)."""

from math import radians

import torch
from torch import Tensor
from torch.nn import functional

LIMIT = radians(100.0)
"""Beyond this angle about its vertical axis a joint counts as twisted."""


def twist(turns: Tensor, real: Tensor) -> Tensor:
    """The mean over joints, summed over real frames, of the squared angle beyond the limit, radians.

    turns: ``(..., joints, 4)`` unit; real: ``(...)``. The angle is the first of the order YZX:
    q = q_y q_z q_x.
    """
    w, x, y, z = turns.unbind(-1)
    sine, cosine = 2.0 * (w * y - x * z), w * w + x * x - y * y - z * z
    locked = sine.square() + cosine.square() < 1e-12
    angle = torch.atan2(sine, torch.where(locked, torch.ones_like(cosine), cosine))
    return (functional.relu(angle.abs() - LIMIT).square().mean(-1) * real).sum()
