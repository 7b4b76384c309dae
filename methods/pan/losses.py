"""PAN's losses: the terms of section 5.6, in the form that a variant gives them, and the discriminators."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import mse_loss

from retarget_bench.training.contract import Terms
from retarget_bench.training.layers.adversarial import ReplayBuffer, least_squares

from .layout import Layout
from .network import Discriminator
from .settings import Design, Settings, Weights
from .structure import arranged, shared

NEAR = 0.008
"""Ten heights per frame times this: an end effector that is slower is taken to rest (released code)."""
FASTER, RESTING = 10.0, 100.0
"""Factors of displacements, and of the error where an end effector rests (released code)."""
REPLAYED = 50
"""Answers in a replay buffer (released code)."""
FOOT = ("toe_end", "toe", "foot")
END_EFFECTORS = (
    ("head_top", "head"),
    ("left_hand",),
    ("right_hand",),
    *(tuple(f"{side}_{part}" for part in FOOT) for side in ("left", "right")),
)
"""Roles of the end effectors; of several the first that a structure has."""


def code_distance(a: Tensor, b: Tensor, measure: Literal["l1", "l2"]) -> Tensor:
    """The first term of eq. 11."""
    return (a - b).abs().mean() if measure == "l1" else mse_loss(a, b)


def end_effectors(source: Tensor, answer: Tensor) -> Tensor:
    """Difference of how end effectors ``(rows, frames, ends, 3)`` move, in heights, and of where they rest.

    As released, the answer decides which of them rest, not the source.
    """
    wanted, found = FASTER * source.diff(dim=1), FASTER * answer.diff(dim=1)
    rests = (found.detach().square().sum(-1, keepdim=True) < NEAR**2).to(found.dtype)
    return mse_loss(found, wanted) + RESTING * mse_loss(found * rests, wanted * rests)


def rescaled(velocity: Tensor, range_: Tensor) -> Tensor:
    """Velocities ``(..., n)`` with speeds between 0 and 1 (eq. 20).

    range_: ``(2,)`` the slowest and the fastest speed in the structure's training motion.
    """
    speed = velocity.norm(dim=-1, keepdim=True)
    slowest, fastest = range_.unbind()
    return velocity / speed.clamp_min(1e-6) * ((speed - slowest) / (fastest - slowest).clamp_min(1e-6))


def discriminator_loss(real: Tensor, answers: Tensor) -> Tensor:
    """The discriminator's part of eq. 12, in the direction of LSGAN: real is 1, an answer is 0."""
    return 0.5 * (least_squares(real, True) + least_squares(answers, False))


class Answer(NamedTuple):
    """A motion as the losses compare it.

    edges: normalised channels ``(rows, frames, edges + 1, 4)``. plain: with mean and deviation. local:
    joints relative to the hips ``(rows, frames, joints, 3)``. positions: in the world; see
    ``Weights.lengths``.
    """

    edges: Tensor
    plain: Tensor
    local: Tensor
    positions: Tensor


