"""Training of PMnet: the networks and one discriminator of each structure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.layers.adversarial import NknUpdateRule, cross_entropy
from retarget_bench.training.layers.kinematic.pose import MOVES
from retarget_bench.training.layers.kinematic.unpaired import GroupCast, TrainingBodies, UnpairedTraining
from retarget_bench.training.layers.masks import time_first_mask
from retarget_bench.training.layers.temporal_discriminator import TemporalDiscriminator
from retarget_bench.training.layers.twist import twist

from . import losses
from .network import Bodies, Generator, divided
from .settings import PmnetConfig

WIDTHS = (16, 32, 64, 64)
"""Of the discriminator."""


@dataclass(eq=False)
class Shown:
    """The discriminators' inputs of one group: trajectories ``(rows, frames, 3)`` of sources and answers.

    structures: of source and target. logits: ``(rows,)`` of the answers, with gradients. fooling: those of
    answers on other bodies, which the generator learns from.
    """

    structures: tuple[int, int]
    real: Tensor
    answers: Tensor
    lengths: Tensor
    logits: Tensor
    fooling: Tensor


class PmnetTraining(UnpairedTraining):
    """See ``UnpairedTraining``.

    choices: of the method. sizes: character -> its height along the bones, in hundreds of centimetres.
    roles: structure -> those of its joints.
    """

    def __init__(
        self,
        bodies: TrainingBodies,
        sizes: Mapping[str, float],
        roles: Mapping[str, Sequence[str | None]],
        choices: PmnetConfig,
        config: TrainingConfig,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        super().__init__(
            bodies,
            window=config.window,
            build=build,
            generator=lambda joints: Generator(joints, choices.hidden),
            same=choices.same,
            variant=choices.variant,
        )
        self._sizes = sizes
        self._emphasis = {
            name: torch.tensor(losses.emphasis(of_structure)) for name, of_structure in roles.items()
        }
        self._discriminators = {name: TemporalDiscriminator(3, 0, widths=WIDTHS) for name in self._names}
        self._rule = NknUpdateRule(len(self._names))
        self.modules["discriminator"] = nn.ModuleDict(self._discriminators)
        self.modules["scores"] = self._rule
        names = ("generator", "discriminator")
        self.phases = [Phase(name, (name,), betas=(0.5, 0.999), clip=25.0) for name in names]

    def _beside(self, numbers: np.random.Generator, group: GroupCast) -> dict[str, Any]:
        """Sizes of both bodies of every row."""
        del numbers
        sizes = {"sizes": group.sources, "target_sizes": group.targets}
        return {
            key: np.array([[self._sizes[name]] for name in names], np.float32)
            for key, names in sizes.items()
        }

    # -------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "generator":
            return self._generate(batch["groups"], memory)
        return self._discriminate(memory["shown"])

    def _generate(self, groups: Sequence[Mapping[str, Any]], memory: dict[str, Any]) -> Terms:
        sums: dict[str, list[Tensor]] = {}
        shown: list[Shown] = []
        memory["shown"] = shown
        for group in groups:
            for name, term in self._terms(group, shown).items():
                sums.setdefault(name, []).append(term)
        frames = torch.stack([group["lengths"].sum() for group in groups]).sum()
        over = dict.fromkeys(sums, frames)
        over |= dict.fromkeys(("same_places", "same_moves"), self._same_frames(groups))
        over["adversarial"] = torch.stack([(~group["same"]).sum() for group in groups]).sum().clamp(min=1)
        return {name: torch.stack(each).sum() / over[name] for name, each in sums.items()}

    def _terms(self, group: Mapping[str, Any], shown: list[Shown]) -> dict[str, Tensor]:
        """Sums over a group's real frames, and the adversarial term's over its rows."""
        names = [self._names[number] for number in group["structures"]]
        source, target = (self._generators[name] for name in names)
        body, other = (
            self._bodies(name, group, whose) for name, whose in zip(names, ("", "target_"), strict=True)
        )
        poses = source.scale.poses(group["poses"].transpose(0, 1))
        places, moves = poses[..., :-MOVES], poses[..., -MOVES:]
        real = time_first_mask(group["lengths"], len(poses))
        same = real * group["same"]

        features = source.encode(places)
        solved, answers = source.solved(features), target.answer(features, other)
        here = source.scale.normalise("places", body.places(solved))
        there = target.scale.normalise("places", other.places(answers))
        walked = divided(moves, body.sizes)
        walks = target.moved(walked, real)
        target_poses = torch.cat([there, divided(walks, 1.0 / other.sizes)], -1)

        nothing, weights = places.new_zeros(()), self._emphasis[names[0]].to(places.device)
        self._emphasis[names[0]] = weights  # to stay there: another copy would be waited for
        terms = {
            "places": losses.places(here, places, weights, real),
            "same_places": nothing,
            "same_moves": nothing,
            "twist": losses.TWIST * (twist(solved[..., 1:, :], real) + twist(answers[..., 1:, :], real)),
            "features": losses.FEATURES * losses.squares(features, target.encode(there), real - same),
        }
        if names[0] == names[1]:
            terms["same_places"] = losses.places(there, places, weights, same)
            terms["same_moves"] = losses.squares(walks, walked, same)
        terms |= self._ended(group, source.scale, target.scale, poses, target_poses, real)
        trajectories = self._trajectory(source, poses, body), self._trajectory(target, target_poses, other)
        terms["adversarial"] = losses.ADVERSARIAL * self._fooled(group, *trajectories, shown)
        return terms

    def _bodies(self, name: str, group: Mapping[str, Any], whose: str) -> Bodies:
        offsets = group[f"{whose}bones"]
        heights = group.get(f"{whose}heights", torch.zeros_like(offsets[:, 0, :1]))
        lacks, lacking = (group.get(f"{whose}{key}") for key in ("lacks", "lacking"))
        tree = self._tree(name, offsets)
        return Bodies(tree, offsets, heights, group[f"{whose}sizes"], lacks, lacking)

    def _trajectory(self, network: Generator, poses: Tensor, bodies: Bodies) -> Tensor:
        """``released``: of normalised numbers over sizes, as in the authors' code; ours: in heights."""
        sizes = bodies.sizes
        if not self._released:
            poses, sizes = network.scale.plain(poses), 100.0 * sizes
        moved = losses.trajectory(poses[..., :-MOVES], poses[..., -MOVES:], self._variant)
        return moved / sizes.unsqueeze(1)

    def _fooled(
        self, group: Mapping[str, Any], real: Tensor, answers: Tensor, shown: list[Shown]
    ) -> Tensor:
        """The sum over rows that go to another body; what discriminators learn from goes to ``shown``."""
        logits = self._judged(group["structures"][1], answers, group["lengths"])
        fooling = logits[group["other"]]
        shown.append(Shown(group["structures"], real, answers.detach(), group["lengths"], logits, fooling))
        return cross_entropy(fooling, True).sum()

    def _judged(self, structure: int, inputs: Tensor, lengths: Tensor, learns: bool = False) -> Tensor:
        network = self._discriminators[self._names[structure]]
        return network(inputs, inputs.new_zeros(len(inputs), 0), lengths, learns)

    def _discriminate(self, shown: Sequence[Shown]) -> Terms:
        """Sources are real to the discriminator of their structure, answers are not to that of theirs."""
        learns = self._rule.update([(each.structures[1], each.logits) for each in shown])
        if not any(learns):
            return {}
        terms: list[Tensor] = []
        for each in shown:
            for structure, inputs, real in zip(
                each.structures, (each.real, each.answers), (True, False), strict=True
            ):
                if learns[structure]:
                    logits = self._judged(structure, inputs, each.lengths, learns=True)
                    terms.append(cross_entropy(logits, real).mean())
        if not terms:  # another process has rows of what learns, and waits for this one's gradients
            terms = [0.0 * each.sum() for each in self.modules["discriminator"].parameters()]
        return {"cross_entropy": torch.stack(terms).sum()}
