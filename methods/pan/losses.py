"""The generator's losses of PAN (Hu et al., TVCG 2023, section 5.6), in the form that a variant gives them.

The adversarial term, which needs the discriminators, is in ``training.py``. Heights are those of bodies.
"""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import mse_loss

from retarget_bench.training.contract import Terms
from retarget_bench.training.layers.skeletal.end_effectors import FASTER, NEAR, RESTING, ends_of
from retarget_bench.training.layers.skeletal.layout import Layout, shared
from retarget_bench.training.layers.skeletal.structure import arranged

from .settings import Settings


def code_distance(a: Tensor, b: Tensor, measure: Literal["l1", "l2"]) -> Tensor:
    """The first term of eq. 11."""
    return (a - b).abs().mean() if measure == "l1" else mse_loss(a, b)


def end_effectors(source: Tensor, answer: Tensor, resting: bool) -> Tensor:
    """Difference of how end effectors ``(rows, frames, ends, 3)`` move, and of what moves while they rest.

    As released, the answer decides which of them rest, not the source. The second term is a mean over all
    of them, or, where ``resting``, over those that rest: zero where none does, as whose mean the released
    code takes not-a-number.
    """
    expected, predicted = FASTER * source.diff(dim=1), FASTER * answer.diff(dim=1)
    rests = (predicted.detach().square().sum(-1, keepdim=True) < NEAR**2).to(predicted.dtype)
    still = mse_loss(predicted * rests, expected * rests)
    if resting:
        still = still / rests.mean().clamp_min(0.5 / rests.numel())
    return mse_loss(predicted, expected) + RESTING * still


def rescaled(velocity: Tensor, range_: Tensor) -> Tensor:
    """Velocities ``(..., n)`` with speeds between 0 and 1 (eq. 20).

    range_: ``(2,)`` the slowest and the fastest speed in the structure's training motion.
    """
    speed = velocity.norm(dim=-1, keepdim=True)
    slowest, fastest = range_.unbind()
    return velocity / speed.clamp_min(1e-6) * ((speed - slowest) / (fastest - slowest).clamp_min(1e-6))


class Answer(NamedTuple):
    """A motion as the losses compare it.

    edges: normalised channels ``(rows, frames, edges + 1, 4)``. plain: the same, not normalised. local:
    joints, and end sites, relative to the root ``(rows, frames, joints + end sites, 3)``. positions: in the
    world; see ``Weights``. scale: ``(rows,)`` of both, what a unit of ``Features`` is in them.
    """

    edges: Tensor
    plain: Tensor
    local: Tensor
    positions: Tensor
    scale: Tensor


def summed(positions: Tensor, root: Tensor) -> Tensor:
    """Positions as the released code of three parts has them in a window: seen from where the body faces in
    each frame, plus the sum of what the root moved, the first frame's movement included.

    positions: ``(rows, frames, joints, 3)`` relative to the root. root: ``(rows, frames, 4)``, its edge.
    """
    return positions + root[..., None, :3].cumsum(1)


