"""The network: temporal convolutions over what is seen of a motion, steered by both bodies."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import torch
from torch import Tensor, nn
from torch.nn import functional

from retarget_bench.motion.body22 import JOINTS, SKELETON
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training.layers.indices import indices
from retarget_bench.training.weights import fill

from .features import FEET, FPS
from .figure import Figure, Figures
from .pose import ARMS, END, LEGS, UPPER, Goals, Posed, copied, multiply, posed

INPUTS = 2 * 3 * JOINTS + 6 * JOINTS + 5 + len(FEET)
BODIES = 2 * 3 * JOINTS + 2
SIZES = {"hips": 3, "limbs": 3 * 4, "swivel": 4}
"""Part of a correction -> how many numbers it has in a frame."""
LARGEST = 0.15
"""Of the logarithm of the path's scale."""


class Correction(NamedTuple):
    """Changes of a copied motion, over ``(rows, frames)``.

    hips, limbs: ``(3,)`` and ``(4, 3)`` left, up, forward, in heights. swivel: ``(4,)`` radians.
    scale: ``(rows,)`` by which the level path is longer.
    """

    hips: Tensor
    limbs: Tensor
    swivel: Tensor
    scale: Tensor

    def where_near(self, near: Tensor) -> Self:
        """The same without what arms do where hands touch nothing. near: ``(rows, frames, 2)`` 0 to 1."""
        share = torch.cat([torch.ones_like(near), near], -1)
        return self._replace(limbs=self.limbs * share[..., None], swivel=self.swivel * share)

    def on_the_path(self) -> Self:
        """The same with the hips left where the copy has them."""
        return self._replace(hips=torch.zeros_like(self.hips), scale=torch.ones_like(self.scale))


class Block(nn.Module):
    """A convolution over time and one over channels, with what the bodies ask for in between."""

    def __init__(self, width: int, reach: int) -> None:
        super().__init__()
        self.reach = reach
        self.norm = nn.LayerNorm(width)
        self.time = nn.Linear(3 * width, width)
        self.out = nn.Linear(width, width)

    def forward(self, hidden: Tensor, scale: Tensor, shift: Tensor, real: Tensor) -> Tensor:
        """hidden: ``(rows, frames, width)``. scale, shift: ``(rows, 1, width)`` by the bodies.
        real: ``(rows, frames, 1)``, 0 at padding."""
        scaled = (self.norm(hidden) * (1 + scale) + shift) * real
        padded = functional.pad(scaled, (0, 0, self.reach, self.reach))
        frames = scaled.shape[1]
        around = [padded[:, first : first + frames] for first in (0, self.reach, 2 * self.reach)]
        return hidden + self.out(functional.silu(self.time(torch.cat(around, -1))))


