"""HuMoT while it is trained: parts of a skeleton in, other parts of it out."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers import exported

from .augmentation import build, proportions, reproportion, rotate_limbs, slanted, slants
from .features import HumotBody, blank, headings, parents_among, rotated, size_factor, stature
from .losses import losses
from .network import Autoencoder
from .network.tokens import RaggedTokens
from .settings import Design, HumotConfig

AUTOENCODER = "autoencoder"


class Performance(NamedTuple):
    """positions: ``(frames, joints, 3)``. template: ``(joints, 3)``. Metres, Z up."""

    positions: np.ndarray
    template: np.ndarray


class HumotTraining:
    """A ``TrainingModule`` (see ``training/contract.py``).

    bodies: by character. build: the method with tensors.
    """

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Mapping[str, HumotBody],
        design: Design,
        settings: HumotConfig,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._material, self._frames, self._bodies = training_data, config.window, bodies
        self._settings, self._build = settings, build
        self._network = Autoencoder(design)
        self.modules = nn.ModuleDict({AUTOENCODER: self._network})
        self.phases: Sequence[Phase] = (Phase(AUTOENCODER, (AUTOENCODER,)),)
        self._structures, clips = list(training_data.structures.values()), training_data.clips
        frames = [sum(clip.frames for name in names for clip in clips[name]) for names in self._structures]
        self._shares = np.sqrt(frames) / np.sqrt(frames).sum()

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """``frames`` ``(rows, frames)`` bool; ``source`` and ``target``, two draws of each row's joints;
        ``tokens``, the ``RaggedTokens`` of both. Draws have

        places ``(rows, frames, joints, 3)`` and template ``(rows, joints, 3)``, metres; joints
        ``(rows, joints)`` bool; parents ``(rows, joints)`` among them, -1 where there is none.
        """
        # A minute of one structure beside an hour of another is not half of all: shares are by the root.
        chosen = numbers.choice(len(self._structures), size=rows, p=self._shares)
        cast = [self._material.cast(numbers, 1, self._structures[k])[0] for k in chosen]
        left_out = held_out if self._settings.split == "chunk" else None
        windows = self._material.draw(numbers, cast, self._frames, self._settings.hop, left_out)
        bodies = [self._bodies[name] for name in cast]
        places = windows.arrays["places"]
        turns = windows.arrays.get("turns", np.zeros((*places.shape[:3], 4)))
        pairs = [
            self._performed(
                numbers, own, *(each[row, :length, : len(own.joints)] for each in (places, turns))
            )
            for row, (own, length) in enumerate(zip(bodies, windows.lengths.tolist(), strict=True))
        ]
        source, target = (self._parts(numbers, bodies, side) for side in zip(*pairs, strict=True))
        if self._settings.facing:
            angles = headings(source["places"], source["template"], source["joints"], windows.mask)
            for part in (source, target):
                part["places"] = rotated(part["places"], -angles)
        tokens = RaggedTokens.between(source["joints"], target["joints"], windows.mask)
        return {"frames": windows.mask, "source": source, "target": target, "tokens": tokens}

    def _performed(
        self, numbers: np.random.Generator, body: HumotBody, positions: np.ndarray, turns: np.ndarray
    ) -> tuple[Performance, Performance]:
        """A window as source and as target: one path of the hips, without the mean of the source's
        major joints over the window. positions, turns: see ``HumotBody.see`` and ``turns``."""
        if self._settings.varied:
            positions, turns = rotate_limbs(numbers, positions, turns, body)
        matrices = self._turn(numbers)
        source, target = (
            Performance(*(each @ matrix for each, matrix in zip(shaped, matrices, strict=True)))
            for shaped in (self._shaped(numbers, body, positions, turns) for _ in range(2))
        )
        centre = source.positions[:, body.major].mean((0, 1))
        path = source.positions[:, :1] - target.positions[:, :1]
        target = Performance(target.positions + path - centre, target.template)
        return Performance(source.positions - centre, source.template), target

    def _shaped(
        self, numbers: np.random.Generator, body: HumotBody, positions: np.ndarray, turns: np.ndarray
    ) -> Performance:
        """By a body of other proportions and slants, and of the usual size, as chosen."""
        template = body.template
        if self._settings.slanted and turns.any():
            added = slants(numbers, body)
            positions = slanted(positions, turns, added, body)
            template = template + build(body).chains @ added
        if self._settings.varied:
            factors = proportions(numbers, body)
            positions, template = (reproportion(each, factors, body) for each in (positions, template))
        size = size_factor(stature(template, body.heights)) if self._settings.sized else 1.0
        return Performance(size * positions, size * template)

    def _turn(self, numbers: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Matrices for rows of coordinates, ``(3, 3)`` for positions and for the template.

        A mirrored body is one whose template is mirrored: what lies where says what is left.
        """
        positions = template = np.eye(3)
        if self._settings.turned:
            angle = 2.0 * np.pi * numbers.random()
            cosine, sine = np.cos(angle), np.sin(angle)
            positions = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        if self._settings.mirrored and numbers.random() < 0.5:
            mirror = np.diag([-1.0, 1.0, 1.0])
            positions, template = positions @ mirror, mirror
        return positions, template

    def _parts(
        self,
        numbers: np.random.Generator,
        bodies: Sequence[HumotBody],
        performed: Sequence[Performance],
    ) -> dict[str, np.ndarray]:
        """One draw of every row's joints, side by side, zeros behind them."""
        every = [
            subsampled(numbers, body.major) if self._settings.subsampling else np.arange(len(body.joints))
            for body in bodies
        ]
        arrays = blank([len(joints) for joints in every], self._frames)
        arrays["parents"] = np.full(arrays["joints"].shape, -1, np.int64)
        for row, (joints, performance) in enumerate(zip(every, performed, strict=True)):
            count = len(joints)
            arrays["places"][row, : len(performance.positions), :count] = performance.positions[:, joints]
            arrays["template"][row, :count] = performance.template[joints]
            arrays["parents"][row, :count] = parents_among(bodies[row].parents, joints.tolist())
        return arrays

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        answer = self._network(batch["source"], batch["target"], batch["tokens"])
        return losses(answer, batch["target"], batch["frames"], self._settings.consistency)

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return exported(self._network)

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Raises BenchError where they do not fit."""
        self._network.load(tensors)


DROP_MAJOR, DROP_OTHER = 0.1, 0.5
FEWEST = 2


def subsampled(numbers: np.random.Generator, major: np.ndarray) -> np.ndarray:
    """Indices of the joints that stay, increasing; drawn again where fewer than two do.

    major: ``(joints,)`` bool.
    """
    drop = np.where(major, DROP_MAJOR, DROP_OTHER)
    while True:
        joints = np.flatnonzero(numbers.random(len(major)) >= drop)
        if len(joints) >= min(FEWEST, len(major)):
            return joints


def held_out(clip: ClipArrays, starts: Sequence[int]) -> frozenset[int]:
    """The tenth of a clip's windows that are not trained on, by their starts; always the same ones.

    Four fifths of such a window are in windows beside it, most of which are trained on. The tenth is
    rounded, so that a clip of fewer than five windows keeps all of them.
    """

    def rank(start: int) -> bytes:
        return hashlib.sha256(f"{clip.character}/{clip.name}/{start}".encode()).digest()

    return frozenset(sorted(starts, key=rank)[: (len(starts) + 5) // 10])
