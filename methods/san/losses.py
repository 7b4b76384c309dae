"""SAN's losses, by the names that the paper gives them, with weights and details of the authors' code."""

from collections.abc import Mapping
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.functional import l1_loss, mse_loss

from retarget_bench.training.contract import Terms
from retarget_bench.training.layers.indices import indices
from retarget_bench.training.layers.skeletal.end_effectors import FASTER, NEAR, RESTING, ends_of
from retarget_bench.training.layers.skeletal.layout import Layout, shared

from .settings import Settings
from .structure import carried


def end_effectors(source: Tensor, answer: Tensor) -> Tensor:
    """Difference of how end effectors ``(rows, frames, ends, 3)`` move, in heights, and of those that rest.

    As released, the answer decides which of them rest, not the source. Where none does, the authors' mean
    over nothing is no number; here it is 0.
    """
    expected, predicted = FASTER * source.diff(dim=1), FASTER * answer.diff(dim=1)
    apart = (predicted - expected).square().sum(-1)
    rests = (predicted.detach().square().sum(-1) < NEAR**2).to(predicted.dtype)
    at_rest = (apart * rests).sum() / (3.0 * rests.sum()).clamp_min(1.0)
    return apart.mean() / 3.0 + RESTING * at_rest


class Answer(NamedTuple):
    """A motion as the losses compare it.

    edges: normalised channels ``(rows, frames, slots, 4)``. plain: with mean and deviation. local: joints
    relative to the hips ``(rows, frames, joints, 3)``, in the unit of ``Features``. positions: in the
    world. unit: heights of the body in that unit, ``(rows, 1, 1, 1)``.
    """

    edges: Tensor
    plain: Tensor
    local: Tensor
    positions: Tensor
    unit: Tensor

    @property
    def in_heights(self) -> Tensor:
        """Joints in the world ``(rows, frames, joints, 3)``, in heights."""
        return self.positions * self.unit


class Heights(nn.Module):
    """Learnt heights: factors of those of the bodies, which start at 1.

    Their geometric mean stays 1. Otherwise they all grow, since what moves less differs less.
    """

    def __init__(self, bodies: int) -> None:
        super().__init__()
        self.growth = nn.Parameter(torch.zeros(bodies))

    def forward(self, rows: Tensor) -> Tensor:
        """``(rows, 1, 1, 1)`` of these bodies."""
        return (self.growth - self.growth.mean())[rows].exp().view(-1, 1, 1, 1)


class Objective:
    """The generator's terms of one step, sums over the structures and pairs that have them.

    layouts: by structure.
    """

    def __init__(self, settings: Settings, layouts: Mapping[str, Layout]) -> None:
        self.weights, self.padded = settings.weights, settings.design.padded
        self._layouts, self._ends = layouts, {name: ends_of(each) for name, each in layouts.items()}
        self._terms: dict[str, Tensor] = {}

    def begin(self) -> None:
        self._terms = {}

    def total(self) -> Terms:
        """The same names in every step, whichever structures it has."""
        return self._terms

    def add(self, name: str, weight: float, term: Tensor) -> None:
        if weight:
            self._terms[name] = self._terms.get(name, 0.0) + weight * term

    def reconstruction(self, answer: Answer, real: Answer) -> None:
        """The reconstruction loss, with the places that the authors' code adds to it."""
        weights = self.weights
        channels = slice(-1 if self.padded else None)
        edges, truth = (each.edges.flatten(2)[..., channels] for each in (answer, real))
        self.add("edges", weights.reconstruction, mse_loss(edges, truth))
        predicted, expected = (each.in_heights[:, :, :1] for each in (answer, real))
        self.add("root", weights.reconstruction * weights.root, mse_loss(predicted, expected))
        predicted, expected = (
            torch.cat([each.positions[:, :, :1], each.local[:, :, 1:]], 2) * each.unit
            for each in (answer, real)
        )
        self.add("positions", weights.reconstruction * weights.positions, mse_loss(predicted, expected))

    def compare(self, pair: tuple[str, str], code: Tensor, again: Tensor) -> None:
        """Latent consistency, over the chains that both structures have, and the root.

        pair: source and target structure. code: of the source. again: of its answer."""
        here, there = (self._layouts[name] for name in pair)
        common = indices([*shared(here, there), -1], code)
        distance = l1_loss(carried(code, here, there)[:, :, common], again[:, :, common])
        self.add("cycle", self.weights.cycle, distance)

    def follow(self, pair: tuple[str, str], source: Tensor, answer: Tensor) -> None:
        """The end-effector loss, over those that both structures have; joints ``(rows, frames, joints, 3)``
        in heights."""
        source_ends, target_ends = (self._ends[name] for name in pair)
        both = sorted(source_ends.keys() & target_ends.keys())
        term = answer.new_zeros(())  # processes must agree on the names of terms
        if both:
            term = end_effectors(
                source[:, :, indices([source_ends[end] for end in both], source)],
                answer[:, :, indices([target_ends[end] for end in both], answer)],
            )
        self.add("ends", self.weights.ends, term)
