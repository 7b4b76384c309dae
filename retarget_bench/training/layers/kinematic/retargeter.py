"""Retargeting of what ``features.see`` gives by networks of structures, any number of motions together."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np
from torch import nn

from retarget_bench import defaults
from retarget_bench.api import Context, Prediction
from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing, root_rules, transfer
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.layers.kinematic import features
from retarget_bench.training.layers.kinematic.features import SIGNATURE
from retarget_bench.training.layers.kinematic.unpaired import TrainingBodies
from retarget_bench.training.learned_method import LearnedMethod

ROOT_RULE = "hip_height"
"""The scale of the first position of the hips."""


class Stream(Protocol):
    """A batch of motions while they are retargeted, of one pair of structures."""

    def advance(
        self, poses: np.ndarray, turn: np.ndarray, hips: np.ndarray, clean: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The next frames: quaternions ``(frames, rows, joints, 4)`` seen from where the targets face,
        these directions ``(frames, rows)`` and the hips ``(frames, rows, 3)`` in metres.

        poses: ``(frames, rows, channels)`` of the sources (``features.see``), at least one frame.
        turn:  ``(frames, rows)``, where the sources face.
        hips:  ``(frames, rows, 3)`` metres, those of the sources, scaled to the targets.
        clean: the published clean-up of movements (``features.cleaned``).
        """


@dataclass(frozen=True, eq=False)
class Cases:
    """Cases of one pair of structures that are retargeted together.

    heights: of the ``released`` variant, metres: ``Sight.height`` of the sources, scaled.
    lengths: frames of each; none: all are as long as what the stream is given.
    """

    sources: Sequence[Character]
    targets: Sequence[Character]
    device: str = "cpu"
    heights: Sequence[float] = ()
    lengths: Sequence[int] = ()


@dataclass(frozen=True)
class SightConfig:
    """Parameters of all these methods."""

    variant: features.Variant = "own"
    """own, or released (input and losses of the authors' code)"""
    path: root_rules.PathKind = "relative"
    """integrated (movements summed up) or relative (the source's, scaled; what differs fades)"""
    yaw: features.Yaw = "predicted"
    """where the target turns: predicted, or as the source"""
    lengths: features.Lengths = "body"
    """what lengths are counted in: world (centimetres) or body (its hips are 90 high)"""
    facing: float = 20.0
    """frames over which the direction that a body faces is averaged"""
    clean: bool = False
    """movements take the source's sign, and nothing rises where the source does not"""
    weights: str = defaults.WEIGHTS
    """name of shipped weights, or a path to others"""


