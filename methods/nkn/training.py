"""Training of NKN: one encoder-decoder and one discriminator per structure."""

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
from retarget_bench.training.layers.kinematic.pose import MOVES, quaternions
from retarget_bench.training.layers.kinematic.unpaired import GroupCast, TrainingBodies, UnpairedTraining
from retarget_bench.training.layers.masks import time_first_mask
from retarget_bench.training.layers.temporal_discriminator import TemporalDiscriminator
from retarget_bench.training.layers.twist import twist

from . import losses
from .network import Generator
from .network.bodies import Bodies
from .settings import NknConfig


@dataclass(eq=False)
class Fake:
    """Answers of one group, and real clips; ours: of rows that go to other bodies only.

    motion, real: ``(rows, frames, channels)`` as the discriminator sees them. bones, real_bones:
    ``(rows, ...)`` of their bodies. logits: ``(rows,)`` of the answers, with gradients. fooling: those of
    answers on other bodies, which the generator learns from.
    """

    structure: int
    bones: Tensor
    motion: Tensor
    lengths: Tensor
    real: Tensor
    real_bones: Tensor
    real_lengths: Tensor
    logits: Tensor
    fooling: Tensor


class NknTraining(UnpairedTraining):
    """See ``UnpairedTraining``. choices: the method's parameters."""

    def __init__(
        self,
        bodies: TrainingBodies,
        choices: NknConfig,
        config: TrainingConfig,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._choices = choices
        self._discriminators: dict[str, TemporalDiscriminator] = {}
        super().__init__(
            bodies,
            window=config.window,
            build=build,
            generator=lambda joints: Generator(joints, choices.hidden, choices.cell),
            same=choices.same,
            alone=choices.losses == "autoencoder",
            variant=choices.variant,
        )
        for name in self._names:
            joints = len(bodies.skeletons[name])
            self._discriminators[name] = TemporalDiscriminator(3 * joints + MOVES, 3 * (joints - 1))
        self._rule = NknUpdateRule(len(self._names))
        if choices.losses == "adversarial":
            self.modules["discriminator"] = nn.ModuleDict(self._discriminators)
            self.modules["scores"] = self._rule
        names = [name for name in ("generator", "discriminator") if name in self.modules]
        self.phases = [Phase(name, (name,), betas=(0.5, 0.999), clip=25.0) for name in names]

    def _beside(self, numbers: np.random.Generator, group: GroupCast) -> dict[str, Any]:
        """Clips of the targets for the discriminator, and their bones."""
        if self._choices.losses != "adversarial":
            return {}
        shown = group.targets
        if self._released:  # beside a target that is the source there is a clip of anybody
            anybody = self._material.cast(numbers, len(group.sources), group.among)
            rows = zip(anybody, shown, group.same, strict=True)
            shown = [a if itself else b for a, b, itself in rows]
        real = self._material.draw(numbers, shown, self._window)
        return {
            "real": self._windows(real),
            "real_bones": np.stack([self._bones[name] for name in real.characters]),
        }

    # -------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "generator":
            return self._generate(batch["groups"], memory)
        return self._discriminate(memory["fakes"])

    def _generate(self, groups: Sequence[Mapping[str, Any]], memory: dict[str, Any]) -> Terms:
        frames = torch.stack([group["lengths"].sum() for group in groups]).sum()
        sums: dict[str, list[Tensor]] = {}
        fakes: list[Fake] = []
        memory["fakes"] = fakes
        for group in groups:
            for name, term in self._terms(group, fakes).items():
                sums.setdefault(name, []).append(term)
        same_frames = self._same_frames(groups) if self._released else frames
        over = {"same_places": same_frames, "same_moves": same_frames}
        terms = {name: torch.stack(each).sum() / over.get(name, frames) for name, each in sums.items()}
        if self._choices.losses == "adversarial":
            rows = sum(len(fake.fooling) for fake in fakes)
            total = sum(
                (cross_entropy(fake.fooling, True).sum() for fake in fakes),
                torch.zeros((), device=frames.device),
            )
            terms["adversarial"] = losses.ADVERSARIAL * total / max(rows, 1)
        return terms

    def _terms(self, group: Mapping[str, Any], fakes: list[Fake]) -> dict[str, Tensor]:
        """Sums over a group's real frames."""
        names = [self._names[number] for number in group["structures"]]
        source, target = (self._generators[name] for name in names)
        body, other = (
            Bodies(
                self._tree(name, group[f"{whose}bones"]),
                group[f"{whose}bones"],
                self._generators[name].scale,
                group.get(f"{whose}lacks"),
                group.get(f"{whose}lacking"),
                group.get(f"{whose}heights"),
            )
            for name, whose in zip(names, ("", "target_"), strict=True)
        )
        poses = source.scale.poses(group["poses"].transpose(0, 1))
        real = time_first_mask(group["lengths"], len(poses))
        answers, raw = _through(source, target, poses, other)
        outputs = [(answers, raw, target)]
        nothing = answers.new_zeros(())
        terms, drifts = {"same_places": nothing, "same_moves": nothing}, []
        terms |= self._ended(group, source.scale, target.scale, poses, answers, real)
        if names[0] == names[1]:
            same = real * group["same"]
            terms["same_places"], terms["same_moves"] = losses.apart(answers, poses, same)
            drifts.append(losses.drift(answers, poses, same))
        if self._choices.losses != "autoencoder":
            back, raw = _through(target, source, answers, body)
            outputs.append((back, raw, source))
            terms["cycle_places"], terms["cycle_moves"] = losses.apart(back, poses, real)
            drifts.append(losses.drift(back, poses, real))
        if self._choices.drift:
            terms["drift"] = self._choices.drift * torch.stack(drifts).sum()
        turns = [quaternions(raw[..., :-MOVES]) for _, raw, _ in outputs]
        twists = [twist(each[..., 1:, :] if self._released else each, real) for each in turns]
        changes = [losses.smooth(through.scale.plain(pose), real) for pose, _, through in outputs]
        terms["twist"] = losses.TWIST * torch.stack(twists).mean()
        terms["smooth"] = losses.SMOOTH * torch.stack(changes).mean()
        if self._choices.losses == "adversarial":
            self._show(group, names[1], target.scale.plain(answers), fakes)
        return terms

    def _show(self, group: Mapping[str, Any], name: str, answers: Tensor, fakes: list[Fake]) -> None:
        """The discriminator's logits: ``released`` for all rows, ours for those that go to another body."""
        other, variant = group["other"], self._choices.variant
        rows = torch.arange(len(group["same"]), device=answers.device) if self._released else other
        if not len(rows):
            return
        real, scale = group["real"], self._generators[name].scale
        bones = scale.bones(group["target_bones"][rows])
        motion, lengths = losses.differences(answers, variant)[rows], group["lengths"][rows] - 1
        logits = self._discriminators[name](motion, bones, lengths)
        fakes.append(
            Fake(
                structure=self._names.index(name),
                bones=bones,
                motion=motion.detach(),
                lengths=lengths,
                real=losses.differences(real["poses"].transpose(0, 1), variant)[rows],
                real_bones=scale.bones(group["real_bones"][rows]),
                real_lengths=real["lengths"][rows] - 1,
                logits=logits,
                fooling=logits[other] if self._released else logits,
            )
        )

    def _discriminate(self, fakes: Sequence[Fake]) -> Terms:
        learns = self._rule.update([(fake.structure, fake.logits) for fake in fakes])
        if not any(learns):
            return {}
        terms = []
        for fake in fakes:
            if learns[fake.structure]:
                network = self._discriminators[self._names[fake.structure]]
                real = network(fake.real, fake.real_bones, fake.real_lengths, learns=True)
                shown = network(fake.motion, fake.bones, fake.lengths, learns=True)
                both = torch.cat([cross_entropy(real, True), cross_entropy(shown, False)])
                terms.append(both.mean() * (2 if self._released else 1))  # a sum of two means, as released
        if not terms:  # another process has rows of what learns, and waits for this one's gradients
            terms = [0.0 * each.sum() for each in self.modules["discriminator"].parameters()]
        return {"cross_entropy": torch.stack(terms).sum()}


def _through(source: Generator, target: Generator, poses: Tensor, bodies: Bodies) -> tuple[Tensor, Tensor]:
    """Poses and raw outputs of the target bodies, from normalised poses of the source's structure."""
    _, codes = source.encoder(poses)
    answers, raw, _ = target.decoder(codes, bodies)
    return answers, raw
