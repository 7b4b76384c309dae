"""The losses of SAME, as released: of poses and moves on the target, over a window."""

from typing import NamedTuple

import torch
from torch import Tensor

from .features import CONTACT, FPS, POSITION, ROOT, ROTATION
from .graph import Graphs, matrices, places
from .network import Answer

WEIGHTS = {
    "rotations": 5.0,
    "positions": 0.01,
    "root": 10.0,
    "velocities": 1.0,
    "contacts": 1.0,
    "still": 6.0,
    "codes": 1.0,
    "floor": 0.1,
    "slide": 6.0,
    "jerk": 0.2,
}
NEAR = 3.0
"""cm above the floor, up to which sliding counts, the more the lower."""
KM = 1e-5
"""Kilometres of a centimetre: jerks are in km/s^3."""


class Performed(NamedTuple):
    """A window on bodies, over ``(nodes, frames)``; cm.

    turned: ``(3, 3)`` local rotations. local: ``(3,)`` places, the hips on the vertical axis and facing
    ahead. world: ``(3,)`` places. root: ``(rows, frames, 4)``. contact: ``()``.
    """

    turned: Tensor
    local: Tensor
    world: Tensor
    root: Tensor
    contact: Tensor


def answered(output: Answer, graphs: Graphs) -> Performed:
    """A network's answer on its bodies."""
    turned = matrices(output.columns)
    local = places(graphs, turned, output.root[..., 3])
    return Performed(turned, local, world(local, output.root, graphs), output.root, output.contact)


def performed(features: Tensor, graphs: Graphs) -> Performed:
    """The motion in features ``(nodes, frames, 26)``."""
    root, local = features[graphs.hips][..., ROOT], features[..., POSITION]
    contact = features[..., CONTACT.start]
    return Performed(matrices(features[..., ROTATION]), local, world(local, root, graphs), root, contact)


def world(local: Tensor, root: Tensor, graphs: Graphs) -> Tensor:
    """``(nodes, frames, 3)`` places ``local`` after the moves of the window, the first frame's included.

    local: ``(nodes, frames, 3)``. root: ``(rows, frames, 4)``.
    """
    turn = root[..., 0].cumsum(1)
    left, ahead = _turned(root[..., 1], root[..., 2], turn - root[..., 0])
    x, z = _turned(local[..., 0], local[..., 2], turn[graphs.row])
    return torch.stack([x + left.cumsum(1)[graphs.row], local[..., 1], z + ahead.cumsum(1)[graphs.row]], -1)


def terms(answer: Performed, truth: Performed, graphs: Graphs, unit: Tensor) -> dict[str, Tensor]:
    """Name -> loss, unweighted; ``codes`` is not among them. unit: ``(4,)`` deviations of ``root``."""
    velocity, real = answer.world.diff(dim=1), truth.world.diff(dim=1)
    speed = torch.linalg.vector_norm(velocity, dim=-1)
    height = answer.world[..., 1]
    low = (1.0 - height[:, 1:] / NEAR).clamp(0.0, 1.0)
    jerk = answer.world.diff(n=3, dim=1) * (KM * FPS**3)
    turning = graphs.turning
    return {
        "rotations": _squares(answer.turned[turning], truth.turned[turning]),
        "positions": _squares(answer.local, truth.local),
        "root": _squares(answer.root / unit, truth.root / unit),
        "velocities": _squares(velocity, real),
        "contacts": _squares(answer.contact, truth.contact),
        "still": (truth.contact[:, 1:] * speed).mean(),
        "floor": height.clamp(max=0.0).square().mean(),
        "slide": (speed * low).square().mean(),
        "jerk": jerk.square().sum(-1).mean(),
    }


def _turned(left: Tensor, ahead: Tensor, angle: Tensor) -> tuple[Tensor, Tensor]:
    cos, sin = angle.cos(), angle.sin()
    return left * cos + ahead * sin, ahead * cos - left * sin


def _squares(predicted: Tensor, truth: Tensor) -> Tensor:
    return (predicted - truth).square().mean()
