"""HuMoT while it is trained: parts of a skeleton in, other parts of it out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from torch import Tensor, nn

from retarget_bench.api import Method
from retarget_bench.errors import BenchError
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Batch, Phase, Terms
from retarget_bench.training.data import TrainingData

from .body import Body, sized, stature
from .design import Design
from .heading import headings, turned
from .losses import losses
from .network import Decoder, Encoder
from .sampling import kept, parents_among
from .split import held_out
from .variety import proportions, reshaped, swung

AUTOENCODER = "autoencoder"


class Autoencoder(nn.Module):
    """Encoder and decoder, which know no structure."""

    def __init__(self, design: Design) -> None:
        super().__init__()
        self.encoder, self.decoder = Encoder(design), Decoder(design)

    def forward(self, given: Batch, asked: Batch, frames: Tensor) -> Tensor:
        """``(rows, frames, joints asked, 3)`` metres. given, asked: see ``TrainingModule.draw``."""
        code = self.encoder(given["places"], given["template"], given["joints"], frames)
        answer: Tensor = self.decoder(code, asked["template"], asked["joints"], frames)
        return answer


@dataclass(frozen=True)
class Choices:
    """subsampled: joints are left out at random (SJS). consistency: weight of eq. 2.
    facing: windows are turned until bodies face ahead, as far as the joints given tell.
    sized: bodies have the usual size. varied: they have other proportions, and limbs are held otherwise.
    turned, mirrored: windows are turned about the vertical axis at random, and every other one mirrored.
    hop: frames between the starts of windows. held_out: a tenth of every clip's windows is never drawn.
    """

    subsampled: bool
    consistency: float
    facing: bool
    sized: bool
    varied: bool
    turned: bool
    mirrored: bool
    hop: int
    held_out: bool


class Performed(NamedTuple):
    """places: ``(frames, joints, 3)``. template: ``(joints, 3)``. Metres, Z up."""

    places: np.ndarray
    template: np.ndarray


class Turn(NamedTuple):
    """``(3, 3)`` each: what rows of coordinates are multiplied by."""

    places: np.ndarray
    template: np.ndarray


class Learner:
    """A ``TrainingModule`` (see ``training/contract.py``).

    bodies: by character. build: the method with tensors.
    """

    def __init__(
        self,
        training_data: TrainingData,
        config: TrainingConfig,
        bodies: Mapping[str, Body],
        design: Design,
        choices: Choices,
        build: Callable[[Mapping[str, Tensor]], Method],
    ) -> None:
        self._material, self._frames, self._bodies = training_data, config.window, bodies
        self._choices, self._build = choices, build
        self._network = Autoencoder(design)
        self.modules = nn.ModuleDict({AUTOENCODER: self._network})
        self.phases: Sequence[Phase] = (Phase(AUTOENCODER, (AUTOENCODER,)),)

    # ---------------------------------------------------------------------------------------- batches
    def draw(self, numbers: np.random.Generator, rows: int) -> Batch:
        """``frames`` ``(rows, frames)`` bool, and ``given`` and ``asked``, two draws of each row's joints,
        each with

        places ``(rows, frames, joints, 3)`` and template ``(rows, joints, 3)``, metres; joints
        ``(rows, joints)`` bool; parents ``(rows, joints)`` among them, -1 where there is none.
        """
        cast = self._cast(numbers, rows)
        left_out = held_out if self._choices.held_out else None
        windows = self._material.draw(numbers, cast, self._frames, self._choices.hop, left_out)
        bodies = [self._bodies[name] for name in cast]
        pairs = [
            self._performed(numbers, mine, windows.arrays["places"][row, :length, : len(mine.joints)])
            for row, (mine, length) in enumerate(zip(bodies, windows.lengths.tolist(), strict=True))
        ]
        given, asked = (self._parts(numbers, bodies, side) for side in zip(*pairs, strict=True))
        if self._choices.facing:
            angles = headings(given["places"], given["template"], given["joints"], windows.mask)
            for part in (given, asked):
                part["places"] = turned(part["places"], -angles)
        return {"frames": windows.mask, "given": given, "asked": asked}

    def _cast(self, numbers: np.random.Generator, rows: int) -> list[str]:
        """Structures by the root of how much motion they have, and each of their characters alike."""
        structures = list(self._material.structures.values())
        chosen = numbers.choice(len(structures), size=rows, p=self._shares)
        return [self._material.cast(numbers, 1, structures[k])[0] for k in chosen]

    @cached_property
    def _shares(self) -> np.ndarray:
        """``(structures,)``: a minute of one structure beside an hour of another is not half of all."""
        clips = self._material.clips
        frames = [
            sum(clip.frames for name in names for clip in clips[name])
            for names in self._material.structures.values()
        ]
        roots = np.sqrt(frames)
        return np.asarray(roots / roots.sum())

    def _performed(
        self, numbers: np.random.Generator, body: Body, places: np.ndarray
    ) -> tuple[Performed, Performed]:
        """A window as it is given and as it is asked for: one path of the hips, without the mean of the
        given major joints over the window."""
        template = body.template
        if self._choices.varied:
            places = swung(numbers, places, body)
        turn = self._turn(numbers)
        places, template = places @ turn.places, template @ turn.template
        given, asked = (self._shaped(numbers, body, places, template) for _ in range(2))
        centre = given.places[:, body.major].mean((0, 1))
        path = given.places[:, :1] - asked.places[:, :1]
        return Performed(given.places - centre, given.template), Performed(
            asked.places + path - centre, asked.template
        )

    def _shaped(
        self, numbers: np.random.Generator, body: Body, places: np.ndarray, template: np.ndarray
    ) -> Performed:
        """By a body of other proportions, and of the usual size, as chosen."""
        if self._choices.varied:
            factors = proportions(numbers, body)
            places, template = (reshaped(each, factors, body) for each in (places, template))
        size = sized(stature(template, body.heights)) if self._choices.sized else 1.0
        return Performed(size * places, size * template)

    def _turn(self, numbers: np.random.Generator) -> Turn:
        """A mirrored body is one whose template is mirrored: what lies where says what is left."""
        places = template = np.eye(3)
        if self._choices.turned:
            angle = 2.0 * np.pi * numbers.random()
            cosine, sine = np.cos(angle), np.sin(angle)
            places = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        if self._choices.mirrored and numbers.random() < 0.5:
            mirror = np.diag([-1.0, 1.0, 1.0])
            places, template = places @ mirror, mirror
        return Turn(places, template)

    def _parts(
        self,
        numbers: np.random.Generator,
        bodies: Sequence[Body],
        performed: Sequence[Performed],
    ) -> dict[str, np.ndarray]:
        """One draw of every row's joints, side by side, zeros behind them."""
        every = [
            kept(numbers, body.major) if self._choices.subsampled else np.arange(len(body.joints))
            for body in bodies
        ]
        rows, most = len(every), max(map(len, every))
        found = {
            "places": np.zeros((rows, self._frames, most, 3), np.float32),
            "template": np.zeros((rows, most, 3), np.float32),
            "joints": np.zeros((rows, most), bool),
            "parents": np.full((rows, most), -1, np.int64),
        }
        for row, joints in enumerate(every):
            count = len(joints)
            mine = performed[row]
            found["places"][row, : len(mine.places), :count] = mine.places[:, joints]
            found["template"][row, :count] = mine.template[joints]
            found["joints"][row, :count] = True
            found["parents"][row, :count] = parents_among(bodies[row].parents, joints)
        return found

    # ----------------------------------------------------------------------------------------- losses
    def losses(self, phase: str, batch: Batch, memory: dict[str, Any]) -> Terms:
        answer = self._network(batch["given"], batch["asked"], batch["frames"])
        return losses(answer, batch["asked"], batch["frames"], self._choices.consistency)

    # ---------------------------------------------------------------------------------------- weights
    def method(self) -> Method:
        return self._build(self.export())

    def export(self) -> Mapping[str, Tensor]:
        return {name: each.detach().clone() for name, each in self._network.state_dict().items()}

    def load(self, tensors: Mapping[str, Tensor]) -> None:
        """Raises BenchError where they do not fit."""
        take(self._network, tensors)


def take(network: Autoencoder, tensors: Mapping[str, Tensor]) -> None:
    """Put tensors in place of a network's. Raises BenchError where they do not fit."""
    device = next(network.parameters()).device
    try:
        network.load_state_dict({name: each.to(device) for name, each in tensors.items()})
    except RuntimeError as error:
        raise BenchError(f"these weights do not fit humot's networks: {error}") from None


__all__ = ["Autoencoder", "Choices", "Learner", "take"]
