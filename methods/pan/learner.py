"""PAN while it is trained: two structures a step, each reconstructed, carried to both and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import NotSupported
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData

from .beginning import begin_alike
from .body import Body
from .design import Design
from .judges import Judges
from .kinematics import Kinematics, world
from .objective import Answer, Choices, Objective
from .structure import Structure, arranged, by_structure, like
from .windows import Windows, spread

Side = Mapping[str, Any]
"""Of one structure in a step: see ``windows.Windows.draw``."""


class Learner:
    """A ``TrainingModule`` (see ``training/contract.py``).

    bodies: of each character by structure. build: the method with the tensors that it is given.
    Raises NotSupported where there is one character only.
    """

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Mapping[str, Mapping[str, Body]],
        design: Design,
        choices: Choices,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        if len(training_data.clips) < 2:
            raise NotSupported("pan learns from at least two characters, and there is one")
        self._build, self._choices = build, choices
        self._names = sorted(bodies)
        own = choices.statistics == "character"
        self._windows = Windows(training_data, config.window, bodies, choices.form, choices.reversed_, own)
        structures = {}
        for name in self._names:
            cast = sorted(bodies[name]) if own else ()
            layout = next(iter(bodies[name].values())).layout
            structures[name] = Structure(layout, design, cast)
            spread(structures[name], training_data, sorted(bodies[name]), choices.still)
        if choices.alike:
            begin_alike(list(structures.values()), design)
        self._structures = structures
        self._kinematics = {name: Kinematics(next(iter(bodies[name].values()))) for name in self._names}
        self.modules = nn.ModuleDict({"generator": nn.ModuleDict(structures)})
        self.phases: Sequence[Phase] = (Phase("generator", ("generator",)),)
        slots = {name: each.layout.slots for name, each in structures.items()}
        self._judges = Judges(slots, config.window, design, choices.weights)
        if choices.weights.adversarial > 0:
            self.modules["discriminator"] = self._judges
            self.phases = (*self.phases, Phase("discriminator", ("discriminator",)))
        layouts = {name: each.layout for name, each in structures.items()}
        ranges = {name: self._windows.speeds(name) for name in self._names}
        self._objective = Objective(choices, layouts, ranges)

    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        return self._windows.draw(numbers, rows)

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._judges.told_apart(memory["shown"])
        return self._generate(batch["sides"], memory)

    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """Source and target structures in all pairs; the calls of one network are put together."""
        objective, count = self._objective, range(len(sides))
        names = [self._names[side["structure"]] for side in sides]
        parts = [self._structures[name] for name in names]
        real = [self._real(name, side) for name, side in zip(names, sides, strict=True)]
        codes = [part.encoder(truth.slots) for part, truth in zip(parts, real, strict=True)]
        objective.begin()
        shown: list[dict[int, Answer]] = []
        for there, side in enumerate(sides):
            answers = self._answers(names, there, codes, side, real)
            objective.reconstruction(names[there], answers.pop(-1), real[there])
            shown.append(answers)
        again = [
            parts[there].encoder(torch.cat([shown[there][here].slots for here in count])) for there in count
        ]
        returned = [each.chunk(len(sides)) for each in again]
        for here, side in enumerate(sides):
            back = [
                arranged(returned[there][here], parts[there].layout, parts[here].layout) for there in count
            ]
            roots = [shown[there][here].plain[:, :, -1] for there in count]
            self._cycle(names[here], back, side, real[here], roots)
            for there in count:
                pair = names[here], names[there]
                objective.compare(pair, codes[here], returned[there][here])
                objective.follow(pair, real[here], shown[there][here])
        if self._choices.weights.adversarial > 0:
            self._fool(names, real, shown, memory)
        return objective.total()

    def _answers(
        self,
        names: Sequence[str],
        there: int,
        codes: Sequence[Tensor],
        side: Side,
        real: Sequence[Answer],
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
        if self._choices.form.path == "carried":
            roots = [each.plain[:, :, -1] for each in (*real, real[there])]
            slots = structure.with_path(slots, torch.cat(roots), torch.cat(which))
        found = self._answer(
            names[there], slots, torch.cat(which), torch.cat(bones), torch.cat(units), torch.cat(turns)
        )
        size = len(codes[0])
        split = [Answer(*each) for each in zip(*(torch.split(part, size) for part in found), strict=True)]
        return {**dict(enumerate(split[:-1])), -1: split[-1]}

    def _answer(
        self, name: str, slots: Tensor, which: Tensor, bones: Tensor, unit: Tensor, turn: Tensor
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """What ``Answer`` has; unit: ``(rows,)`` the unit in heights."""
        plain = self._structures[name].plain(slots, which)
        local = self._kinematics[name](plain, bones)
        form, given = self._choices.form, self._choices.yaw == "source"
        facing = torch.complex(turn[..., 0], turn[..., 1]) if given and form.local else None
        places = world(local, plain[..., -1, :], form.root, facing)
        if self._choices.weights.lengths == "units":
            return slots, plain, local, places
        scale = unit[:, None, None, None]
        return slots, plain, local * scale, places * scale

    def _real(self, name: str, side: Side) -> Answer:
        slots = self._structures[name].normalised(side["slots"], side["which"])
        found = self._answer(name, slots, side["which"], side["bones"], side["unit"], side["turn"])
        return Answer(*found)

    def _cycle(
        self, name: str, codes: Sequence[Tensor], side: Side, real: Answer, roots: Sequence[Tensor]
    ) -> None:
        """What comes back to its own bodies from each side; roots: the plain slots that come back."""
        weights, times = self._choices.weights, len(codes)
        if not weights.again and not weights.again_places:
            return
        bones, which = side["bones"].repeat(times, 1, 1), side["which"].repeat(times)
        answer = self._structures[name].answer(torch.cat(list(codes)), bones)
        if self._choices.form.path == "carried":
            answer = self._structures[name].with_path(answer, torch.cat(list(roots)), which)
        unit, turn = side["unit"].repeat(times), side["turn"].repeat(times, 1, 1)
        found = Answer(*self._answer(name, answer, which, bones, unit, turn))
        self._objective.cycle(name, found, real, times)

    def _fool(
        self,
        names: Sequence[str],
        real: Sequence[Answer],
        shown: Sequence[Mapping[int, Answer]],
        memory: dict[str, Any],
    ) -> None:
        """Only answers to the other structure are judged; where there is one, those within it."""
        memory["shown"], weight = [], self._choices.weights.adversarial
        for there, name in enumerate(names):
            for here in range(len(names)):
                if here != there or len(names) == 1:
                    seen = self._seen(name, shown[there][here])
                    self._objective.add("adversarial", weight, self._judges.fooled(name, seen))
                    memory["shown"].append((name, self._seen(name, real[there]).detach(), seen.detach()))

    def _seen(self, name: str, answer: Answer) -> Tensor:
        """``(rows, frames, channels)`` what a discriminator sees."""
        judge = self._choices.weights.judge
        if judge == "motion":
            return answer.slots.flatten(2)
        if judge == "places":
            return answer.places.flatten(2)
        vectors = self._kinematics[name].vectors(answer.local)
        return torch.cat([vectors.flatten(2), answer.slots[..., -1, :]], -1)

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
        """Structures are known by their joints, so that weights go from one data set to another. Raises
        BenchError where one is missing or does not fit."""
        known = by_structure(tensors)
        found = {name: like(each, name, known) for name, each in self._structures.items()}
        for name, structure in self._structures.items():
            structure.take(found[name])
