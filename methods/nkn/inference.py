"""Retargeting by NKN and its cross-structural variant: any number of frames, chunk by chunk."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Context, Prediction
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.motion import facing, root_rules, transfer
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.kinematics_torch import Tree
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.spec import Scalar
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import TrainingData
from retarget_bench.training.learned_method import LearnedMethod

from . import features
from .features import SIGNATURE
from .network import Decoder, Encoder, Generator
from .network.pose import MOVES, Bodies, Scale, quaternions
from .network.rollout import Memory
from .training import Choices, NknTraining

ROOT_RULE = "hip_height"
"""What the first place of the hips is scaled by."""
CHUNK = 256
"""Frames that go through the networks at a time."""


class Stream:
    """A batch of motions while they are retargeted: states, last answers, places and directions.

    encoder, scale: of the sources. decoder, bodies: of the targets.
    """

    def __init__(
        self, encoder: Encoder, scale: Scale, decoder: Decoder, bodies: Bodies, path: features.Path
    ) -> None:
        self._encoder, self._scale, self._decoder, self._bodies = encoder, scale, decoder, bodies
        self._path = path
        self._states: Sequence[Tensor] = ()
        self._memory: Memory | None = None

    def held(self) -> list[Tensor]:
        """All tensors that are carried on to the next frame."""
        if self._memory is None:
            return []
        memory = self._memory
        return [*self._states, memory.lower, memory.upper, memory.pose, memory.rise]

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
        with torch.no_grad():
            lower, codes = self._encoder(
                self._scale.poses(torch.from_numpy(poses).to(self._bodies.offsets.device)), self._states
            )
            self._states = (lower[-1].clone(), codes[-1].clone())
            answers, raw, self._memory = self._decoder(codes, self._bodies, self._memory)
            turns = quaternions(raw[..., :-MOVES]).cpu().numpy()
            moves = self._bodies.scale.plain(answers)[..., -MOVES:].cpu().numpy().astype(np.float64)
        if clean:
            moves = features.cleaned(moves, poses[..., -MOVES:])
        return turns, *self._path.follow(moves, turn, hips)


@dataclass(eq=False)
class Retargeter(Choices, LearnedMethod):
    """Retargets between bodies that ``structure`` knows, by the networks of their structures."""

    variant: features.Variant = "own"
    facing: float = 20.0
    yaw: features.Yaw = "predicted"
    path: root_rules.PathKind = "relative"
    clean: bool = False
    lengths: features.Lengths = "body"
    weights: str = "puppets"

    def __post_init__(self) -> None:
        if self.hidden < 1 or not 0.0 <= self.same <= 1.0 or min(self.facing, self.drift) < 0.0:
            raise BenchError(
                "hidden is at least 1, same between 0 and 1; facing and drift are not negative"
            )

    def facts(self) -> Mapping[str, Scalar]:
        free = ("yaw", "path", "clean", "weights")
        return {each.name: getattr(self, each.name) for each in fields(self) if each.name not in free}

    # ---------------------------------------------------------------------------- bodies and networks
    @abstractmethod
    def body(self, character: Character) -> Aligned | Body22:
        """The joints that the networks see. Raises SkeletonError where there are none."""

    def lacks(self, character: Character) -> np.ndarray:
        """``(joints,)`` bool: those of them that are of no length since the body lacks them."""
        return np.zeros(len(self.body(character).skeleton), dtype=bool)

    @abstractmethod
    def structure(self, character: Character) -> str:
        """Whose networks a character that fits is put through."""

    @abstractmethod
    def unfit(self, character: Character) -> str:
        """Reason why a character can be neither source nor target nor trained on; "" if it can."""

    def networks(self, device: str = "cpu") -> Mapping[str, Generator]:
        """Structure -> ``Generator``, ready for inference. Raises BenchError where there are no weights."""
        if device not in self._networks:
            found: dict[str, Generator] = {}
            for name in sorted({name.partition(".")[0] for name in self.tensors}):
                head = f"{name}."
                mine = {
                    key.removeprefix(head): each.float()
                    for key, each in self.tensors.items()
                    if key.startswith(head) and key != name + SIGNATURE
                }
                channels = len(mine["encoder.lower.kernel"])
                found[name] = Generator((channels - MOVES) // 3, self.hidden, self.cell).eval()
                found[name].load_state_dict(mine)
                found[name].to(device)
            self._networks[device] = found
        return self._networks[device]

    @cached_property
    def _networks(self) -> dict[str, Mapping[str, Generator]]:
        """By device, those that were asked for."""
        return {}

    def see(self, source: Prediction) -> features.Sight:
        character = source.character
        unit = features.unit(character, self.lengths)
        return features.see(source, self.body(character), self.facing, unit, self.variant)

    def bones(self, character: Character) -> np.ndarray:
        """``(joints, 3)`` float32 as the networks are told, in the unit."""
        unit = features.unit(character, self.lengths)
        return np.asarray(self.body(character).offsets / unit, dtype=np.float32)

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
        device: str = "cpu",
        heights: Sequence[float] = (),
    ) -> Stream:
        """A batch of targets, to be moved on by chunks of what ``features.see`` gives for the sources; all
        of one pair of structures.

        heights: of the ``released`` variant, metres: ``Sight.height`` of the sources, scaled.
        """
        source, target = (self.networks(device)[self.structure(mine[0])] for mine in (sources, targets))
        unit = np.array([features.unit(each, self.lengths) for each in targets])
        path = features.Path(unit, self.path, self.yaw, self.variant)
        offsets = torch.from_numpy(np.stack([self.bones(each) for each in targets])).to(device)
        lacks = torch.from_numpy(np.stack([self.lacks(each) for each in targets]))
        raised = torch.from_numpy(np.asarray(heights) / unit).float().unsqueeze(1) if len(heights) else None
        bodies = Bodies(
            Tree.of(self.body(targets[0]).skeleton).to(device),
            offsets,
            target.scale,
            lacks.to(device) if lacks.any() else None,
            heights=raised.to(device) if raised is not None else None,
        )
        return Stream(source.encoder, source.scale, target.decoder, bodies, path)

    def _together(
        self, device: str, sources: Sequence[Prediction], targets: Sequence[Character]
    ) -> list[Motion]:
        """Of one pair of structures; shorter motions are followed by zeros, which nothing real sees."""
        actors = [source.character for source in sources]
        seen = [self.see(source) for source in sources]
        ratio = [root_rules.ratio(ROOT_RULE, *pair) for pair in zip(actors, targets, strict=True)]
        poses, turn = _padded([sight.poses for sight in seen]), _padded([sight.turn for sight in seen])
        hips = _padded([sight.hips * by for sight, by in zip(seen, ratio, strict=True)])
        heights = [sight.height * by for sight, by in zip(seen, ratio, strict=True)]
        stream = self.stream(actors, targets, device, heights if self.variant == "released" else ())
        parts = []
        for first in range(0, len(poses), CHUNK):
            chunk = slice(first, first + CHUNK)
            parts.append(stream.advance(poses[chunk], turn[chunk], hips[chunk], self.clean))
        turns, faced, hips = (np.concatenate(each) for each in zip(*parts, strict=True))
        found = []
        for row, (source, target, sight) in enumerate(zip(sources, targets, seen, strict=True)):
            own = slice(len(sight.poses)), row
            body, frames, fps = self.body(target), len(source.positions), source.fps
            found.append(features.answer(body, turns[own], faced[own], hips[own], frames, fps))
        return found

    # --------------------------------------------------------------------------------------- training
    def prepare(self, motion: Motion) -> Mapping[str, np.ndarray]:
        """``poses`` ``(frames, channels)``: see ``pose.py``."""
        return {"poses": self.see(motion).poses}

    def training_module(self, training_data: TrainingData, config: TrainingConfig) -> NknTraining:
        casts: dict[str, list[str]] = {}
        for name in sorted(training_data.clips):
            casts.setdefault(self.structure(training_data.characters[name]), []).append(name)
        if len(training_data.clips) < 2 and self.losses != "autoencoder":
            raise NotSupported(f"{self.card.name} needs two characters to train on, and there is one")
        trees = {
            name: self.body(training_data.characters[mine[0]]).skeleton for name, mine in casts.items()
        }
        bones = {name: self.bones(training_data.characters[name]) for name in sorted(training_data.clips)}
        lacks = {name: self.lacks(training_data.characters[name]) for name in bones}
        return NknTraining(
            training_data,
            casts,
            trees,
            bones,
            lacks,
            self,
            config,
            lambda tensors: replace(self).using(tensors),
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
