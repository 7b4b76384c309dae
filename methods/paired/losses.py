"""Losses, our own, of an answer against the right one, in per cent of the target's height.

``turns`` is a thousand times the squared sine of half an angle.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.training.layers.indices import indices

from .features import FEET, HANDS
from .pose import Posed

NEAR = 0.08
"""Heights: a hand this near to a joint of its body is as good as touching it."""


def terms(
    tree: Tree, answer: Posed, truth: Mapping[str, Tensor], target: Mapping[str, Tensor], real: Tensor
) -> dict[str, Tensor]:
    """Name -> loss, unweighted.

    truth: ``rotations``, ``hips``, ``planted`` as ``RoleBody.see`` gives them, by rows. target: ``offsets``
    ``(rows, 22, 3)`` and ``lengths`` ``(rows, 2)``, metres. real: ``(rows, frames)``.
    """
    height = target["lengths"][:, :1, None, None]
    predicted = answer.positions
    reference, turned = kinematics(tree, target["offsets"], truth["rotations"], truth["hips"])
    predicted, reference = 100 * predicted / height, 100 * reference / height
    off = predicted - reference
    relative = off - off[:, :, :1]
    pairs = real[:, 1:] & real[:, :-1]
    feet = indices(FEET, predicted)
    rests = (truth["planted"][:, 1:] * truth["planted"][:, :-1]) * pairs[..., None]
    speed = length(predicted[:, :, feet].diff(dim=1))
    acceleration = off.diff(dim=1).diff(dim=1)
    steady = pairs[:, 1:] & pairs[:, :-1]
    heights = off[:, :, feet, 1].abs() * truth["planted"] * real[..., None]
    dot = (answer.turned * turned).sum(-1).abs().clamp(max=1.0)
    return {
        "world": masked(length(off).mean(-1), real),
        "relative": masked(length(relative).mean(-1), real),
        "speed": masked(length(off.diff(dim=1)).mean(-1), pairs),
        "acceleration": masked(length(acceleration).mean(-1), steady),
        "rests": (speed * rests).sum() / rests.sum().clamp(min=1),
        "floor": heights.sum() / (truth["planted"] * real[..., None]).sum().clamp(min=1),
        "turns": masked((1 - dot * dot).mean(-1), real) * 1000,
        "touch": touch(predicted, reference, real),
    }


def touch(predicted: Tensor, reference: Tensor, real: Tensor) -> Tensor:
    """Mean distance of vectors from hands to joints of the body; short ones count most."""
    total, count = predicted.new_zeros(()), predicted.new_zeros(())
    for hand in HANDS:
        right = reference - reference[:, :, hand : hand + 1]
        from_hand = predicted - predicted[:, :, hand : hand + 1]
        weight = torch.exp(-length(right) / (100 * NEAR)) * real[..., None]
        weight[:, :, hand] = 0
        total = total + (length(from_hand - right) * weight).sum()
        count = count + weight.sum()
    return total / count.clamp(min=1)


def length(vectors: Tensor) -> Tensor:
    """The length of vectors ``(..., 3)``; smooth at zero."""
    return torch.sqrt(vectors.square().sum(-1) + 1e-6)


def masked(values: Tensor, real: Tensor) -> Tensor:
    """The mean over real frames."""
    return (values * real).sum() / real.sum().clamp(min=1)