class Corrector(nn.Module):
    """From a motion's copy to the correction of it."""

    def __init__(self, width: int = 256, reaches: tuple[int, ...] = (1, 2, 4, 8, 4, 2, 1)) -> None:
        super().__init__()
        self.enter = nn.Linear(INPUTS, width)
        self.bodies = nn.Sequential(nn.Linear(BODIES, 256), nn.SiLU(), nn.Linear(256, 128), nn.SiLU())
        self.join = nn.Linear(128, width)
        self.steer = nn.Linear(128, 2 * width * len(reaches))
        self.path = nn.Linear(128, 1)
        self.blocks = nn.ModuleList(Block(width, reach) for reach in reaches)
        self.norm = nn.LayerNorm(width)
        self.leave = nn.Linear(width, sum(SIZES.values()))
        for layer in (self.path, self.leave):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        self.figures = Figures()
        self.tree = Tree.of(SKELETON)
        self.reach = sum(reaches)

    def _apply(self, fn: Any, recurse: bool = True) -> Self:
        """Move to another device, the tree as well."""
        super()._apply(fn, recurse)  # type: ignore[no-untyped-call]
        self.tree = self.tree.to(self.enter.weight.device)
        return self

    def take(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over exported tensors. Raises BenchError where they are another network's."""
        fill(self, tensors, "paired")

    def forward(self, inputs: Tensor, bodies: Tensor, real: Tensor) -> Correction:
        """inputs: ``(rows, frames, INPUTS)``. bodies: ``(rows, BODIES)``. real: ``(rows, frames)`` bool."""
        code = self.bodies(bodies)
        mask = real.unsqueeze(-1).to(inputs.dtype)
        steering = self.steer(code).unsqueeze(1).chunk(2 * len(self.blocks), dim=-1)
        hidden = self.enter(inputs) + self.join(code).unsqueeze(1)
        for number, block in enumerate(self.blocks):
            hidden = block(hidden, steering[2 * number], steering[2 * number + 1], mask)
        out = self.leave(self.norm(hidden)).float()
        hips, limbs, swivel = (0.1 * out).split(list(SIZES.values()), dim=-1)
        scale = torch.exp(LARGEST * torch.tanh(self.path(code).float().squeeze(-1)))
        return Correction(hips, limbs.unflatten(-1, (-1, 3)), 5 * swivel, scale)


def ahead(vectors: Tensor, turn: Tensor) -> Tensor:
    """Vectors ``(..., 3)`` of the world as left, up, forward of a facing direction ``(..., 2)``, the parts
    of a unit complex number."""
    x, y, z = vectors.unbind(-1)
    cos, sin = turn.unbind(-1)
    return torch.stack([x * cos - z * sin, y, z * cos + x * sin], -1)


def world(vectors: Tensor, turn: Tensor) -> Tensor:
    """The inverse of ``ahead``."""
    return ahead(vectors, torch.stack([turn[..., 0], -turn[..., 1]], -1))


def columns(quaternions: Tensor) -> Tensor:
    """``(..., 6)`` the first two columns of the rotation matrices of quaternions ``(..., 4)``."""
    w, x, y, z = quaternions.unbind(-1)
    return torch.stack(
        [
            1 - 2 * (y * y + z * z),
            2 * (x * y + w * z),
            2 * (x * z - w * y),
            2 * (x * y - w * z),
            1 - 2 * (x * x + z * z),
            2 * (y * z + w * x),
        ],
        -1,
    )


Arrays = Mapping[str, Tensor]


def inputs_of(network: Corrector, motion: Arrays, source: Arrays, target: Arrays) -> tuple[Tensor, Tensor]:
    """Inputs of the network: of a motion ``(rows, frames, INPUTS)`` and of both bodies ``(rows, BODIES)``.

    motion: ``rotations``, ``hips``, ``turn``, ``planted`` as ``RoleBody.see`` gives them. source, target:
    ``offsets`` ``(rows, 22, 3)`` and ``lengths`` ``(rows, 2)``.
    """
    rotations, turn = motion["rotations"], motion["turn"]
    half = torch.atan2(turn[..., 1], turn[..., 0]) / 2
    zero = torch.zeros_like(half)
    back = torch.stack([half.cos(), zero, -half.sin(), zero], -1)
    facing = torch.cat([multiply(back, rotations[..., 0, :]).unsqueeze(-2), rotations[..., 1:, :]], -2)
    still = torch.zeros_like(motion["hips"])
    bodies = [network.figures(body) for body in (source, target)]
    parts = []
    for body in bodies:
        places, _ = kinematics(network.tree, body.offsets, facing, still)
        parts.append((places / body.height[..., None, None]).flatten(-2))
    parts[1] = 4 * (parts[1] - parts[0])
    hips = motion["hips"]
    step = ahead(hips.diff(dim=1, prepend=hips[:, :1]), turn) * (0.5 * FPS) / bodies[0].height[..., None]
    level = bodies[0].level(hips[..., 1])
    copied = bodies[1].level(_carried(hips[..., 1], *bodies))
    parts += [
        columns(facing).flatten(-2),
        step,
        level[..., None],
        4 * (copied - level)[..., None],
        motion["planted"],
    ]
    bones = [(body.offsets / body.height[..., None]).flatten(-2) for body in bodies]
    legs = [body.drop * body.stretch / body.height for body in bodies]
    return torch.cat(parts, -1), torch.cat([4 * bones[0], 8 * (bones[1] - bones[0]), *legs], -1)


def _carried(hips: Tensor, source: Figure, target: Figure) -> Tensor:
    """Heights of hips ``(rows, frames)`` metres of the copy, from the source's: ankles that stand on the
    floor stay there."""
    return target.ankle + (hips - source.ankle) * target.drop / source.drop.clamp(min=1e-6)


def copy_of(network: Corrector, scale: Tensor, motion: Arrays, source: Arrays, target: Arrays) -> Posed:
    """The source's rotations on the target. Its level path is scaled by the heights of the hips and by
    ``scale`` ``(rows,)``; its height keeps standing ankles on the floor."""
    ratio = (target["lengths"][:, 1] / source["lengths"][:, 1] * scale)[:, None]
    x, y, z = motion["hips"].unbind(-1)
    path = torch.stack(
        [x * ratio, _carried(y, network.figures(source), network.figures(target)), z * ratio], -1
    )
    return copied(network.tree, motion["rotations"], path, target["offsets"])


def goals_of(correction: Correction, start: Posed, turn: Tensor, target: Arrays) -> Goals:
    """The target's goals after a correction of a copied motion."""
    height = target["lengths"][:, :1, None]
    hips = start.positions[:, :, 0] + world(correction.hips, turn) * height
    moves = world(correction.limbs, turn[:, :, None]) * height[..., None]
    first, last = (indices(each, start.positions) for each in (UPPER, END))
    ends = start.positions[:, :, last]
    return Goals(
        hips=hips,
        feet=ends[:, :, LEGS] + moves[:, :, LEGS],
        hands=(ends - start.positions[:, :, first])[:, :, ARMS] + moves[:, :, ARMS],
        swivel=correction.swivel,
        ends=start.turned[:, :, last],
    )


def applied(
    network: Corrector, correction: Correction, motion: Arrays, source: Arrays, target: Arrays
) -> Posed:
    """The copy with its correction, of the arms where hands are near to something."""
    correction = correction.where_near(motion["near"])
    start = copy_of(network, correction.scale, motion, source, target)
    goals = goals_of(correction, start, motion["turn"], target)
    return posed(network.tree, motion["rotations"], target["offsets"], goals)
