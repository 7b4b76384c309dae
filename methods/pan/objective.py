"""What a step of PAN is judged by: which terms there are of whom, over which slots and joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from retarget_bench.training.contract import Terms

from . import losses
from .form import Form, Yaw
from .layout import Layout
from .losses import Weights
from .structure import arranged, shared
from .windows import Statistics

FOOT = ("toe_end", "toe", "foot")
ENDS = (
    ("head_top", "head"),
    ("left_hand",),
    ("right_hand",),
    *(tuple(f"{side}_{part}" for part in FOOT) for side in ("left", "right")),
)
"""The end effectors, each the first of these that a structure has."""


@dataclass(frozen=True)
class Choices:
    """statistics: of what eq. 15 takes mean and deviation. still: the least deviation. reversed_: windows
    run backwards half of the time. alike: structures begin with the same weights for what they share."""

    form: Form
    yaw: Yaw
    weights: Weights
    statistics: Statistics
    still: float
    reversed_: bool
    alike: bool = False


@dataclass
class Answer:
    """slots: normalised ``(rows, frames, slots + 1, 4)``. plain: with mean and deviation. local: joints
    relative to the hips ``(rows, frames, joints, 3)``. places: in the world; see ``Weights.lengths``."""

    slots: Tensor
    plain: Tensor
    local: Tensor
    places: Tensor


class Objective:
    """The generator's terms, gathered over a step: each is the mean over those that it is there for.

    layouts: by structure. ranges: ``(2,)`` the slowest and the fastest movement of the hips (eq. 20).
    """

    def __init__(
        self, choices: Choices, layouts: Mapping[str, Layout], ranges: Mapping[str, Tensor]
    ) -> None:
        self.weights, self.height = choices.weights, choices.form.root == "height"
        self._layouts, self._ranges = layouts, dict(ranges)
        self._ends = {name: ends_of(layout) for name, layout in layouts.items()}
        self._counted = {name: _counted(layout) for name, layout in layouts.items()}
        self._terms: dict[str, list[Tensor]] = {}

    def begin(self) -> None:
        self._terms = {}

    def total(self) -> Terms:
        """The same names in every step, whichever structures it is about."""
        return {name: torch.stack(found).mean() for name, found in self._terms.items()}

    def add(self, name: str, weight: float, term: Tensor) -> None:
        if weight:
            self._terms.setdefault(name, []).append(weight * term)

    # ------------------------------------------------------------------------------------------ terms
    def reconstruction(self, name: str, answer: Answer, real: Answer) -> None:
        """Eq. 10, and the second term of eq. 13."""
        weights, (slots, joints) = self.weights, self._about(name, answer.slots)
        found, wanted = answer.slots, real.slots
        self.add("slots", weights.slots, losses.squares(found[:, :, slots], wanted[:, :, slots]))
        self.add("moves", weights.moves, losses.squares(found[:, :, -1], wanted[:, :, -1]))
        places, truth = self._placed(answer), self._placed(real)
        self.add("places", weights.places, losses.squares(places[:, :, joints], truth[:, :, joints]))
        self.add("root", weights.root, losses.squares(places[:, :, 0], truth[:, :, 0]))

    def cycle(self, name: str, answer: Answer, real: Answer, times: int) -> None:
        """The second term of eq. 11 and the first of eq. 13: what came back, so many times."""
        weights, (slots, joints) = self.weights, self._about(name, answer.slots)
        wanted = real.slots[:, :, slots].repeat(times, 1, 1, 1)
        self.add("again", weights.again, losses.squares(answer.slots[:, :, slots], wanted))
        places = self._placed(real)[:, :, joints].repeat(times, 1, 1, 1)
        wrong = losses.squares(self._placed(answer)[:, :, joints], places)
        self.add("again_places", weights.again_places, wrong)

    def compare(self, pair: tuple[str, str], code: Tensor, again: Tensor) -> None:
        """The first term of eq. 11, over the parts that both structures have.

        pair: source and target structure. code: of the source. again: of its answer."""
        here, there = (self._layouts[name] for name in pair)
        common = shared(here, there)
        carried = arranged(code, here, there)[:, :, common]
        weights = self.weights
        apart = losses.apart(carried, again[:, :, common], weights.measure)
        self.add("latent", weights.latent, apart)

    def follow(self, pair: tuple[str, str], real: Answer, shown: Answer) -> None:
        """End effectors that both structures have move alike; so do the hips (eq. 20)."""
        weights, (here, there) = self.weights, pair
        both = sorted(self._ends[here].keys() & self._ends[there].keys())
        if weights.ends and both:
            source = real.places[:, :, [self._ends[here][end] for end in both]]
            answer = shown.places[:, :, [self._ends[there][end] for end in both]]
            self.add("ends", weights.ends, losses.ends(source, answer))
        elif weights.ends:  # no end effector in common, and a term all the same
            self.add("ends", weights.ends, shown.places.new_zeros(()))
        if weights.velocity:
            source, answer = real.plain[:, :, -1], shown.plain[:, :, -1]
            level = [0, 2] if self.height else [0, 1, 2]
            wanted = losses.rescaled(source[..., level], self._range(here, source))
            found = losses.rescaled(answer[..., level], self._range(there, answer))
            wrong = losses.squares(found, wanted)
            if weights.turns:
                wrong = wrong + losses.squares(answer[..., 3], source[..., 3])
            self.add("velocity", weights.velocity, wrong)

    def _placed(self, answer: Answer) -> Tensor:
        """``(rows, frames, joints, 3)`` joints as ``Weights.places`` compares them; the hips come first."""
        if not self.weights.local:
            return answer.places
        return torch.cat([answer.places[:, :, :1], answer.local[:, :, 1:]], 2)

    def _about(self, name: str, like: Tensor) -> tuple[Tensor, Tensor]:
        slots, joints = self._counted[name]
        if slots.device != like.device:
            self._counted[name] = slots, joints = slots.to(like.device), joints.to(like.device)
        return slots, joints

    def _range(self, name: str, like: Tensor) -> Tensor:
        self._ranges[name] = self._ranges[name].to(like)
        return self._ranges[name]


def _counted(layout: Layout) -> tuple[Tensor, Tensor]:
    """The slots and joints that losses are about: those of parts (section 7.1), and the root."""
    encoded = torch.from_numpy(layout.encoded).nonzero()[:, 0]
    return (
        torch.cat([encoded, torch.tensor([layout.slots])]),
        torch.cat([torch.tensor([0]), encoded + 1]),
    )


def ends_of(layout: Layout) -> dict[int, int]:
    """Number of an end effector -> its joint; of parts only, since others are not encoded."""
    found: dict[int, int] = {}
    for number, wanted in enumerate(ENDS):
        known: Sequence[str] = [role for role in wanted if role in layout.roles]
        joints = [layout.roles.index(role) for role in known]
        if joints and layout.encoded[joints[0] - 1]:
            found[number] = joints[0]
    return found
