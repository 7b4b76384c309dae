"""Posing a body: the trunk as it is, the four limbs by where their ends go.

Limbs bend in closed form (two bones and a goal), so that a goal is met to rounding where it is in reach,
and gradients of what the ends do reach the goals straight.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from retarget_bench.motion.hinges import HINGES
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.kinematics_torch import forward as kinematics
from retarget_bench.motion.structures import BODY22
from retarget_bench.training.layers.indices import indices

_PARTS = ("up_leg", "leg", "foot"), ("arm", "forearm", "hand")
LIMBS = tuple(
    tuple(BODY22.index(f"{side}_{part}") for part in parts)
    for parts in _PARTS
    for side in ("left", "right")
)
"""Left leg, right leg, left arm, right arm: first, second and last joint."""
UPPER, LOWER, END = (list(each) for each in zip(*LIMBS, strict=True))
LEGS, ARMS = slice(0, 2), slice(2, 4)
TOES = [BODY22.index(f"{side}_toe") for side in ("left", "right")]
AXES = torch.tensor(np.array([HINGES[BODY22[joint]] for joint in UPPER]), dtype=torch.float32)
"""``(4, 3)`` in the reference pose; a positive turn about it folds the limb."""
LEAN = 0.1
"""How strongly the anatomical hinge speaks against the bend at hand: it decides for straight limbs."""
STRAIGHT = 0.995
"""Share of its length that a limb spans at most, unless it was copied straighter."""


class Posed(NamedTuple):
    """Joints in the world: positions ``(rows, frames, 22, 3)`` metres, and how they are turned from the
    reference pose ``(rows, frames, 22, 4)``."""

    positions: Tensor
    turned: Tensor


@dataclass(frozen=True)
class Goals:
    """Goals of a body. hips: ``(rows, frames, 3)`` metres. feet: ``(rows, frames, 2, 3)`` where ankles go
    in the world; hands: likewise, from the shoulder joint. swivel: ``(rows, frames, 4)`` radians about the
    line to the goal. ends: ``(rows, frames, 4, 4)`` how feet and hands are turned in the world."""

    hips: Tensor
    feet: Tensor
    hands: Tensor
    swivel: Tensor
    ends: Tensor


def copied(tree: Tree, rotations: Tensor, hips: Tensor, offsets: Tensor) -> Posed:
    """A pose by its local rotations in aligned form."""
    return Posed(*kinematics(tree, offsets, rotations, hips))


def posed(tree: Tree, rotations: Tensor, offsets: Tensor, goals: Goals) -> Posed:
    """The pose that meets the goals. rotations: ``(rows, frames, 22, 4)`` local, of the pose they start
    from. offsets: ``(rows, 22, 3)`` metres."""
    firsts, seconds, lasts, tips = (indices(each, rotations) for each in (UPPER, LOWER, END, TOES))
    places, turned = kinematics(tree, offsets, rotations, goals.hips)
    first, second, last = (places[:, :, each] for each in (firsts, seconds, lasts))
    aims = torch.cat([goals.feet - first[:, :, LEGS], goals.hands], 2)
    axes = rotate(turned[:, :, firsts], AXES.to(places, non_blocking=True).expand_as(first))
    swing, fold = bend(second - first, last - second, aims, axes, goals.swivel)
    upper, lower = multiply(swing, turned[:, :, firsts]), multiply(fold, turned[:, :, seconds])
    knee = first + rotate(swing, second - first)
    end = knee + rotate(fold, last - second)
    toes = multiply(goals.ends[:, :, LEGS], rotations[:, :, tips])
    tip = end[:, :, LEGS] + rotate(
        goals.ends[:, :, LEGS], offsets[:, None, tips].expand_as(end[:, :, LEGS])
    )
    places, turned = places.clone(), turned.clone()
    for joints, where, how in ((seconds, knee, lower), (lasts, end, goals.ends), (tips, tip, toes)):
        places[:, :, joints], turned[:, :, joints] = where, how
    turned[:, :, firsts] = upper
    return Posed(places, turned)


def bend(upper: Tensor, lower: Tensor, goal: Tensor, axis: Tensor, swivel: Tensor) -> tuple[Tensor, Tensor]:
    """World turns ``(..., 4)`` of the two bones that bring the end of a limb to its goal.

    upper, lower: ``(..., 3)`` the bones. goal: ``(..., 3)`` from the first joint. axis: ``(..., 3)`` of the
    hinge. swivel: ``(...)`` radians by which the plane of the limb then turns about the line to the goal.
    Out of reach, the limb points at its goal, nearly straight.
    """
    across = torch.linalg.cross(unit(upper), unit(lower))
    against = (-dot(across, axis)).clamp(min=0.0)
    normal = unit(across + (LEAN + 2.0 * against) * axis)
    a, b = dot(upper, normal), dot(lower, normal)
    flat_a, flat_b = upper - a * normal, lower - b * normal
    size_a, size_b = norm(flat_a), norm(flat_b)
    now = torch.atan2(dot(torch.linalg.cross(flat_a, flat_b), normal), dot(flat_a, flat_b))
    straight, was, far = norm(upper) + norm(lower), norm(upper + lower), norm(goal)
    reach = torch.minimum(far, torch.maximum(STRAIGHT * straight, was))
    rest = reach.square() - (a + b).square()
    cosine = (rest - size_a.square() - size_b.square()) / (2.0 * size_a * size_b).clamp(min=1e-9)
    angle = torch.acos(cosine.clamp(-0.99999, 0.99999)) - now
    fold = about(normal, angle)
    swing = between(upper + rotate(fold, lower), goal)
    swing = multiply(about(goal / far.clamp(min=1e-6), swivel.unsqueeze(-1)), swing)
    return swing, multiply(swing, fold)


# ------------------------------------------------------------------------------------------ quaternions
def multiply(a: Tensor, b: Tensor) -> Tensor:
    """Quaternion product ``(..., 4)``."""
    aw, ax, ay, az = a.unbind(-1)
    bw, bx, by, bz = b.unbind(-1)
    return torch.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )


def rotate(quaternions: Tensor, vectors: Tensor) -> Tensor:
    """Vectors ``(..., 3)`` turned by unit quaternions ``(..., 4)``."""
    scalar, axis = quaternions[..., :1], quaternions[..., 1:]
    twice = 2.0 * torch.linalg.cross(axis, vectors)
    return vectors + scalar * twice + torch.linalg.cross(axis, twice)


def about(axis: Tensor, angle: Tensor) -> Tensor:
    """Turns ``(..., 4)`` about unit axes ``(..., 3)`` by angles ``(..., 1)``."""
    return torch.cat([torch.cos(0.5 * angle), axis * torch.sin(0.5 * angle)], -1)


def between(a: Tensor, b: Tensor) -> Tensor:
    """The shortest turn from directions a to b."""
    a, b = unit(a), unit(b)
    return functional.normalize(
        torch.cat([1.0 + dot(a, b), torch.linalg.cross(a, b)], -1), dim=-1, eps=1e-6
    )


def dot(a: Tensor, b: Tensor) -> Tensor:
    return (a * b).sum(-1, keepdim=True)


def norm(a: Tensor) -> Tensor:
    return torch.sqrt(dot(a, a) + 1e-12)


def unit(a: Tensor) -> Tensor:
    return a / norm(a)
