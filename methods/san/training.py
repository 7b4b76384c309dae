"""Training of SAN: each step reconstructs two structures and carries each to both, with the same codes."""

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
from retarget_bench.training.layers import exported

from ..pan.body import PanBody
from ..pan.structure import Kinematics, by_structure, matching, world
from ..pan.training_data import Windows, fit_statistics
from .losses import Answer, Discriminators, Heights, Objective, carried
from .network import PLACE
from .settings import Settings
from .structure import Codes, Structure, share_initialisation

Side = Mapping[str, Any]
"""One structure's part of a batch: see PAN's ``Windows.draw``."""


class SanTraining:
    """A ``TrainingModule`` (see ``training/contract.py``).

    bodies: of each character by structure. build: the method with the tensors that it is given.
    Raises NotSupported where there is one character only.
    """

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Mapping[str, Mapping[str, PanBody]],
        settings: Settings,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        if len(training_data.clips) < 2:
            raise NotSupported("san learns from at least two characters, and there is one")
        self._build, self._settings, self._names = build, settings, sorted(bodies)
        # batches say which character each row is of, for statistics and learnt heights alike
        ends: dict[str, list[int]] = {name: [] for name in bodies}
        self._windows = Windows(
            training_data, config.window, bodies, ends, settings.features, backwards=True, by_character=True
        )
        own, first = settings.statistics == "character", 0
        self._structures, self._firsts = {}, {}
        for name in self._names:
            cast = sorted(bodies[name])
            layout = next(iter(bodies[name].values())).layout
            structure = Structure(layout, settings.design, cast if own else ())
            fit_statistics(structure, training_data, cast, settings.least_deviation)
            self._structures[name], self._firsts[name] = structure, first
            first += len(cast)
        if settings.shared:
            share_initialisation(list(self._structures.values()))
        self._kinematics = {name: Kinematics(next(iter(bodies[name].values()))) for name in self._names}
        layouts = {name: each.layout for name, each in self._structures.items()}
        self._objective = Objective(settings, layouts)
        generator = nn.ModuleDict(self._structures)
        self.modules = nn.ModuleDict({"generator": generator})
        self.phases: Sequence[Phase] = (Phase("generator", ("generator",)),)
        if settings.heights == "learnt":
            self.modules["heights"] = Heights(first)
            self.phases = (Phase("generator", ("generator", "heights")),)
        self._discriminators = Discriminators(layouts, config.window, settings.design)
        if settings.weights.adversarial > 0:
            self.modules["discriminator"] = self._discriminators
            self.phases = (*self.phases, Phase("discriminator", ("discriminator",)))

    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        return self._windows.draw(numbers, rows)

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "discriminator":
            return self._discriminators.loss(memory["shown"])
        return self._generate(batch["sides"], memory)

    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """Source and target structures in all pairs; the calls of one network are put together."""
        objective, count = self._objective, len(sides)
        names = [self._names[side["structure"]] for side in sides]
        parts = [self._structures[name] for name in names]
        bodies = [part.codes(side["asked"]["bones"]) for part, side in zip(parts, sides, strict=True)]
        real = [self._real(name, side) for name, side in zip(names, sides, strict=True)]
        codes = [
            part.encoder(truth.edges, _chunk(body, count, count + 1))
            for part, truth, body in zip(parts, real, bodies, strict=True)
        ]
        objective.begin()
        memory["shown"] = []
        for there, (name, part, side) in enumerate(zip(names, parts, sides, strict=True)):
            *shown, own = self._answers(names, there, codes, side, real, bodies[there])
            objective.reconstruction(own, real[there])
            others: Codes = tuple(code[: -len(side["edges"])] for code in bodies[there])
            again = part.encoder(torch.cat([each.edges for each in shown]), others).chunk(count)
            heights = self._heights(name, side["asked"]["which"]).chunk(count + 1)
            for here, answer in enumerate(shown):
                pair = names[here], name
                objective.compare(pair, codes[here], again[here])
                source = real[here].in_heights / self._heights(names[here], sides[here]["which"])
                objective.follow(pair, source, answer.in_heights / heights[here])
                if here != there or count == 1:
                    self._discriminate(name, real[there], answer, memory)
        return objective.total()

    def _answers(
        self,
        names: Sequence[str],
        there: int,
        codes: Sequence[Tensor],
        side: Side,
        real: Sequence[Answer],
        bodies: Codes,
    ) -> list[Answer]:
        """Of every side's motion on bodies of this one; last, this side's own motion on its own bodies."""
        name, order = names[there], [*range(len(names)), there]
        part = self._structures[name]
        given = [carried(codes[here], self._structures[names[here]].layout, part.layout) for here in order]
        edges = part.decoder(torch.cat(given), bodies)
        asked = side["asked"]
        if self._settings.features.path == "carried":
            roots = torch.cat([real[here].plain[:, :, -1] for here in order])
            edges = part.with_path(edges, roots, self._row(asked["which"]))
        found = self._answer(name, edges, asked)
        return [Answer(*each) for each in zip(*(each.chunk(len(order)) for each in found), strict=True)]

    def _real(self, name: str, side: Side) -> Answer:
        edges = self._structures[name].normalised(side["edges"], self._row(side["which"]))
        return self._answer(name, edges, side)

    def _answer(self, name: str, edges: Tensor, bodies: Side) -> Answer:
        """bodies: ``which``, ``bones``, ``unit`` and ``turn`` of each row."""
        plain = self._structures[name].plain(edges, self._row(bodies["which"]))
        local = self._kinematics[name](plain, bodies["bones"])
        features = self._settings.features
        turn = torch.view_as_complex(bodies["turn"]) if features.local else None
        positions = world(local, plain[..., -1, :], features.root, turn)
        return Answer(edges, plain, local, positions, bodies["unit"].view(-1, 1, 1, 1))

    def _row(self, which: Tensor) -> Tensor:
        """Rows of the statistics."""
        return which if self._settings.statistics == "character" else torch.zeros_like(which)

    def _heights(self, name: str, which: Tensor) -> Tensor:
        """``(rows, 1, 1, 1)`` learnt heights of bodies, in their own."""
        if self._settings.heights == "given":
            return torch.ones(len(which), 1, 1, 1, device=which.device)
        found: Tensor = self.modules["heights"](which - 1 + self._firsts[name])
        return found

    def _discriminate(self, name: str, real: Answer, answer: Answer, memory: dict[str, Any]) -> None:
        """Adversarial loss of an answer on another structure, or on the only one."""
        weight = self._settings.weights.adversarial
        if weight > 0:
            seen = self._seen(name, answer)
            self._objective.add("adversarial", weight, self._discriminators.adversarial_loss(name, seen))
            memory["shown"].append((name, self._seen(name, real).detach(), seen.detach()))

    def _seen(self, name: str, answer: Answer) -> Tensor:
        """The input of a discriminator ``(rows, frames, slots, 3)``: bones as vectors, and the root."""
        vectors = self._kinematics[name].vectors(answer.local)
        slots = torch.cat([vectors, answer.plain[:, :, -1:, :PLACE]], 2)
        return self._settings.design.arranged(slots)

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        found: dict[str, Tensor] = {}
        for name, structure in self._structures.items():
            state = exported(structure) | structure.marks()
            found |= {f"{name}.{key}": each for key, each in state.items()}
        return found

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Take over weights, also of another data set: structures are matched by their joints. Statistics
        stay those of this training's motion.

        Raises BenchError where one is missing or does not fit."""
        known = by_structure(tensors)
        found = {name: matching(each, name, known) for name, each in self._structures.items()}
        for name, structure in self._structures.items():
            fitted = structure.mean.clone(), structure.deviation.clone()
            structure.load(found[name])
            structure.mean, structure.deviation = fitted


def _chunk(codes: Codes, number: int, of: int) -> Codes:
    return tuple(code.chunk(of)[number] for code in codes)
