"""Retargeting as it comes: any number of frames at a time, in constant memory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from .form import Path, cleaned
from .generator import Decoder, Encoder
from .pose import MOVES, Bodies, Scale, quaternions
from .rollout import Memory


class Stream:
    """A batch of motions while they are retargeted: states, last answers, places and directions.

    encoder, scale: of the sources. decoder, bodies: of the targets. path: where the targets begin.
    """

    def __init__(
        self, encoder: Encoder, scale: Scale, decoder: Decoder, bodies: Bodies, path: Path
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
        self, poses: np.ndarray, turn: np.ndarray | None = None, clean: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The next frames: quaternions ``(frames, rows, joints, 4)`` seen from where the targets face,
        these directions ``(frames, rows)`` and the hips ``(frames, rows, 3)`` in metres.

        poses: ``(frames, rows, channels)`` of the sources (``form.see``), at least one frame.
        turn:  ``(frames, rows)``, where the targets shall face; None: where the decoder turns them.
        clean: the published clean-up of movements (``form.cleaned``).
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
            moves = cleaned(moves, poses[..., -MOVES:])
        return turns, *self._path.follow(moves, turn)
