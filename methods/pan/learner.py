"""PAN while it is trained: two structures a step, each reconstructed, carried to both and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.material import Material
from retarget_bench.training.recipe import Recipe

from . import losses
from .body import Body
from .design import Design
from .form import Form, Yaw
from .judges import Judges
from .kinematics import Kinematics, world
from .losses import Weights
from .structure import Structure, arranged, shared
from .windows import Statistics, Windows, spread

Side = Mapping[str, Tensor]
"""Of one structure in a step: see ``windows.Windows.draw``."""
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
    run backwards half of the time."""

    form: Form
    yaw: Yaw
    weights: Weights
    statistics: Statistics
    still: float
    reversed_: bool


@dataclass
class Answer:
    """slots: normalised ``(rows, frames, slots + 1, 4)``. plain: with mean and deviation. places: joints in
    the world, in heights ``(rows, frames, joints, 3)``. local: relative to the hips, in heights."""

    slots: Tensor
    plain: Tensor
    local: Tensor
    places: Tensor


class Learner:
    """A ``Learner`` (see ``training/contract.py``).

    bodies: of each character by structure. build: the method with the tensors that it is given.
    Raises NotSupported where there is one character only.
    """

    def __init__(
        self,
        material: Material,
        recipe: Recipe,
        bodies: Mapping[str, Mapping[str, Body]],
        design: Design,
        choices: Choices,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        if len(material.clips) < 2:
            raise NotSupported("pan learns from at least two characters, and there is one")
        self._build, self._choices = build, choices
        self._names = sorted(bodies)
        own = choices.statistics == "character"
        self._windows = Windows(material, recipe.window, bodies, choices.form, choices.reversed_, own)
        structures = {}
        for name in self._names:
            cast = sorted(bodies[name]) if own else ()
            layout = next(iter(bodies[name].values())).layout
            structures[name] = Structure(layout, design, cast)
            spread(structures[name], material, sorted(bodies[name]), choices.still)
        self._structures = structures
        self._kinematics = {name: Kinematics(next(iter(bodies[name].values()))) for name in self._names}
        self._ends = {name: _ends(structures[name].layout.roles) for name in self._names}
        self.modules = nn.ModuleDict({"generator": nn.ModuleDict(structures)})
        self.phases: Sequence[Phase] = (Phase("generator", ("generator",)),)
        slots = {name: each.layout.slots for name, each in structures.items()}
        self._judges = Judges(slots, recipe.window, design, choices.weights)
        if choices.weights.adversarial > 0:
            self.modules["discriminator"] = self._judges
            self.phases = (*self.phases, Phase("discriminator", ("discriminator",)))
        self._ranges = {name: self._windows.speeds(name) for name in self._names}

    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        return self._windows.draw(numbers, rows)

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._judges.told_apart(memory["shown"])
        return self._generate(batch["sides"], memory)

    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """Source and target structures in all pairs; the calls of one network are put together."""
        names = [self._names[int(side["structure"])] for side in sides]
        parts = [self._structures[name] for name in names]
        real = [self._real(name, side) for name, side in zip(names, sides, strict=True)]
        codes = [part.encoder(truth.slots) for part, truth in zip(parts, real, strict=True)]
        terms: dict[str, list[Tensor]] = {}
        shown: list[dict[int, Answer]] = []
        for there, side in enumerate(sides):
            answers = self._answers(names, there, codes, side)
            self._reconstruction(names[there], answers.pop(-1), real[there], terms)
            shown.append(answers)
        again = [
            parts[there].encoder(torch.cat([shown[there][here].slots for here in range(len(sides))]))
            for there in range(len(sides))
        ]
        returned = [each.chunk(len(sides)) for each in again]
        for here, side in enumerate(sides):
            back = [
                arranged(returned[there][here], parts[there].layout, parts[here].layout)
                for there in range(len(sides))
            ]
            self._cycle(names[here], back, side, real[here], terms)
            for there in range(len(sides)):
                self._compare(names, (here, there), codes[here], returned[there][here], terms)
                self._follow(names, (here, there), real[here], shown[there][here], terms)
        if self._choices.weights.adversarial > 0:
            self._fool(names, sides, real, shown, terms, memory)
        return {name: torch.stack(found).mean() for name, found in terms.items()}

    def _answers(
        self, names: Sequence[str], there: int, codes: Sequence[Tensor], side: Side
    ) -> dict[int, Answer]:
        """Of every side's motion on bodies of this one; -1: this side's own motion on its own bodies."""
        structure = self._structures[names[there]]
        layouts = [self._structures[name].layout for name in names]
        coded = [arranged(code, layouts[here], structure.layout) for here, code in enumerate(codes)]
        bones = [*(side["bones_of"][here] for here in range(len(codes))), side["bones"]]
        which = [*(side["which_of"][here] for here in range(len(codes))), side["which"]]
        units = [*(side["unit_of"][here] for here in range(len(codes))), side["unit"]]
        turns = [*(side["turn_of"][here] for here in range(len(codes))), side["turn"]]
        slots = structure.answer(torch.cat([*coded, coded[there]]), torch.cat(bones))
        found = self._answer(
            names[there], slots, torch.cat(which), torch.cat(bones), torch.cat(units), torch.cat(turns)
        )
        size = len(codes[0])
        split = [Answer(*each) for each in zip(*(torch.split(part, size) for part in found), strict=True)]
        return {**dict(enumerate(split[:-1])), -1: split[-1]}

    def _answer(
        self, name: str, slots: Tensor, which: Tensor, bones: Tensor, unit: Tensor, turn: Tensor
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Normalised, plain, and joints in heights; unit: ``(rows,)`` the unit in heights."""
        plain = self._structures[name].plain(slots, which)
        local = self._kinematics[name](plain, bones)
        form, given = self._choices.form, self._choices.yaw == "source"
        facing = torch.complex(turn[..., 0], turn[..., 1]) if given and form.local else None
        places = world(local, plain[..., -1, :], form.root, facing)
        scale = unit[:, None, None, None]
        return slots, plain, local * scale, places * scale

    def _real(self, name: str, side: Side) -> Answer:
        slots = self._structures[name].normalised(side["slots"], side["which"])
        found = self._answer(name, slots, side["which"], side["bones"], side["unit"], side["turn"])
        return Answer(*found)

    # ------------------------------------------------------------------------------------------ terms
    def _reconstruction(
        self, name: str, answer: Answer, real: Answer, terms: dict[str, list[Tensor]]
    ) -> None:
        weights, (slots, joints) = self._choices.weights, self._counted(name)
        _add(
            terms,
            "slots",
            weights.slots,
            losses.squares(answer.slots[:, :, slots], real.slots[:, :, slots]),
        )
        wrong = losses.squares(self._placed(answer)[:, :, joints], self._placed(real)[:, :, joints])
        _add(terms, "places", weights.places, wrong)
        _add(terms, "root", weights.root, losses.squares(answer.places[:, :, 0], real.places[:, :, 0]))

    def _placed(self, answer: Answer) -> Tensor:
        """``(rows, frames, joints, 3)`` joints as ``Weights.places`` compares them."""
        if not self._choices.weights.local:
            return answer.places
        return torch.cat([answer.places[:, :, :1], answer.local[:, :, 1:]], 2)

    def _cycle(
        self, name: str, codes: Sequence[Tensor], side: Side, real: Answer, terms: dict[str, list[Tensor]]
    ) -> None:
        """What comes back to its own bodies from each side."""
        weights, times = self._choices.weights, len(codes)
        if not weights.again and not weights.again_places:
            return
        bones, which = side["bones"].repeat(times, 1, 1), side["which"].repeat(times)
        answer = self._structures[name].answer(torch.cat(list(codes)), bones)
        unit, turn = side["unit"].repeat(times), side["turn"].repeat(times, 1, 1)
        found = Answer(*self._answer(name, answer, which, bones, unit, turn))
        slots, joints = self._counted(name)
        wanted = real.slots[:, :, slots].repeat(times, 1, 1, 1)
        _add(terms, "again", weights.again, losses.squares(found.slots[:, :, slots], wanted))
        places = self._placed(real)[:, :, joints].repeat(times, 1, 1, 1)
        wrong = losses.squares(self._placed(found)[:, :, joints], places)
        _add(terms, "again_places", weights.again_places, wrong)

    def _compare(
        self,
        names: Sequence[str],
        pair: tuple[int, int],
        code: Tensor,
        again: Tensor,
        terms: dict[str, list[Tensor]],
    ) -> None:
        """The code of the source and that of the answer, over the parts that both structures have."""
        here, there = (self._structures[names[side]].layout for side in pair)
        common = shared(here, there)
        carried = arranged(code, here, there)[:, :, common]
        weights = self._choices.weights
        apart = losses.apart(carried, again[:, :, common], weights.measure)
        _add(terms, "latent", weights.latent, apart)

    def _follow(
        self,
        names: Sequence[str],
        pair: tuple[int, int],
        real: Answer,
        shown: Answer,
        terms: dict[str, list[Tensor]],
    ) -> None:
        """End effectors that both structures have move alike; so do the hips (eq. 20)."""
        weights, (here, there) = self._choices.weights, (names[side] for side in pair)
        both = sorted(self._ends[here].keys() & self._ends[there].keys())
        if weights.ends and both:
            source = real.places[:, :, [self._ends[here][end] for end in both]]
            answer = shown.places[:, :, [self._ends[there][end] for end in both]]
            _add(terms, "ends", weights.ends, losses.ends(source, answer))
        if weights.velocity:
            source, answer = real.plain[:, :, -1], shown.plain[:, :, -1]
            level = [0, 2] if self._choices.form.root == "height" else [0, 1, 2]
            wanted = losses.rescaled(source[..., level], self._ranges[here].to(source))
            found = losses.rescaled(answer[..., level], self._ranges[there].to(answer))
            wrong = losses.squares(found, wanted) + losses.squares(answer[..., 3], source[..., 3])
            _add(terms, "velocity", weights.velocity, wrong)

    def _fool(
        self,
        names: Sequence[str],
        sides: Sequence[Side],
        real: Sequence[Answer],
        shown: Sequence[Mapping[int, Answer]],
        terms: dict[str, list[Tensor]],
        memory: dict[str, Any],
    ) -> None:
        """Only answers to the other structure are judged; where there is one, those within it."""
        memory["shown"] = []
        for there, name in enumerate(names):
            for here in range(len(sides)):
                if here != there or len(sides) == 1:
                    seen = self._seen(name, shown[there][here])
                    _add(
                        terms,
                        "adversarial",
                        self._choices.weights.adversarial,
                        self._judges.fooled(name, seen),
                    )
                    memory["shown"].append((name, self._seen(name, real[there]).detach(), seen.detach()))

    def _seen(self, name: str, answer: Answer) -> Tensor:
        """``(rows, frames, channels)`` what a discriminator sees."""
        if self._choices.weights.judge == "motion":
            return answer.slots.flatten(2)
        vectors = self._kinematics[name].vectors(answer.local)
        return torch.cat([vectors.flatten(2), answer.slots[..., -1, :]], -1)

    def _counted(self, name: str) -> tuple[Tensor, Tensor]:
        """The slots and joints that losses are about: those of parts (section 7.1), and the root."""
        encoded = torch.from_numpy(self._structures[name].layout.encoded).nonzero()[:, 0]
        last = torch.tensor([self._structures[name].layout.slots])
        return torch.cat([encoded, last]), torch.cat([torch.tensor([0]), encoded + 1])

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        found: dict[str, Tensor] = {}
        for name, structure in self._structures.items():
            state = {**structure.state_dict(), **structure.marks()}
            found |= {f"{name}.{key}": each.detach().cpu().clone() for key, each in state.items()}
        return found

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        known = {name.partition(".")[0] for name in tensors}
        if known != set(self._names):
            theirs, ours = ", ".join(sorted(known)), ", ".join(self._names)
            raise BenchError(f"the weights know the structures {theirs}, and the data have {ours}")
        for name, structure in self._structures.items():
            mine = {
                key.removeprefix(f"{name}."): each
                for key, each in tensors.items()
                if key.startswith(f"{name}.")
            }
            for key, mark in structure.marks().items():
                if not torch.equal(mine.pop(key, torch.empty(0)).to(mark.dtype), mark):
                    raise BenchError(f"the weights know other {key} of {name} than the data have")
            try:
                structure.load_state_dict({key: each.float() for key, each in mine.items()})
            except RuntimeError as error:
                raise BenchError(f"the weights do not fit this network: {error}") from None


def _add(terms: dict[str, list[Tensor]], name: str, weight: float, term: Tensor) -> None:
    if weight:
        terms.setdefault(name, []).append(weight * term)


def _ends(roles: Sequence[str | None]) -> dict[int, int]:
    """Number of an end effector -> its joint."""
    found: dict[int, int] = {}
    for number, wanted in enumerate(ENDS):
        for role in wanted:
            if role in roles:
                found.setdefault(number, roles.index(role))
    return found