class Objective:
    """The generator's terms of one step; each is the mean over the structures and pairs that have it.

    layouts: by structure. ranges: ``(2,)`` the slowest and the fastest movement of the hips (eq. 20).
    Terms keep the names that logs and cards have: ``slots`` (edge channels), ``places`` and
    ``again_places`` (joint positions).
    """

    def __init__(
        self, settings: Settings, layouts: Mapping[str, Layout], ranges: Mapping[str, Tensor]
    ) -> None:
        self.weights, self.height = settings.weights, settings.features.root == "height"
        self._layouts = layouts
        self._tensors: dict[tuple[str, ...], Tensor] = {
            ("speeds", name): each for name, each in ranges.items()
        }
        ends = {name: ends_of(layout) for name, layout in layouts.items()}
        for name, layout in layouts.items():
            encoded = torch.tensor([*np.flatnonzero(layout.encoded), layout.edges])
            self._tensors["edges", name] = encoded
            self._tensors["joints", name] = (encoded + 1) % (layout.edges + 1)
            for other, theirs in layouts.items():
                both = sorted(ends[name].keys() & ends[other].keys())
                joints = [ends[name][end] for end in both]
                self._tensors["ends", name, other] = torch.tensor(joints, dtype=torch.long)
                common = shared(layout, theirs)
                self._tensors["parts", name, other] = torch.tensor(common, dtype=torch.long)
        self._terms: dict[str, list[Tensor]] = {}

    def begin(self, device: torch.device) -> None:
        self._terms = {}
        if any(each.device != device for each in self._tensors.values()):
            self._tensors = {key: each.to(device) for key, each in self._tensors.items()}

    def total(self) -> Terms:
        """The same names in every step, whichever structures it has."""
        return {name: torch.stack(found).mean() for name, found in self._terms.items()}

    def add(self, name: str, weight: float, term: Tensor) -> None:
        if weight:
            self._terms.setdefault(name, []).append(weight * term)

    # ------------------------------------------------------------------------------------------ terms
    def reconstruction(self, name: str, answer: Answer, real: Answer) -> None:
        """Eq. 10, and the second term of eq. 13."""
        weights, (edges, joints) = self.weights, self._compared(name)
        found, wanted = answer.edges, real.edges
        self.add("slots", weights.edges, mse_loss(found[:, :, edges], wanted[:, :, edges]))
        self.add("moves", weights.moves, mse_loss(found[:, :, -1], wanted[:, :, -1]))
        positions, truth = self._positions(answer), self._positions(real)
        self.add("places", weights.kinematic, mse_loss(positions[:, :, joints], truth[:, :, joints]))
        self.add("root", weights.root, mse_loss(positions[:, :, 0], truth[:, :, 0]))

    def cycle(self, name: str, answer: Answer, real: Answer, times: int) -> None:
        """The second term of eq. 11 and the first of eq. 13, over ``times`` motions that came back."""
        weights, (edges, joints) = self.weights, self._compared(name)
        wanted = real.edges[:, :, edges].repeat(times, 1, 1, 1)
        self.add("again", weights.again, mse_loss(answer.edges[:, :, edges], wanted))
        positions = self._positions(real)[:, :, joints].repeat(times, 1, 1, 1)
        found = self._positions(answer)[:, :, joints]
        self.add("again_places", weights.again_positions, mse_loss(found, positions))

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
        ours, theirs = self._tensors["ends", here, there], self._tensors["ends", there, here]
        if weights.ends and len(ours):
            source, answer = real.positions[:, :, ours], shown.positions[:, :, theirs]
            self.add("ends", weights.ends, end_effectors(source, answer))
        elif weights.ends:  # none in common; processes must agree on the names of terms
            self.add("ends", weights.ends, shown.positions.new_zeros(()))
        if weights.velocity:
            source, answer = real.plain[:, :, -1], shown.plain[:, :, -1]
            level = slice(0, 3, 2 if self.height else 1)
            wanted = rescaled(source[..., level], self._tensors["speeds", here])
            found = rescaled(answer[..., level], self._tensors["speeds", there])
            wrong = mse_loss(found, wanted)
            if weights.turns:
                wrong = wrong + mse_loss(answer[..., 3], source[..., 3])
            self.add("velocity", weights.velocity, wrong)

    def _positions(self, answer: Answer) -> Tensor:
        """``(rows, frames, joints, 3)``, the hips first: in the world, or ``local`` (see ``Weights``)."""
        if not self.weights.local:
            return answer.positions
        return torch.cat([answer.positions[:, :, :1], answer.local[:, :, 1:]], 2)

    def _compared(self, name: str) -> tuple[Tensor, Tensor]:
        """The edges and joints that losses compare: those of parts (section 7.1), and the root."""
        return self._tensors["edges", name], self._tensors["joints", name]


def ends_of(layout: Layout) -> dict[int, int]:
    """Number of an end effector -> its joint, if that belongs to a part: others are not encoded."""
    found: dict[int, int] = {}
    for number, wanted in enumerate(END_EFFECTORS):
        known: Sequence[str] = [role for role in wanted if role in layout.roles]
        joints = [layout.roles.index(role) for role in known]
        if joints and layout.encoded[joints[0] - 1]:
            found[number] = joints[0]
    return found


class Discriminators(nn.Module):
    """One discriminator for each structure, with its replay buffer.

    edges: structure -> how many it has. frames: of a window.
    """

    def __init__(self, edges: Mapping[str, int], frames: int, design: Design, weights: Weights) -> None:
        super().__init__()
        sizes = {"motion": (4, 4), "bones": (3, 4), "positions": (3, 3)}
        per_edge, root = sizes[weights.discriminator_input]
        channels = {name: per_edge * count + root for name, count in edges.items()}
        self.discriminators = nn.ModuleDict(
            {name: Discriminator(count, design) for name, count in channels.items()}
        )
        replayed = channels if weights.replay else {}
        self.pools = nn.ModuleDict(
            {name: ReplayBuffer(REPLAYED, frames, count) for name, count in replayed.items()}
        )

    def adversarial_loss(self, name: str, answers: Tensor) -> Tensor:
        """The generator's part of eq. 12, for answers ``(rows, frames, channels)``."""
        return least_squares(self.discriminators[name](answers), True)

    def loss(self, shown: Sequence[tuple[str, Tensor, Tensor]]) -> Terms:
        """The mean of ``discriminator_loss`` over structures.

        shown: structure, real motion, answers. The term has the name that logs and cards have.
        """
        found = []
        for name, real, answers in shown:
            if name in self.pools:
                answers = self.pools[name](answers)
            discriminator = self.discriminators[name]
            found.append(discriminator_loss(discriminator(real), discriminator(answers)))
        if not found:
            return {}
        names = {name for name, _, _ in shown}
        unused = [each for name, each in self.discriminators.items() if name not in names]
        # processes that train together need a gradient of every parameter
        idle = [0.0 * parameter.sum() for each in unused for parameter in each.parameters()]
        return {"told_apart": torch.stack(found).mean() + (torch.stack(idle).sum() if idle else 0.0)}
