"""Retargeting by SMRM: chunk after chunk with the GRUs' states carried on, many motions at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Prediction
from retarget_bench.motion import rates, root_rules, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from .features import JOINTS, Body, Features
from .network import MOVES, Answer, Generator

CHUNK = 256
"""Frames that go through the networks at once: memory does not grow with a clip's length."""


@dataclass(frozen=True, eq=False)
class _Row:
    """One motion to be carried to one body."""

    source: Prediction
    seen: Mapping[str, np.ndarray]
    moves: np.ndarray
    body: Body
    start: np.ndarray
    rotations: np.ndarray
    moved: np.ndarray

    @classmethod
    def of(cls, features: Features, source: Prediction, target: Character) -> _Row:
        shown = rates.at_thirty(source)
        seen = features.see(shown)
        ratio = root_rules.ratio("hip_height", source.character, target)
        return cls(
            source=source,
            seen=seen,
            moves=features.moves(seen["hips"], seen["before"], seen["turn"]),
            body=features.body(target),
            start=transfer.hips(shown)[0] * ratio,
            rotations=np.empty((shown.frames, JOINTS, 4), np.float32),
            moved=np.empty((shown.frames, MOVES), np.float32),
        )

    @property
    def frames(self) -> int:
        return len(self.rotations)


def retargeted(
    generator: Generator,
    features: Features,
    sources: Sequence[Prediction],
    targets: Sequence[Character],
    chunk: int = CHUNK,
) -> list[Motion]:
    """Every source on its target. Neither ``chunk`` nor what stands beside a row changes the result."""
    rows = [_Row.of(features, source, target) for source, target in zip(sources, targets, strict=True)]
    longest_first = sorted(rows, key=lambda row: -row.frames)
    first = 0
    for answer in stream(generator, longest_first, chunk):
        _keep(longest_first, answer, first)
        first += chunk
    return [_answered(features, row) for row in rows]


def stream(generator: Generator, rows: Sequence[_Row], chunk: int) -> Iterator[Answer]:
    """The answers for every ``chunk`` frames, of the rows (longest first) that are not at their end."""
    device = generator.turns.weight.device
    bodies = [
        torch.from_numpy(np.stack([getattr(row.body, key) for row in rows]))
        for key in ("offsets", "resting")
    ]
    offsets, resting = (each.to(device) for each in bodies)
    encoding: Tensor | None = None
    decoding: Tensor | None = None
    was = generator.training
    generator.eval()
    try:
        for first in range(0, rows[0].frames, chunk):
            going = sum(row.frames > first for row in rows)
            positions, moves = _block(rows[:going], first, chunk, device)
            with torch.inference_mode():
                codes, encoding = generator.encode(positions, moves, _of(encoding, going))
                answer, decoding = generator.decode(
                    codes, offsets[:going], resting[:going], _of(decoding, going)
                )
            yield answer
    finally:
        generator.train(was)


def _block(rows: Sequence[_Row], first: int, chunk: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """What ``chunk`` frames of the rows look like, zeros behind the last one of each."""
    size = min(chunk, rows[0].frames - first)
    positions = np.zeros((len(rows), size, JOINTS, 3), np.float32)
    moves = np.zeros((len(rows), size, MOVES), np.float32)
    for number, row in enumerate(rows):
        part = row.moves[first : first + size]
        positions[number, : len(part)] = row.seen["positions"][first : first + size]
        moves[number, : len(part)] = part
    return torch.from_numpy(positions).to(device), torch.from_numpy(moves).to(device)


def _of(state: Tensor | None, rows: int) -> Tensor | None:
    return None if state is None else state[:, :rows].contiguous()


def _keep(rows: Sequence[_Row], answer: Answer, first: int) -> None:
    rotations, moves = answer.rotations.cpu().numpy(), answer.moves.cpu().numpy()
    for row, turned, moved in zip(rows, rotations, moves, strict=False):
        left = min(row.frames - first, len(moved))
        row.rotations[first : first + left] = turned[:left]
        row.moved[first : first + left] = moved[:left]


def _answered(features: Features, row: _Row) -> Motion:
    """The answer as a motion at the source's rate, with its number of frames."""
    motion = features.motion(row.body, row.rotations, row.moved, row.seen, row.start)
    return rates.back(motion, row.source)