class SightRetargeter(LearnedMethod):
    """Retargets between bodies that ``structure`` knows, by the networks of their structures."""

    config: SightConfig
    answering = ("yaw", "path", "clean")

    @property
    def chunk(self) -> int:
        """Frames that go through the networks at a time."""
        return 1 << 30

    @property
    def root_rule(self) -> str:
        """The rule that paths follow; "" where the networks' moves are summed up."""
        return ROOT_RULE if self.config.path == "relative" else ""

    # ---------------------------------------------------------------------------- bodies and networks
    @abstractmethod
    def body(self, character: Character) -> Aligned | Body22:
        """The joints that the networks see. Raises SkeletonError where there are none."""

    def lacks(self, character: Character) -> np.ndarray:
        """``(joints,)`` bool: those of them that are of no length since the body lacks them."""
        return np.zeros(len(self.body(character).skeleton), dtype=bool)

    @abstractmethod
    def roles(self, character: Character) -> tuple[str | None, ...]:
        """Roles of the joints that the networks see."""

    @abstractmethod
    def structure(self, character: Character) -> str:
        """The structure whose networks a character goes through."""

    @abstractmethod
    def generator(self, joints: int) -> nn.Module:
        """New networks of a structure with so many joints, with a ``scale``."""

    def networks(self, device: str = "cpu") -> Mapping[str, Any]:
        """Structure -> networks, ready for inference. Raises BenchError where there are no weights."""
        if device not in self._networks:
            networks: dict[str, nn.Module] = {}
            for name in sorted({name.partition(".")[0] for name in self.tensors}):
                head = f"{name}."
                state = {
                    key.removeprefix(head): each.float()
                    for key, each in self.tensors.items()
                    if key.startswith(head) and key != name + SIGNATURE
                }
                networks[name] = self.generator(len(state["scale.places_mean"]) // 3).eval()
                networks[name].load_state_dict(state)
                networks[name].to(device)
            self._networks[device] = networks
        return self._networks[device]

    @cached_property
    def _networks(self) -> dict[str, Mapping[str, Any]]:
        """By device, those that were asked for."""
        return {}

    def see(self, source: Prediction) -> features.Sight:
        character = source.character
        unit = features.unit(character, self.config.lengths)
        return features.see(source, self.body(character), self.config.facing, unit, self.config.variant)

    def bones(self, character: Character) -> np.ndarray:
        """``(joints, 3)`` float32 inputs of the networks, in the unit."""
        unit = features.unit(character, self.config.lengths)
        return np.asarray(self.body(character).offsets / unit, dtype=np.float32)

    # ------------------------------------------------------------------------------------ retargeting
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
        answers: dict[int, Motion] = {}
        for (_, _, device), rows in groups.items():
            motions = self._together(device, [sources[row] for row in rows], [targets[row] for row in rows])
            answers |= dict(zip(rows, motions, strict=True))
        return [answers[number] for number in range(len(sources))]

    @abstractmethod
    def stream(self, cases: Cases) -> Stream:
        """Targets to be moved on by chunks of what ``features.see`` gives for the sources."""

    def _together(
        self, device: str, sources: Sequence[Prediction], targets: Sequence[Character]
    ) -> list[Motion]:
        """Of one pair of structures; shorter motions are followed by zeros, which nothing real sees."""
        actors = [source.character for source in sources]
        sights = [self.see(source) for source in sources]
        ratios = [root_rules.ratios(ROOT_RULE, *pair) for pair in zip(actors, targets, strict=True)]
        poses, turn = _padded([sight.poses for sight in sights]), _padded([sight.turn for sight in sights])
        hips = _padded([sight.hips * by for sight, by in zip(sights, ratios, strict=True)])
        heights = [sight.height * by[1] for sight, by in zip(sights, ratios, strict=True)]
        given_heights = heights if self.config.variant == "released" else ()
        lengths = [len(sight.poses) for sight in sights]
        stream = self.stream(Cases(actors, targets, device, given_heights, lengths))
        parts = []
        for first in range(0, len(poses), self.chunk):
            chunk = slice(first, first + self.chunk)
            parts.append(stream.advance(poses[chunk], turn[chunk], hips[chunk], self.config.clean))
        turns, faced, hips = (np.concatenate(each) for each in zip(*parts, strict=True))
        motions = []
        for row, (source, target, sight) in enumerate(zip(sources, targets, sights, strict=True)):
            own = slice(len(sight.poses)), row
            body, frames, fps = self.body(target), len(source.positions), source.fps
            motions.append(features.answer(body, turns[own], faced[own], hips[own], frames, fps))
        return motions

    # --------------------------------------------------------------------------------------- training
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        """``poses`` ``(frames, channels)``: see ``pose.py``."""
        return {"poses": self.see(motion).poses}

    @abstractmethod
    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> Any:
        """See ``training/contract.py``."""

    def training_bodies(self, training_data: TrainingData) -> TrainingBodies:
        """The characters by structure, with the networks' inputs of each."""
        cast = training_data.characters
        casts: dict[str, list[str]] = {}
        for name in sorted(training_data.clips):
            casts.setdefault(self.structure(cast[name]), []).append(name)
        return TrainingBodies(
            training_data,
            casts,
            {name: self.body(cast[members[0]]).skeleton for name, members in casts.items()},
            {name: self.bones(cast[name]) for name in sorted(training_data.clips)},
            {name: self.lacks(cast[name]) for name in sorted(training_data.clips)},
        )


@lru_cache(maxsize=1024)
def common_reasons(character: Character) -> str:
    """Reason why these networks cannot see a body, whatever its structure; "" if there is none."""
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
