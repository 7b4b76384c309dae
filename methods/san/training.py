"""Training of SAN: each step reconstructs two structures and carries each to both, with the same codes."""

from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from typing import Any

import torch
from torch import Tensor

from retarget_bench.api import Method
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Phase, Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal.discriminators import Discriminators
from retarget_bench.training.layers.skeletal.kinematics import Kinematics, world
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.training import Bodies, Side, SkeletalTraining
from retarget_bench.training.layers.skeletal.windows import Windows

from .losses import Answer, Heights, Objective
from .network import PLACE, Discriminator
from .settings import Settings
from .structure import Codes, Structure, carried, share_initialisation


class SanTraining(SkeletalTraining[Structure]):
    """See ``SkeletalTraining``. bodies: of two characters or more."""

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Bodies,
        settings: Settings,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._settings, frames = settings, config.window
        ends: dict[str, list[int]] = {name: [] for name in bodies}
        # batches say which character each row is of, for statistics and learnt heights alike
        windows = Windows(
            training_data, frames, bodies, ends, settings.features, backwards=True, by_character=True
        )
        super().__init__(training_data, bodies, settings, build, windows)
        counts = [len(bodies[name]) for name in self._names]
        self._firsts = dict(zip(self._names, accumulate(counts, initial=0), strict=False))
        self._kinematics = {name: Kinematics(next(iter(bodies[name].values()))) for name in self._names}
        layouts = {name: each.layout for name, each in self._structures.items()}
        self._objective = Objective(settings, layouts)
        if settings.heights == "learnt":
            self.modules["heights"] = Heights(sum(counts))
            self.phases = (Phase("generator", ("generator", "heights")),)
        judges = {name: Discriminator(settings.design.levels(each)) for name, each in layouts.items()}
        replayed = {name: (frames, each.edges + 1, PLACE) for name, each in layouts.items()}
        self._judge(Discriminators(judges, replayed), settings.weights.adversarial)

    def _networks(self, layout: Layout, cast: Sequence[str]) -> Structure:
        return Structure(layout, self._settings.design, cast)

    def _share_initialisation(self, structures: Sequence[Structure]) -> None:
        share_initialisation(structures)

    # ----------------------------------------------------------------------------------------- losses
    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """Source and target structures in all pairs; the calls of one network are put together."""
        objective, count = self._objective, len(sides)
        names = [self._names[side["structure"]] for side in sides]
        parts = [self._structures[name] for name in names]
        bodies = [part.codes(side["targets"]["bones"]) for part, side in zip(parts, sides, strict=True)]
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
            heights = self._heights(name, side["targets"]["which"]).chunk(count + 1)
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
        """Answers: every side's motion on bodies of this one; last, its own motion on its own bodies."""
        name, order = names[there], [*range(len(names)), there]
        part = self._structures[name]
        inputs = [carried(codes[here], self._structures[names[here]].layout, part.layout) for here in order]
        edges = part.decoder(torch.cat(inputs), bodies)
        targets = side["targets"]
        if self._settings.features.path == "carried":
            roots = torch.cat([real[here].plain[:, :, -1] for here in order])
            edges = part.with_path(edges, roots, self._row(targets["which"]))
        decoded = self._answer(name, edges, targets)
        return [Answer(*each) for each in zip(*(each.chunk(len(order)) for each in decoded), strict=True)]

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
        heights: Tensor = self.modules["heights"](which - 1 + self._firsts[name])
        return heights

    def _discriminate(self, name: str, real: Answer, answer: Answer, memory: dict[str, Any]) -> None:
        """Adversarial loss of an answer on another structure, or on the only one."""
        weight = self._settings.weights.adversarial
        if weight > 0:
            fake = self._discriminator_inputs(name, answer)
            self._objective.add("adversarial", weight, self._discriminators.adversarial_loss(name, fake))
            memory["shown"].append((name, self._discriminator_inputs(name, real).detach(), fake.detach()))

    def _discriminator_inputs(self, name: str, answer: Answer) -> Tensor:
        """The input of a discriminator ``(rows, frames, slots, 3)``: bones as vectors, and the root."""
        vectors = self._kinematics[name].vectors(answer.local)
        slots = torch.cat([vectors, answer.plain[:, :, -1:, :PLACE]], 2)
        return self._settings.design.arranged(slots)


def _chunk(codes: Codes, number: int, of: int) -> Codes:
    return tuple(code.chunk(of)[number] for code in codes)
