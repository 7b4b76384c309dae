"""Training of PAN: each step reconstructs two structures, carries each to both, and back."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor

from retarget_bench.api import Method
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Terms
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.skeletal.body import LayoutBody
from retarget_bench.training.layers.skeletal.discriminators import Discriminators
from retarget_bench.training.layers.skeletal.kinematics import Kinematics, world
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.structure import arranged
from retarget_bench.training.layers.skeletal.training import Bodies, Side, SkeletalTraining
from retarget_bench.training.layers.skeletal.windows import BODIES, Windows

from .losses import Answer, Objective, summed
from .network import Discriminator
from .settings import Settings
from .structure import Structure, share_initialisation


class PanTraining(SkeletalTraining[Structure]):
    """See ``SkeletalTraining``. bodies: of two characters or more."""

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Bodies,
        settings: Settings,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._settings, weights, frames = settings, settings.weights, config.window
        own = settings.statistics == "character"
        ends = {name: _end_sites(members) if weights.end_sites else [] for name, members in bodies.items()}
        windows = Windows(training_data, frames, bodies, ends, settings.features, settings.reversed_, own)
        super().__init__(training_data, bodies, settings, build, windows)
        some = {name: next(iter(bodies[name].values())) for name in self._names}
        self._kinematics = {name: Kinematics(body, ends[name]) for name, body in some.items()}
        channels = {name: self._channels(body, len(ends[name])) for name, body in some.items()}
        judges = {name: Discriminator(count, settings.design) for name, count in channels.items()}
        replayed = {name: (frames, count) for name, count in channels.items() if weights.replay}
        self._judge(Discriminators(judges, replayed, weights.summed), weights.adversarial)
        layouts = {name: each.layout for name, each in self._structures.items()}
        ranges = {name: windows.speeds(name) for name in self._names}
        self._objective = Objective(settings, layouts, ends, ranges)

    def _networks(self, layout: Layout, cast: Sequence[str]) -> Structure:
        return Structure(layout, self._settings.design, cast)

    def _share_initialisation(self, structures: Sequence[Structure]) -> None:
        share_initialisation(structures, self._settings.design)

    # ----------------------------------------------------------------------------------------- losses
    def _generate(self, sides: Sequence[Side], memory: dict[str, Any]) -> Terms:
        """Source and target structures in pairs; the calls of one network are put together."""
        objective, count = self._objective, range(len(sides))
        names = [self._names[side["structure"]] for side in sides]
        parts = [self._structures[name] for name in names]
        real = [self._real(name, side) for name, side in zip(names, sides, strict=True)]
        codes = [part.encoder(truth.edges) for part, truth in zip(parts, real, strict=True)]
        objective.begin(codes[0].device)
        partners = [self._partners(here, len(sides)) for here in count]
        shown: dict[tuple[int, int], Answer] = {}
        returned: dict[tuple[int, int], Tensor] = {}
        for there, side in enumerate(sides):
            *others, own = self._answers(names, there, codes, side, real)
            objective.reconstruction(names[there], own, real[there])
            pairs = [(here, there) for here in partners[there]]
            shown |= zip(pairs, others, strict=True)
            again = parts[there].encoder(torch.cat([each.edges for each in others]))
            returned |= zip(pairs, again.chunk(len(pairs)), strict=True)
        cycle = self._settings.weights.again or self._settings.weights.again_positions
        for here, side in enumerate(sides):
            if cycle:
                back = [
                    arranged(returned[here, there], parts[there].layout, parts[here].layout)
                    for there in partners[here]
                ]
                roots = [shown[here, there].plain[:, :, -1] for there in partners[here]]
                bodies = {key: torch.cat([side[key]] * len(back)) for key in BODIES}
                answer = self._decoded(names[here], back, roots, bodies)
                objective.cycle(names[here], answer, real[here], len(back))
            for there in partners[here]:
                pair = names[here], names[there]
                objective.compare(pair, codes[here], returned[here, there])
                objective.follow(pair, real[here], shown[here, there])
        if self._settings.weights.adversarial > 0:
            self._discriminate(names, real, shown, memory)
        return objective.total()

    def _partners(self, side: int, sides: int) -> list[int]:
        """The sides that one gets motions from and gives its own to."""
        across = self._settings.weights.across and sides > 1
        return [other for other in range(sides) if other != side or not across]

    def _answers(
        self,
        names: Sequence[str],
        there: int,
        codes: Sequence[Tensor],
        side: Side,
        real: Sequence[Answer],
    ) -> list[Answer]:
        """Answers: its partners' motions on bodies of this side; last, its own motion on its own bodies."""
        layouts = [self._structures[name].layout for name in names]
        partners = self._partners(there, len(names))
        order = [*partners, there]
        coded = [arranged(codes[here], layouts[here], layouts[there]) for here in order]
        roots = [real[here].plain[:, :, -1] for here in order]
        bodies = side["targets"]
        if len(partners) < len(names):
            rows = {key: each.chunk(len(names) + 1) for key, each in bodies.items()}
            bodies = {key: torch.cat([each[n] for n in (*partners, -1)]) for key, each in rows.items()}
        decoded = self._decoded(names[there], coded, roots, bodies)
        chunks = (each.chunk(len(order)) for each in decoded)
        return [Answer(*each) for each in zip(*chunks, strict=True)]

    def _decoded(self, name: str, codes: Sequence[Tensor], roots: Sequence[Tensor], bodies: Side) -> Answer:
        """Codes on bodies of a structure; roots: plain root channels of their sources."""
        structure = self._structures[name]
        edges = structure.answer(torch.cat(list(codes)), bodies["bones"])
        if self._settings.features.path == "carried":
            edges = structure.with_path(edges, torch.cat(list(roots)), bodies["which"])
        return self._answer(name, edges, bodies)

    def _answer(self, name: str, edges: Tensor, bodies: Side) -> Answer:
        """bodies: ``which``, ``bones``, ``unit`` and ``turn`` of each row, see ``Windows.draw``."""
        plain = self._structures[name].plain(edges, bodies["which"])
        local = self._kinematics[name](plain, bodies["bones"])
        features, weights = self._settings.features, self._settings.weights
        if weights.positions == "summed":
            positions = summed(local, plain[..., -1, :])
        else:
            turned = self._settings.yaw == "source" and features.local
            turn = torch.view_as_complex(bodies["turn"]) if turned else None
            positions = world(local, plain[..., -1, :], features.root, turn)
        if weights.lengths == "units":
            return Answer(edges, plain, local, positions, torch.ones_like(bodies["unit"]))
        scale = bodies["unit"][:, None, None, None]
        return Answer(edges, plain, local * scale, positions * scale, bodies["unit"])

    def _real(self, name: str, side: Side) -> Answer:
        edges = self._structures[name].normalised(side["edges"], side["which"])
        return self._answer(name, edges, side)

    def _discriminate(
        self,
        names: Sequence[str],
        real: Sequence[Answer],
        shown: Mapping[tuple[int, int], Answer],
        memory: dict[str, Any],
    ) -> None:
        """Adversarial loss of answers on the other structure, or on the only one."""
        memory["shown"], weight = [], self._settings.weights.adversarial
        for there, name in enumerate(names):
            for here in range(len(names)):
                if here != there or len(names) == 1:
                    fake = self._discriminator_inputs(name, shown[here, there])
                    loss = self._discriminators.adversarial_loss(name, fake)
                    self._objective.add("adversarial", weight, loss)
                    memory["shown"].append(
                        (name, self._discriminator_inputs(name, real[there]).detach(), fake.detach())
                    )

    def _discriminator_inputs(self, name: str, answer: Answer) -> Tensor:
        """The input of a discriminator ``(rows, frames, channels)``."""
        kind = self._settings.weights.discriminator_input
        if kind == "motion":
            return answer.edges.flatten(2)
        if kind == "positions":
            return answer.positions.flatten(2)
        vectors = self._kinematics[name].vectors(answer.local).flatten(2)
        if kind == "units":
            return torch.cat([answer.plain[..., -1, :3], vectors / answer.scale[:, None, None]], -1)
        return torch.cat([vectors, answer.edges[..., -1, :]], -1)

    def _channels(self, body: LayoutBody, end_sites: int) -> int:
        """The number of channels of ``_discriminator_inputs``."""
        joints = len(body.joints)
        numbers = {
            "motion": 4 * (body.layout.edges + 1),
            "positions": 3 * (joints + end_sites),
            "units": 3 * joints,
            "bones": 3 * (joints - 1) + 4,
        }
        return numbers[self._settings.weights.discriminator_input]


def _end_sites(bodies: Mapping[str, LayoutBody]) -> list[int]:
    """The joints that have an end site in all bodies of a structure."""
    return sorted(set.intersection(*(set(body.end_sites) for body in bodies.values())))
