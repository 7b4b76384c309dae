"""Training without pairs: rows of one source and one target structure, and their networks' inputs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import BenchError
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training import weights
from retarget_bench.training.contract import Batch
from retarget_bench.training.data import TrainingData, WindowBatch
from retarget_bench.training.layers import exported
from retarget_bench.training.layers.kinematic.ends import Ends, ends_loss
from retarget_bench.training.layers.kinematic.features import SIGNATURE, Signature, Variant, begin
from retarget_bench.training.layers.kinematic.pose import MOVES, UP, Scale

SMALL = 1e-3
"""Centimetres or radians: what deviates less than this is taken to be constant."""
OWN = 0.5
"""Of several structures, how often a group's target is of the source's own, or more where ``same`` is."""


@dataclass(frozen=True, eq=False)
class TrainingBodies:
    """The clips to train on, and the networks' inputs of their bodies.

    clips: with ``poses`` as ``features.see`` gives them. casts: structure -> its characters. skeletons: of
    each structure. bones: character -> ``(joints, 3)``. lacks: character -> ``(joints,)`` bool, which of
    these are of no length.
    """

    clips: TrainingData
    casts: Mapping[str, Sequence[str]]
    skeletons: Mapping[str, Skeleton]
    bones: Mapping[str, np.ndarray]
    lacks: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class GroupCast:
    """The bodies of a group of rows: a source and a target of each, ``same`` ``(rows,)`` bool where the
    target is meant to be the source, and ``among``, all targets that there are."""

    sources: Sequence[str]
    targets: Sequence[str]
    same: np.ndarray
    among: Sequence[str]


class UnpairedTraining:
    """Rows go in groups of one source and one target structure; a method may know one structure only.

    window: frames. build: a method with the tensors it is given. generator: new networks for so many
    joints, with a ``scale``. same: how often the target is the source; alone: always. variant:
    ``released`` may draw the source itself as another body.
    ``signatures``: structure -> its joints, where exported tensors are to tell. ``ends``: what answers to
    bodies of another structure are held to, if anything.
    """

    def __init__(
        self,
        bodies: TrainingBodies,
        *,
        window: int,
        build: Callable[[Mapping[str, Tensor]], Method],
        generator: Callable[[int], nn.Module],
        same: float,
        alone: bool = False,
        variant: Variant,
    ) -> None:
        self._material, self._window, self._build = bodies.clips, window, build
        self._same, self._alone, self._variant = same, alone, variant
        casts, skeletons, lacks = bodies.casts, bodies.skeletons, bodies.lacks
        self._bones = bodies.bones
        self._names = sorted(casts)
        self._casts = {name: sorted(casts[name]) for name in self._names}
        self._lacks = lacks if any(each.any() for each in lacks.values()) else {}
        self._trees = {name: Tree.of(skeletons[name]) for name in self._names}
        self.signatures: Mapping[str, Signature] = {}
        self.ends: Ends | None = None
        self._generators: dict[str, Any] = {}
        for name, members in self._casts.items():
            self._generators[name] = generator(len(skeletons[name]))
            self._fit(self._generators[name].scale, members)
        self.modules = nn.ModuleDict({"generator": nn.ModuleDict(self._generators)})

    # ------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """Groups of rows; each with the numbers of its two structures, windows and bones."""
        groups = min(rows, 2 if len(self._names) > 1 else 1)
        sizes = [rows // groups + (number < rows % groups) for number in range(groups)]
        return {"groups": [self._group(numbers, size) for size in sizes]}

    def _group(self, numbers: np.random.Generator, rows: int) -> dict[str, Any]:
        source = int(numbers.integers(len(self._names)))
        beside = [number for number in range(len(self._names)) if number != source]
        often = max(OWN, self._same) if beside else 1.0
        own = not beside or self._alone or numbers.random() < often
        target = source if own else int(numbers.choice(beside))
        cast = self._material.cast(numbers, rows, self._casts[self._names[source]])
        same = (numbers.random(rows) < self._same / often) & own | self._alone
        among = self._casts[self._names[target]]
        names = self._targets(numbers, cast, same, among)
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
        group |= self._beside(numbers, GroupCast(cast, names, same, among))
        if self._released:
            height = group["poses"][:, 0, UP : UP + 1]
            clips = self._material.draw(numbers, names, 1).arrays["poses"]
            group["heights"] = height
            group["target_heights"] = np.where(same[:, None], height, clips[:, 0, UP : UP + 1])
        return group

    def _beside(self, numbers: np.random.Generator, group: GroupCast) -> dict[str, Any]:
        """Further entries of a group."""
        del numbers, group
        return {}

    def _targets(
        self, numbers: np.random.Generator, cast: Sequence[str], same: np.ndarray, among: Sequence[str]
    ) -> list[str]:
        """The target of every row; ``released`` may draw the source itself, ours only where there is no
        other."""
        names = []
        for name, itself in zip(cast, same, strict=True):
            others = [other for other in among if self._released or other != name]
            names.append(others[int(numbers.integers(len(others)))] if others and not itself else name)
        return names

    def _windows(self, windows: WindowBatch) -> dict[str, Any]:
        poses = windows.arrays["poses"]
        poses = (poses if self._released else begin(poses)) * windows.mask[..., None]
        return {"poses": poses.astype(np.float32), "lengths": windows.lengths}

    def _ended(
        self,
        group: Mapping[str, Any],
        source: Scale,
        target: Scale,
        inputs: Tensor,
        answers: Tensor,
        real: Tensor,
    ) -> dict[str, Tensor]:
        """Terms on ends of limbs and on movements, where a group goes to another structure; sums over real
        frames ``(frames, rows)``. inputs, answers: normalised poses of sources and answers."""
        if self.ends is None:
            return {}
        nothing = answers.new_zeros(())
        if "ends" not in group:
            return {"ends": nothing, "ends_moves": nothing}
        inputs, answers = source.plain(inputs), target.plain(answers)
        ends = [
            self.ends.scaled(each, group["ends"], number) for number, each in enumerate((inputs, answers))
        ]
        moved = (inputs[..., -MOVES:] - answers[..., -MOVES:]) / source.moves_deviation
        return {
            "ends": self.ends.weight * ends_loss(ends[0], ends[1], real),
            "ends_moves": (moved.square().sum(-1) * real).sum(),
        }

    def _same_frames(self, groups: Sequence[Mapping[str, Any]]) -> Tensor:
        """Real frames of the rows whose target is the source, at least one."""
        frames = torch.stack([(group["lengths"] * group["same"]).sum() for group in groups])
        return frames.sum().clamp(min=1)

    def _tree(self, name: str, like: Tensor) -> Tree:
        if self._trees[name].mask.device != like.device:
            self._trees[name] = self._trees[name].to(like.device)
        return self._trees[name]

    # ---------------------------------------------------------------------------------- statistics
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
        return self._variant == "released"

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
