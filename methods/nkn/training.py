"""Training of NKN: one encoder-decoder and one discriminator per structure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import BenchError
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training import weights
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData, WindowBatch
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.adversarial import NknUpdateRule, cross_entropy
from retarget_bench.training.layers.temporal_discriminator import TemporalDiscriminator

from . import losses
from .features import SIGNATURE, Signature, Variant, begin
from .network import Generator
from .network.cells import Kind
from .network.pose import MOVES, UP, Bodies, Scale, quaternions

Losses = Literal["autoencoder", "cycle", "adversarial"]
SMALL = 1e-3
"""Centimetres or radians: what deviates less than this is taken to be constant."""
OWN = 0.5
"""Of several structures, how often a group's target is of the source's own, or more where ``same`` is."""


@dataclass(eq=False)
class Choices:
    """cell, hidden: of the networks. losses: which terms. same: how often the target is the source.
    drift: weight of ``losses.drift``. variant: form of the input and of the terms."""

    cell: Kind = "tf"
    hidden: int = 512
    losses: Losses = "adversarial"
    same: float = 0.2
    drift: float = 0.05
    variant: Variant = "own"


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


class Ends:
    """Joints by roles that two bodies have, and the lengths of the chains from the hips to them.

    reaches: character -> role -> (joint, length of its chain in the body's unit).
    """

    def __init__(self, weight: float, reaches: Mapping[str, Mapping[str, tuple[int, float]]]) -> None:
        self.weight, self._reaches = weight, reaches

    def shares(self, cast: Sequence[str], names: Sequence[str]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of both bodies of every row: joints ``(n,)`` and chain lengths ``(rows, n, 1)``."""
        bodies = [self._reaches[name] for name in (*cast, *names)]
        roles = [role for role in bodies[0] if all(role in body for body in bodies)]
        found = []
        for mine in (bodies[: len(cast)], bodies[len(cast) :]):
            joints = np.array([mine[0][role][0] for role in roles])
            lengths = np.array([[body[role][1] for role in roles] for body in mine], dtype=np.float32)
            found.append((joints, lengths[..., None]))
        return found

    def seen(self, poses: Tensor, shared: Sequence[tuple[Tensor, Tensor]], which: int) -> Tensor:
        """``(frames, rows, n, 3)`` of plain poses ``(frames, rows, channels)``."""
        joints, lengths = shared[which]
        places = poses[..., :-MOVES].reshape(*poses.shape[:2], -1, 3)
        return places[:, :, joints] / lengths


class NknTraining:
    """Rows go in groups of one source and one target structure; NKN itself knows one structure only.

    material: the clips, with ``poses`` as ``features.see`` gives them. casts: structure -> its characters.
    skeletons: of each structure. bones: character -> ``(joints, 3)``. lacks: character -> ``(joints,)``
    bool, which of these are of no length. build: a method with the tensors that it is given.
    ``signatures``: structure -> its joints, where exported tensors are to tell. ``ends``: what answers to
    bodies of another structure are held to, if anything.
    """

    def __init__(
        self,
        training_data: TrainingData,
        casts: Mapping[str, Sequence[str]],
        skeletons: Mapping[str, Skeleton],
        bones: Mapping[str, np.ndarray],
        lacks: Mapping[str, np.ndarray],
        choices: Choices,
        config: TrainingConfig,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._material, self._choices = training_data, choices
        self._window, self._build = config.window, build
        self._names = sorted(casts)
        self._casts = {name: sorted(casts[name]) for name in self._names}
        self._bones = bones
        self._lacks = lacks if any(each.any() for each in lacks.values()) else {}
        self._trees = {name: Tree.of(skeletons[name]) for name in self._names}
        self._generators: dict[str, Generator] = {}
        self._discriminators: dict[str, TemporalDiscriminator] = {}
        for name, mine in self._casts.items():
            joints = len(skeletons[name])
            self._generators[name] = Generator(joints, choices.hidden, choices.cell)
            self._discriminators[name] = TemporalDiscriminator(3 * joints + MOVES, 3 * (joints - 1))
            self._fit(self._generators[name].scale, mine)
        self.signatures: Mapping[str, Signature] = {}
        self.ends: Ends | None = None
        self._rule = NknUpdateRule(len(self._names))
        self.modules = nn.ModuleDict({"generator": nn.ModuleDict(self._generators)})
        if choices.losses == "adversarial":
            self.modules["discriminator"] = nn.ModuleDict(self._discriminators)
            self.modules["scores"] = self._rule
        names = [name for name in ("generator", "discriminator") if name in self.modules]
        self.phases = [Phase(name, (name,), betas=(0.5, 0.999), clip=25.0) for name in names]

    # ------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """Groups of rows; each with the numbers of its two structures, windows, bones, and clips of the
        targets for the discriminator."""
        groups = min(rows, 2 if len(self._names) > 1 else 1)
        sizes = [rows // groups + (number < rows % groups) for number in range(groups)]
        return {"groups": [self._group(numbers, size) for size in sizes]}

    def _group(self, numbers: np.random.Generator, rows: int) -> dict[str, Any]:
        source = int(numbers.integers(len(self._names)))
        beside = [number for number in range(len(self._names)) if number != source]
        alone = self._choices.losses == "autoencoder"
        often = max(OWN, self._choices.same) if beside else 1.0
        own = not beside or alone or numbers.random() < often
        target = source if own else int(numbers.choice(beside))
        cast = self._material.cast(numbers, rows, self._casts[self._names[source]])
        same = (numbers.random(rows) < self._choices.same / often) & own | alone
        names = self._targets(numbers, cast, same, self._casts[self._names[target]])
        if not self._released:
            same = np.array([a == b for a, b in zip(cast, names, strict=True)])
        windows = self._material.draw(numbers, cast, self._window)
        group = self._windows(windows) | {
            "structures": (source, target),  # not arrays: what is asked for on a GPU is waited for
            "same": same,
            "other": np.flatnonzero(~same),
            "bones": np.stack([self._bones[name] for name in cast]),
            "target_bones": np.stack([self._bones[name] for name in names]),
        }
        if self._lacks:
            group["lacks"] = np.stack([self._lacks[name] for name in cast])
            group["target_lacks"] = np.stack([self._lacks[name] for name in names])
            for key in ("", "target_"):
                group[f"{key}lacking"] = np.flatnonzero(group[f"{key}lacks"].any(0)).tolist()
        if self.ends is not None and source != target:
            group["ends"] = self.ends.shares(cast, names)
        if self._choices.losses == "adversarial":
            shown = names
            if self._released:  # beside a target that is the source there is a clip of anybody
                anybody = self._material.cast(numbers, rows, self._casts[self._names[target]])
                shown = [a if itself else b for a, b, itself in zip(anybody, names, same, strict=True)]
            real = self._material.draw(numbers, shown, self._window)
            group["real"] = self._windows(real)
            group["real_bones"] = np.stack([self._bones[name] for name in real.characters])
        if self._released:
            height = group["poses"][:, 0, UP : UP + 1]
            clips = self._material.draw(numbers, names, 1).arrays["poses"]
            group["heights"] = height
            group["target_heights"] = np.where(same[:, None], height, clips[:, 0, UP : UP + 1])
        return group

    def _targets(
        self, numbers: np.random.Generator, cast: Sequence[str], same: np.ndarray, among: Sequence[str]
    ) -> list[str]:
        """Of every row; ``released`` may draw the source itself, ours only where there is no other."""
        names = []
        for name, itself in zip(cast, same, strict=True):
            others = [other for other in among if self._released or other != name]
            names.append(others[int(numbers.integers(len(others)))] if others and not itself else name)
        return names

    def _windows(self, windows: WindowBatch) -> dict[str, Any]:
        poses = windows.arrays["poses"]
        poses = (poses if self._released else begin(poses)) * windows.mask[..., None]
        return {"poses": poses.astype(np.float32), "lengths": windows.lengths}

    # -------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        if phase == "generator":
            return self._generate(batch["groups"], memory)
        return self._discriminate(memory["fakes"])

    def _generate(self, groups: Sequence[Mapping[str, Any]], memory: dict[str, Any]) -> Terms:
        frames = torch.stack([group["lengths"].sum() for group in groups]).sum()
        found: dict[str, list[Tensor]] = {}
        fakes: list[Fake] = []
        memory["fakes"] = fakes
        for group in groups:
            for name, term in self._terms(group, fakes).items():
                found.setdefault(name, []).append(term)
        kept = frames
        if self._released:
            kept = (
                torch.stack([(group["lengths"] * group["same"]).sum() for group in groups])
                .sum()
                .clamp(min=1)
            )
        over = {"same_places": kept, "same_moves": kept}
        terms = {name: torch.stack(each).sum() / over.get(name, frames) for name, each in found.items()}
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
        real = losses.mask(len(poses), group["lengths"])
        answers, raw = _through(source, target, poses, other)
        outputs = [(answers, raw, target)]
        nothing = answers.new_zeros(())
        terms, drifts = {"same_places": nothing, "same_moves": nothing}, []
        if self.ends is not None:
            terms |= {"ends": nothing, "ends_moves": nothing}
        if self.ends is not None and "ends" in group:
            asked, given = source.scale.plain(poses), target.scale.plain(answers)
            seen = [self.ends.seen(each, group["ends"], k) for k, each in enumerate((asked, given))]
            terms["ends"] = self.ends.weight * losses.ends(seen[0], seen[1], real)
            moved = (asked[..., -MOVES:] - given[..., -MOVES:]) / source.scale.moves_deviation
            terms["ends_moves"] = (moved.square().sum(-1) * real).sum()
        if names[0] == names[1]:
            kept = real * group["same"]
            terms["same_places"], terms["same_moves"] = losses.apart(answers, poses, kept)
            drifts.append(losses.drift(answers, poses, kept))
        if self._choices.losses != "autoencoder":
            back, raw = _through(target, source, answers, body)
            outputs.append((back, raw, source))
            terms["cycle_places"], terms["cycle_moves"] = losses.apart(back, poses, real)
            drifts.append(losses.drift(back, poses, real))
        if self._choices.drift:
            terms["drift"] = self._choices.drift * torch.stack(drifts).sum()
        variant = self._choices.variant
        twists = [losses.twist(quaternions(raw[..., :-MOVES]), real, variant) for _, raw, _ in outputs]
        changes = [losses.smooth(through.scale.plain(seen), real) for seen, _, through in outputs]
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
        if not bool(learns.any()):
            return {}
        found = []
        for fake in fakes:
            if learns[fake.structure]:
                network = self._discriminators[self._names[fake.structure]]
                real = network(fake.real, fake.real_bones, fake.real_lengths, learns=True)
                shown = network(fake.motion, fake.bones, fake.lengths, learns=True)
                both = torch.cat([cross_entropy(real, True), cross_entropy(shown, False)])
                found.append(both.mean() * (2 if self._released else 1))  # a sum of two means, as released
        if not found:  # another process has rows of what learns, and waits for this one's gradients
            found = [0.0 * each.sum() for each in self.modules["discriminator"].parameters()]
        return {"cross_entropy": torch.stack(found).sum()}

    def _tree(self, name: str, like: Tensor) -> Tree:
        if self._trees[name].mask.device != like.device:
            self._trees[name] = self._trees[name].to(like.device)
        return self._trees[name]

    def _fit(self, scale: Scale, cast: Sequence[str]) -> None:
        """Statistics of the training clips, and of the bones of the reference poses."""
        poses = self._material.stacked("poses", cast)
        rest = np.stack([self._bones[name].reshape(-1) for name in cast])
        if self._released:  # one of every clip, whose hips are as high as the clip's
            rest = np.concatenate([self._rest(name) for name in cast])
        scale.fit("places", np.concatenate([poses[:, :-MOVES], rest]), SMALL)
        scale.fit("moves", poses[:, -MOVES:], SMALL)

    def _rest(self, name: str) -> np.ndarray:
        """``(clips, 3 joints)``: bones, and in the row of the hips how high they are in each clip."""
        clips = self._material.clips[name]
        rest = np.tile(self._bones[name].reshape(-1), (len(clips), 1))
        rest[:, UP] = [clip.arrays["poses"][0, UP] for clip in clips]
        return rest

    @property
    def _released(self) -> bool:
        return self._choices.variant == "released"

    # ----------------------------------------------------------------------------------- the outcome
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self.modules["generator"]) | self._marks

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        marks = {name: each for name, each in tensors.items() if name.endswith(SIGNATURE)}
        if marks.keys() != self._marks.keys() or any(
            not torch.equal(each, self._marks[name]) for name, each in marks.items()
        ):
            raise BenchError("the weights know other structures, or other joints of them")
        raised = {name: each.float() for name, each in tensors.items() if name not in marks}
        weights.fill(self.modules["generator"], raised)

    @property
    def _marks(self) -> dict[str, Tensor]:
        return {f"{name}{SIGNATURE}": torch.tensor(each) for name, each in self.signatures.items()}


def _through(source: Generator, target: Generator, poses: Tensor, bodies: Bodies) -> tuple[Tensor, Tensor]:
    """Poses and raw outputs of the target bodies, from normalised poses of the source's structure."""
    _, codes = source.encoder(poses)
    answers, raw, _ = target.decoder(codes, bodies)
    return answers, raw
