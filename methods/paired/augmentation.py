"""Other bodies out of a body: its mirror image, other reference poses, bodies without some joints."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import JOINTS, PARENTS, folded
from retarget_bench.motion.structures import BODY22

from .features import MIRRORED
from .pose import END, TOES

Motions = Mapping[str, Tensor]
"""Motions as ``RoleBody.see`` gives them, over any number of rows before the frames."""

_FLIPPED = torch.tensor([-1.0, 1.0, 1.0])
SPARED: Mapping[str, tuple[str, ...]] = {
    "toes": ("left_toe", "right_toe"),
    "collar bones": ("left_shoulder", "right_shoulder"),
    "spine": ("spine_3",),
    "neck": ("neck",),
}
"""Joints that bodies may lack."""
_CHANCE = {"toes": 0.2, "collar bones": 0.2, "spine": 0.2, "neck": 0.08}
_TOES = [1, 3]
"""Columns of ``planted``."""
PLAIN = 0.2
"""Share of bodies whose reference pose is left as it is."""
UNALIGNED = 0.07
"""Radians: standard deviation, over other bodies, of the size of the turns of their joints in the reference
pose; feet and hands turn twice as much."""


def mirrored(motions: Motions) -> dict[str, Tensor]:
    """Motions of the mirrored bodies."""
    return {
        "rotations": motions["rotations"][..., MIRRORED, :] * torch.tensor([1.0, 1.0, -1.0, -1.0]),
        "hips": motions["hips"] * _FLIPPED,
        "turn": motions["turn"] * torch.tensor([1.0, -1.0]),
        "planted": motions["planted"][..., [2, 3, 0, 1]],
        "near": motions["near"].flip(-1),
    }


def mirrored_bones(offsets: Tensor) -> Tensor:
    """Bones ``(..., 22, 3)`` of the mirrored bodies."""
    return offsets[..., MIRRORED, :] * _FLIPPED


def turns(numbers: np.random.Generator, rows: int) -> Tensor:
    """``(rows, 22, 4)`` by which the joints of bodies are turned in their reference poses from where they
    ought to be: little, as on rigs that people make."""
    sizes = UNALIGNED * numbers.standard_normal((rows, 1, 1))
    sizes *= numbers.random((rows, 1, 1)) >= PLAIN
    vectors = sizes * numbers.standard_normal((rows, JOINTS, 3))
    vectors[:, END] *= 2.0
    return torch.from_numpy(rotation.from_rotation_vector(vectors).astype(np.float32))


def reposed(rotations: Tensor, offsets: Tensor, turned: Tensor) -> tuple[Tensor, Tensor]:
    """The same motions ``(..., frames, 22, 4)`` and bones ``(..., 22, 3)`` of the same bodies, their
    reference poses turned by ``turned`` ``(..., 22, 4)``: every joint stays where it is in the world.
    Joints of no length still do not turn."""
    parts = list(turned.unbind(-2))
    for joint in range(1, JOINTS):
        still = (offsets[..., joint, :] == 0).all(-1, keepdim=True)
        parts[joint] = torch.where(still, parts[PARENTS[joint]], parts[joint])
    turned = torch.stack(parts, -2)
    back = rotation.conjugate(turned[..., list(PARENTS[1:]), :])
    bones = torch.cat([offsets[..., :1, :], rotation.rotate(back, offsets[..., 1:, :])], -2)
    moved = rotation.multiply(rotations, turned.unsqueeze(-3))
    below = rotation.multiply(back.unsqueeze(-3), moved[..., 1:, :])
    return torch.cat([moved[..., :1, :], below], -2), bones


def spare(numbers: np.random.Generator) -> list[str]:
    """Names of ``SPARED`` that a body shall do without: never toes, collar bones and spine at once, since
    that structure is one that the puppets' test holds out."""
    names = [name for name, chance in _CHANCE.items() if numbers.random() < chance]
    if {"toes", "collar bones", "spine"} <= set(names):
        del names[numbers.integers(3)]
    return names


def missing(names: Sequence[str]) -> np.ndarray:
    """``(22,)`` bool: the joints of these of ``SPARED``."""
    return np.isin(BODY22, [role for name in names for role in SPARED[name]])


def without(motions: Motions, offsets: Tensor, lacks: Tensor) -> tuple[dict[str, Tensor], Tensor]:
    """Motions and bones of bodies that lack joints, ``lacks`` ``(..., 22)`` bool: what hangs from them
    hangs, as it is at rest, from what they hung from."""
    rotations = folded(motions["rotations"], lacks.unsqueeze(-2))
    planted = motions["planted"].clone()
    planted[..., _TOES] *= ~lacks[..., TOES].unsqueeze(-2)
    return {**motions, "rotations": rotations, "planted": planted}, bones_without(offsets, lacks)


def bones_without(offsets: Tensor, lacks: Tensor) -> Tensor:
    """The bones ``(..., 22, 3)`` of bodies that lack joints."""
    parts = list(offsets.unbind(-2))
    for joint, lacking in enumerate(lacks.unbind(-1)):  # parents first
        for child in (child for child, parent in enumerate(PARENTS) if parent == joint):
            parts[child] = torch.where(lacking.unsqueeze(-1), parts[child] + parts[joint], parts[child])
        parts[joint] = torch.where(lacking.unsqueeze(-1), 0.0, parts[joint])
    return torch.stack(parts, -2)
