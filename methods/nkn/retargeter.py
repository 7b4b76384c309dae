"""What NKN and its cross-structural variant share: a learned method that goes through motions in chunks."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import facing, root_rules, transfer
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.learned_method import LearnedMethod

from . import form

if TYPE_CHECKING:
    from torch import Tensor

    from retarget_bench.training.config import TrainingConfig
    from retarget_bench.training.data import TrainingData

    from .generator import Generator
    from .learner import Learner
    from .stream import Stream

ROOT_RULE = "hip_height"
"""What the first place of the hips is scaled by."""
CHUNK = 256
"""Frames that go through the networks at a time."""
SIGNATURE = ".signature"
"""What follows a structure's name in the tensor that says which joints it has."""
Signature = list[list[int]]
"""Per joint its parent and a number for its role."""
Yaw = Literal["predicted", "source"]
Terms = Literal["autoencoder", "cycle", "adversarial"]


class Retargeter(LearnedMethod):
    """Retargets between bodies that ``structure`` knows, by the networks of their structures."""

    def __init__(
        self,
        weights: str,
        *,
        cell: Literal["tf", "torch"],
        hidden: int,
        losses: Terms,
        same: float,
        drift: float,
        facing: float,
        yaw: Yaw,
        clean: bool,
        lengths: form.Lengths,
    ) -> None:
        super().__init__(weights)
        if hidden < 1 or not 0.0 <= same <= 1.0 or min(facing, drift) < 0.0:
            raise BenchError(
                "hidden is at least 1, same between 0 and 1; facing and drift are not negative"
            )
        self.cell, self.hidden, self.losses = cell, hidden, losses
        self.same, self.drift = same, drift
        self.facing, self.yaw, self.clean, self.lengths = facing, yaw, clean, lengths

    def facts(self) -> Mapping[str, Scalar]:
        return {
            "cell": self.cell,
            "hidden": self.hidden,
            "losses": self.losses,
            "same": self.same,
            "drift": self.drift,
            "facing": self.facing,
            "lengths": self.lengths,
        }

    @property
    def choices(self) -> dict[str, Any]:
        """All parameters but the weights."""
        return dict(self.facts()) | {"yaw": self.yaw, "clean": self.clean}

    # ---------------------------------------------------------------------------- bodies and networks
    @abstractmethod
    def body(self, character: Character) -> Aligned:
        """The joints that the networks see. Raises SkeletonError where there are none."""

    @abstractmethod
    def structure(self, character: Character) -> str:
        """Whose networks a character that fits is put through."""

    @abstractmethod
    def unfit(self, character: Character) -> str:
        """Why a character can be neither source nor target nor trained on, as a sentence; "" if it can."""

    def networks(self, device: str = "cpu") -> Mapping[str, Generator]:
        """Structure -> ``Generator``, ready for inference. Raises BenchError where there are no weights."""
        if device not in self._networks:
            self._networks[device] = self._built(device)
        return self._networks[device]

    @cached_property
    def _networks(self) -> dict[str, Mapping[str, Generator]]:
        """By device, those that were asked for."""
        return {}

    def _built(self, device: str) -> Mapping[str, Generator]:
        from .generator import Generator
        from .pose import MOVES

        found: dict[str, Generator] = {}
        for name in sorted({name.partition(".")[0] for name in self.tensors}):
            mine = {
                key.removeprefix(f"{name}."): each.float()
                for key, each in self.tensors.items()
                if key.startswith(f"{name}.") and not key.endswith(SIGNATURE)
            }
            channels = len(mine["encoder.lower.kernel"])
            found[name] = Generator((channels - MOVES) // 3, self.hidden, self.cell).eval()
            found[name].load_state_dict(mine)
            found[name].to(device)
        return found

    def see(self, source: Prediction) -> form.Sight:
        character = source.character
        return form.see(source, self.body(character), self.facing, form.unit(character, self.lengths))

    def bones(self, character: Character) -> np.ndarray:
        """``(joints, 3)`` as the networks are told."""
        return form.bones(self.body(character), form.unit(character, self.lengths))

    # ------------------------------------------------------------------------------------ retargeting
    def supports(self, source: Character, target: Character) -> str | None:
        for each in (source, target):
            if why := self.unfit(each):
                return why
        return root_rules.reason(ROOT_RULE, source, target) or self.untrained or None

    def retarget(self, source: Prediction, target: Character, *, context: Context) -> Motion:
        return self.retarget_batch([source], [target], contexts=[context])[0]

    def retarget_batch(
        self, sources: Sequence[Prediction], targets: Sequence[Character], *, contexts: Sequence[Context]
    ) -> list[Motion]:
        """The motions of the targets, those of the same structures together, in chunks of frames."""
        groups: dict[tuple[str, str, str], list[int]] = {}
        cases = zip(sources, targets, contexts, strict=True)
        for number, (source, target, context) in enumerate(cases):
            if why := self.supports(source.character, target):
                raise NotSupported(why)
            key = (self.structure(source.character), self.structure(target), context.device)
            groups.setdefault(key, []).append(number)
        found: dict[int, Motion] = {}
        for (_, _, device), rows in groups.items():
            motions = self._together(device, [sources[row] for row in rows], [targets[row] for row in rows])
            found |= dict(zip(rows, motions, strict=True))
        return [found[number] for number in range(len(sources))]

    def stream(
        self,
        sources: Sequence[Character],
        targets: Sequence[Character],
        place: np.ndarray,
        turn: np.ndarray,
        device: str = "cpu",
    ) -> Stream:
        """A batch of targets at ``place`` ``(rows, 3)`` metres, facing ``turn`` ``(rows,)``, to be moved on
        by chunks of what ``form.see`` gives for the sources; all of one pair of structures."""
        import torch

        from retarget_bench.motion.kinematics_torch import Tree

        from .pose import Bodies
        from .stream import Stream

        source, target = (self.networks(device)[self.structure(mine[0])] for mine in (sources, targets))
        path = form.Path(place, turn, np.array([form.unit(each, self.lengths) for each in targets]))
        offsets = torch.from_numpy(np.stack([self.bones(each) for each in targets])).to(device)
        bodies = Bodies(Tree.of(self.body(targets[0]).skeleton).to(device), offsets, target.scale)
        return Stream(source.encoder, source.scale, target.decoder, bodies, path)

    def _together(
        self, device: str, sources: Sequence[Prediction], targets: Sequence[Character]
    ) -> list[Motion]:
        """Of one pair of structures; shorter motions are followed by zeros, which nothing real sees."""
        actors = [source.character for source in sources]
        seen = [self.see(source) for source in sources]
        ratio = [root_rules.ratio(ROOT_RULE, *pair) for pair in zip(actors, targets, strict=True)]
        place = np.stack([sight.hips[0] * by for sight, by in zip(seen, ratio, strict=True)])
        begin = np.array([sight.turn[0] for sight in seen])
        stream = self.stream(actors, targets, place, begin, device)
        poses, turn = _padded([sight.poses for sight in seen]), _padded([sight.turn for sight in seen])
        parts = []
        for first in range(0, len(poses), CHUNK):
            chunk = slice(first, first + CHUNK)
            known = turn[chunk] if self.yaw == "source" else None
            parts.append(stream.advance(poses[chunk], known, self.clean))
        turns, faced, hips = (np.concatenate(each) for each in zip(*parts, strict=True))
        found = []
        for row, (source, target, sight) in enumerate(zip(sources, targets, seen, strict=True)):
            own = slice(len(sight.poses)), row
            body, frames, fps = self.body(target), len(source.positions), source.fps
            found.append(form.answer(body, turns[own], faced[own], hips[own], frames, fps))
        return found

    # --------------------------------------------------------------------------------------- training
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        """``poses`` ``(frames, channels)``: see ``pose.py``."""
        return {"poses": self.see(motion).poses}

    @abstractmethod
    def another(self) -> Retargeter:
        """This method once more, without weights."""

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> Learner:
        from .learner import Choices, Learner

        casts: dict[str, list[str]] = {}
        for name in sorted(training_data.clips):
            casts.setdefault(self.structure(training_data.characters[name]), []).append(name)
        if len(training_data.clips) < 2 and self.losses != "autoencoder":
            raise NotSupported(f"{self.card.name} needs two characters to train on, and there is one")
        trees = {
            name: self.body(training_data.characters[mine[0]]).skeleton for name, mine in casts.items()
        }
        bones = {name: self.bones(training_data.characters[name]) for name in sorted(training_data.clips)}
        choices = Choices(self.cell, self.hidden, self.losses, self.same, self.drift)

        def build(tensors: Mapping[str, Tensor]) -> Retargeter:
            return self.another().using(tensors)

        return Learner(training_data, casts, trees, bones, choices, config, build)


@lru_cache(maxsize=1024)
def common_reasons(character: Character) -> str:
    """What keeps a body of any structure from being seen by these networks; "" if nothing does."""
    return (
        facing.unknown(character)
        or transfer.reason(character, character)
        or root_rules.reason(ROOT_RULE, character, character)
        or ""
    )


def _padded(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """``(frames, rows, ...)`` from rows ``(frames', ...)``, zeros behind the shorter ones."""
    frames = max(len(each) for each in arrays)
    out = np.zeros((frames, len(arrays), *arrays[0].shape[1:]), arrays[0].dtype)
    for row, each in enumerate(arrays):
        out[: len(each), row] = each
    return out
