"""The terms of PAN's objective (section 5.6; as released: weights and forms of the authors' code)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import torch
from torch import Tensor
from torch.nn import functional

Latent = Literal["l1", "l2"]
Judge = Literal["motion", "bones", "places"]
Measure = Literal["heights", "units"]
NEAR = 0.008
"""Ten heights per frame times this: an end effector that is slower is taken to rest (released code)."""
FASTER, RESTING = 10.0, 100.0
"""What displacements are multiplied by, and what resting ends count more (released code)."""


@dataclass(frozen=True)
class Weights:
    """Of the terms, all of them means over everything.

    slots:    squared error of the reconstruction in normalised slots (eq. 10). moves: once more of the
              root's slot.
    places:   of the reconstruction's joints (eq. 13), in heights or in the ``Form``'s units (``lengths``):
              in the world, or, where ``local``, relative to the hips, and the hips in the world. root:
              once more of the hips.
    latent:   distance of the codes of source and answer (eq. 11), ``measure`` l1 or squared.
    again:    squared error of the cycle in normalised slots (eq. 11); again_places: of its joints (eq. 13).
    ends:     squared difference of how end effectors move in source and answer.
    adversarial: least squares (eq. 12). judge: what discriminators see: slots, bones as vectors and the
              root's slot, or places of joints. pool: they see older answers too.
    velocity: squared difference of rescaled velocities of the hips (eq. 20); turns: and of how fast bodies
              turn.
    """

    slots: float = 1.0
    moves: float = 0.0
    places: float = 100.0
    lengths: Measure = "heights"
    local: bool = False
    root: float = 0.0
    latent: float = 2.5
    measure: Latent = "l2"
    again: float = 2.5
    again_places: float = 100.0
    ends: float = 0.0
    adversarial: float = 1.0
    judge: Judge = "motion"
    pool: bool = False
    velocity: float = 0.0
    turns: bool = True

    def kinematic(self, places: float) -> Weights:
        """With this weight of ``places``, and what else eq. 13 is about in proportion."""
        share = places / self.places
        return replace(self, places=places, root=share * self.root, again_places=share * self.again_places)


def squares(a: Tensor, b: Tensor) -> Tensor:
    return functional.mse_loss(a, b)


def apart(a: Tensor, b: Tensor, measure: Latent) -> Tensor:
    """How far codes lie apart (first term of eq. 11)."""
    return (a - b).abs().mean() if measure == "l1" else squares(a, b)


def ends(source: Tensor, answer: Tensor) -> Tensor:
    """End effectors ``(rows, frames, ends, 3)`` in heights: how they move, and that they rest together.

    As released, it is the answer that decides which of them rest, not the source.
    """
    wanted, shown = FASTER * source.diff(dim=1), FASTER * answer.diff(dim=1)
    rests = (shown.detach().square().sum(-1, keepdim=True) < NEAR**2).to(shown.dtype)
    return squares(shown, wanted) + RESTING * squares(shown * rests, wanted * rests)


def fooled(scores: Tensor) -> Tensor:
    """The generator's part of eq. 12."""
    return squares(scores, torch.ones_like(scores))


def told_apart(real: Tensor, shown: Tensor) -> Tensor:
    """The discriminator's part of eq. 12, in the direction of LSGAN: real is 1, an answer is 0."""
    return 0.5 * (squares(real, torch.ones_like(real)) + squares(shown, torch.zeros_like(shown)))


def rescaled(velocity: Tensor, range_: Tensor) -> Tensor:
    """Eq. 20: velocities ``(..., n)`` whose speeds are those between the slowest and the fastest of a
    structure's training motion, ``range_`` ``(2,)``, as 0 to 1."""
    speed = velocity.norm(dim=-1, keepdim=True)
    slowest, fastest = range_.unbind()
    return velocity / speed.clamp_min(1e-6) * ((speed - slowest) / (fastest - slowest).clamp_min(1e-6))
