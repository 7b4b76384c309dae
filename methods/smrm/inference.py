"""Retargeting by SMRM: chunk after chunk with the GRUs' states carried on, many motions at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Prediction
from retarget_bench.motion import rates, root_rules, transfer
from retarget_bench.motion.body22 import JOINTS
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from .features import Features, SmrmBody
from .network import MOVES, Generator

CHUNK = 256
"""Frames that go through the networks at once: memory does not grow with a clip's length."""


@dataclass(frozen=True, eq=False)
class _Row:
    """One motion to be carried to one body. hips: ``(frames, 3)`` metres, the source's, scaled to the body.
    rotations, moved: the answer, filled chunk by chunk."""

    inputs: Mapping[str, np.ndarray]
    moves: np.ndarray
    body: SmrmBody
    hips: np.ndarray
    rotations: np.ndarray
    moved: np.ndarray

    @classmethod
    def of(cls, features: Features, source: Prediction, target: Character) -> Self:
        shown = rates.at_thirty(source)
        inputs = features.see(shown)
        ratios = root_rules.ratios("hip_height", source.character, target)
        return cls(
            inputs=inputs,
            moves=features.moves(inputs["hips"], inputs["before"], inputs["turn"]),
            body=features.body(target),
            hips=transfer.hips(shown) * ratios,
            rotations=np.empty((shown.frames, JOINTS, 4), np.float32),
            moved=np.empty((shown.frames, MOVES), np.float32),
        )


def retargeted(
    generator: Generator,
    features: Features,
    sources: Sequence[Prediction],
    targets: Sequence[Character],
    chunk: int = CHUNK,
    path: root_rules.PathKind = "integrated",
) -> list[Motion]:
    """Every source on its target, at its own rate, by a generator in evaluation mode.

    Neither ``chunk`` nor what stands beside a row changes the result.
    """
    rows = [_Row.of(features, source, target) for source, target in zip(sources, targets, strict=True)]
    longest_first = sorted(rows, key=lambda row: -len(row.moved))
    device = generator.turns.weight.device
    resting = torch.from_numpy(np.stack([row.body.resting for row in longest_first])).to(device)
    encoding: Tensor | None = None
    decoding: Tensor | None = None
    for first in range(0, len(longest_first[0].moved), chunk):
        active = [row for row in longest_first if len(row.moved) > first]
        part, count = slice(first, first + chunk), len(active)
        positions = _block([row.inputs["positions"][part] for row in active]).to(device)
        moves = _block([row.moves[part] for row in active]).to(device)
        with torch.inference_mode():
            codes, encoding = generator.encode(positions, moves, _of(encoding, count))
            rotations, moved, decoding = generator.decode_rotations(
                codes, resting[:count], _of(decoding, count)
            )
        answers = rotations.cpu().numpy(), moved.cpu().numpy()
        for row, turned, moved in zip(active, *answers, strict=True):
            left = len(row.moved[part])
            row.rotations[part], row.moved[part] = turned[:left], moved[:left]
    return [
        rates.back(features.motion(row.body, row.rotations, row.moved, row.inputs, row.hips, path), source)
        for row, source in zip(rows, sources, strict=True)
    ]


def _block(parts: Sequence[np.ndarray]) -> Tensor:
    """``(rows, frames, ...)`` float32 from rows ``(frames', ...)``, the longest first, zeros behind the
    others."""
    block = np.zeros((len(parts), *parts[0].shape), np.float32)
    for row, part in zip(block, parts, strict=True):
        row[: len(part)] = part
    return torch.from_numpy(block)


def _of(state: Tensor | None, rows: int) -> Tensor | None:
    return None if state is None else state[:, :rows].contiguous()