class Objective:
    """The generator's terms of one step; each is the mean over the structures and pairs that have it, or
    the sum (``Weights.summed``).

    layouts: by structure. end_sites: joints that have one in ``Answer``. ranges: ``(2,)`` the slowest and
    the fastest movement of the hips (eq. 20).
    Terms keep the names that logs and cards have: ``slots`` (edge channels), ``places`` and
    ``again_places`` (joint positions).
    """

    def __init__(
        self,
        settings: Settings,
        layouts: Mapping[str, Layout],
        end_sites: Mapping[str, Sequence[int]],
        ranges: Mapping[str, Tensor],
    ) -> None:
        self.weights, self.height = settings.weights, settings.features.root == "height"
        self.padded = settings.design.padded
        self._layouts = layouts
        self._tensors: dict[tuple[str, ...], Tensor] = {
            ("speeds", name): each for name, each in ranges.items()
        }
        ends = {name: ends_of(layout) for name, layout in layouts.items()}
        for name, layout in layouts.items():
            edges = np.flatnonzero(layout.encoded[layout.leads])
            self._tensors["edges", name] = torch.tensor([*edges, layout.edges])
            self._tensors["joints", name] = torch.tensor(compared_joints(layout, end_sites[name]))
            for other, other_layout in layouts.items():
                both = sorted(ends[name].keys() & ends[other].keys())
                joints = [ends[name][end] for end in both]
                self._tensors["ends", name, other] = torch.tensor(joints, dtype=torch.long)
                common = shared(layout, other_layout)
                self._tensors["parts", name, other] = torch.tensor(common, dtype=torch.long)
        self._terms: dict[str, list[Tensor]] = {}

    def begin(self, device: torch.device) -> None:
        self._terms = {}
        if any(each.device != device for each in self._tensors.values()):
            self._tensors = {key: each.to(device) for key, each in self._tensors.items()}

    def total(self) -> Terms:
        """The same names in every step, whichever structures it has."""
        every = {name: torch.stack(terms) for name, terms in self._terms.items()}
        return {name: each.sum() if self.weights.summed else each.mean() for name, each in every.items()}

    def add(self, name: str, weight: float, term: Tensor, times: int = 1) -> None:
        """times: of how many structures or pairs this is the mean."""
        if weight:
            factor = weight * times if self.weights.summed else weight
            self._terms.setdefault(name, []).append(factor * term)

    # ------------------------------------------------------------------------------------------ terms
    def reconstruction(self, name: str, answer: Answer, real: Answer) -> None:
        """Eq. 10, and the second term of eq. 13."""
        weights, joints = self.weights, self._tensors["joints", name]
        self.add("slots", weights.edges, mse_loss(self._edges(name, answer), self._edges(name, real)))
        self.add("moves", weights.moves, mse_loss(answer.edges[:, :, -1], real.edges[:, :, -1]))
        positions, truth = self._positions(answer), self._positions(real)
        self.add("places", weights.kinematic, mse_loss(positions[:, :, joints], truth[:, :, joints]))
        self.add("root", weights.root, mse_loss(positions[:, :, 0], truth[:, :, 0]))

    def cycle(self, name: str, answer: Answer, real: Answer, times: int) -> None:
        """The second term of eq. 11 and the first of eq. 13, over ``times`` motions that came back."""
        weights, joints = self.weights, self._tensors["joints", name]
        edges = self._edges(name, real)
        expected = edges.repeat(times, *(1,) * (edges.ndim - 1))
        self.add("again", weights.again, mse_loss(self._edges(name, answer), expected), times)
        positions = self._positions(real)[:, :, joints].repeat(times, 1, 1, 1)
        places = self._positions(answer)[:, :, joints]
        self.add("again_places", weights.again_positions, mse_loss(places, positions), times)

    def compare(self, pair: tuple[str, str], code: Tensor, again: Tensor) -> None:
        """The first term of eq. 11, over the parts that both structures have.

        pair: source and target structure. code: of the source. again: of its answer."""
        here, there = (self._layouts[name] for name in pair)
        common = self._tensors["parts", *pair]
        carried = arranged(code, here, there)[:, :, common]
        distance = code_distance(carried, again[:, :, common], self.weights.measure)
        self.add("latent", self.weights.cycle, distance)

    def follow(self, pair: tuple[str, str], real: Answer, shown: Answer) -> None:
        """Movement of the end effectors that both structures have, and of the hips (eq. 20)."""
        weights, (here, there) = self.weights, pair
        source_ends, target_ends = self._tensors["ends", here, there], self._tensors["ends", there, here]
        if weights.ends and len(source_ends):
            source, answer = real.positions[:, :, source_ends], shown.positions[:, :, target_ends]
            self.add("ends", weights.ends, end_effectors(source, answer, weights.resting))
        elif weights.ends:  # none in common; processes must agree on the names of terms
            self.add("ends", weights.ends, shown.positions.new_zeros(()))
        if weights.velocity:
            source, answer = real.plain[:, :, -1], shown.plain[:, :, -1]
            level = slice(0, 3, 2 if self.height else 1)
            expected = rescaled(source[..., level], self._tensors["speeds", here])
            predicted = rescaled(answer[..., level], self._tensors["speeds", there])
            wrong = mse_loss(predicted, expected)
            if weights.turns:
                wrong = wrong + mse_loss(answer[..., 3], source[..., 3])
            self.add("velocity", weights.velocity, wrong)

    def _positions(self, answer: Answer) -> Tensor:
        """``(rows, frames, joints, 3)``, the root first; see ``Weights.positions``."""
        if self.weights.positions != "local":
            return answer.positions
        return torch.cat([answer.positions[:, :, :1], answer.local[:, :, 1:]], 2)

    def _edges(self, name: str, answer: Answer) -> Tensor:
        """``(rows, frames, ...)`` channels of the edges of parts (section 7.1), and of the root."""
        edges = self._tensors["edges", name]
        if self.weights.rotations:
            return answer.plain[:, :, edges[:-1]]
        channels = answer.edges[:, :, edges]
        return channels.flatten(2)[..., :-1] if self.padded else channels


def compared_joints(layout: Layout, end_sites: Sequence[int]) -> list[int]:
    """The joints of parts, then the root; then their end sites, by their place behind all joints.

    On four legs the head's is left out, as in the released code."""
    (root, *joints), count = np.flatnonzero(layout.encoded).tolist(), len(layout.parents)
    left_out = {"head"} if layout.four_legged else set()
    compared = [layout.encoded[joint] and layout.roles[joint] not in left_out for joint in end_sites]
    indices = np.flatnonzero(compared).tolist()
    return [*joints, root, *(count + n for n in indices)]
