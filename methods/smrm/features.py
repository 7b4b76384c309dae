"""Features of a motion for SMRM, and the motion that an answer means.

A frame is the places of 22 joints relative to the hips and three numbers of the hips themselves, as they
look from where the character faces in that very frame: nothing is averaged over time, so that frames can
be handled as they come. The direction is given back to the answer.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from retarget_bench.api import Prediction
from retarget_bench.motion import facing, kinematics, root_rules, rotation, transfer
from retarget_bench.motion.body22 import JOINTS, Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

FPS = 30.0

Normalisation = Literal["body", "global", "none"]
Root = Literal["height", "displacement", "position"]
Yaw = Literal["removed", "kept"]


@dataclass(frozen=True, eq=False)
class SmrmBody:
    """A body as the networks see it.

    unit:    metres that every length is divided by. offsets: ``(22, 3)`` bones, in units.
    resting: ``(22, 3)`` places in the T-pose relative to the hips, in units.
    """

    aligned: Body22
    unit: float
    offsets: np.ndarray
    resting: np.ndarray


@dataclass(frozen=True)
class Features:
    """The choices that the paper leaves open about what a network sees; see ``SMRM``."""

    normalisation: Normalisation
    root: Root
    yaw: Yaw

    def body(self, character: Character) -> SmrmBody:
        aligned = Body22.of(character)
        unit = character.measures.hip_height if self.normalisation == "body" else 1.0
        offsets = (aligned.offsets / unit).astype(np.float32)
        still, none = rotation.identity(1, JOINTS), np.zeros((1, 3))
        resting = kinematics.forward(aligned.skeleton, still, none)[0][0] / unit
        return SmrmBody(aligned, unit, offsets, resting.astype(np.float32))

    def see(self, source: Prediction) -> Mapping[str, np.ndarray]:
        """A source at 30 fps as arrays ``(frames, ...)`` float64, lengths in the body's unit.

        positions: ``(22, 3)`` relative to the hips, and rotations: ``(22, 4)`` in aligned form, both seen
        from where the character faces; rotations are not there where a source is known by positions only.
        hips: ``(3,)`` in the world, and before: the same one frame earlier (in the first frame: now).
        turn: ``(2,)`` where it faces, the parts of a unit complex number.
        """
        body = self.body(source.character)
        if self.yaw == "removed":
            turn = facing.facing(source.positions, source.character)
        else:
            turn = np.ones(source.frames, dtype=complex)
        hips = transfer.hips(source)
        if isinstance(source, Motion):
            rotations = self._rotations(body, source, turn)
            places = kinematics.forward(body.aligned.skeleton, rotations, np.zeros_like(hips))[0]
            arrays = {"rotations": rotation.continuous(rotation.normalise(rotations))}
        else:
            joints = source.positions[:, list(body.aligned.joints)]
            places, arrays = facing.seen(joints - hips[:, None], turn[:, None]), {}
        hips = hips / body.unit
        return arrays | {
            "positions": places / body.unit,
            "hips": hips,
            "before": np.concatenate([hips[:1], hips[:-1]]),
            "turn": facing.parts(turn),
        }

    def _rotations(self, body: SmrmBody, motion: Motion, turn: np.ndarray) -> np.ndarray:
        rotations = body.aligned.see(motion)[0]
        return facing.turned(rotations, turn.conj()) if self.yaw == "removed" else rotations

    def moves(self, hips: np.ndarray, before: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """The three numbers of the hips that a network sees ``(..., frames, 3)``: left, up, forward.

        hips, before: ``(..., frames, 3)`` and turn: ``(..., frames, 2)`` as ``see`` gives them.
        """
        facings = turn[..., 0] + 1j * turn[..., 1]
        if self.root == "position":
            start = hips[..., :1, :] * np.array([1.0, 0.0, 1.0], hips.dtype)
            return facing.seen(hips - start, facings[..., :1])
        step = facing.seen(hips - before, facings)
        if self.root == "height":
            step[..., 1] = hips[..., 1]
        return step

    def moved_by(self, shifts: np.ndarray) -> np.ndarray:
        """The change that shifts of the hips ``(..., frames, 3)``, seen from where the character faces,
        make in ``moves``; what turns between two frames is left out."""
        if self.root == "position":
            return shifts
        change = np.diff(shifts, axis=-2, prepend=shifts[..., :1, :])
        if self.root == "height":
            change[..., 1] = shifts[..., 1]
        return np.asarray(change)

    def path(self, moves: Tensor, turn: Tensor) -> Tensor:
        """Path of the hips ``(..., frames, 3)``, level from their first place on.

        The inverse of ``moves``. Up it is the height above the floor; where ``root`` is ``displacement``,
        that above the first place.
        moves: ``(..., frames, 3)``; turn: ``(..., frames, 2)``.
        """
        cos, sin = (turn[..., :1, :] if self.root == "position" else turn).unbind(-1)
        left, up, ahead = moves.unbind(-1)
        x, z = ahead * sin + left * cos, ahead * cos - left * sin
        if self.root != "position":
            x, z = _summed(x), _summed(z)
        return torch.stack([x, _summed(up) if self.root == "displacement" else up, z], -1)

    def velocity(self, moves: Tensor) -> Tensor:
        """``(..., frames - 1, 3)`` units per frame: how the hips move, whatever ``moves`` says of them."""
        if self.root == "displacement":
            return moves[..., 1:, :]
        change = moves.diff(dim=-2)
        if self.root == "position":
            return change
        left, _, ahead = moves[..., 1:, :].unbind(-1)
        return torch.stack([left, change[..., 1], ahead], -1)

    def motion(
        self,
        body: SmrmBody,
        rotations: np.ndarray,
        moves: np.ndarray,
        source: Mapping[str, np.ndarray],
        lead: np.ndarray,
        kind: root_rules.PathKind = "integrated",
    ) -> Motion:
        """The motion that an answer means.

        rotations: ``(frames, 22, 4)`` and moves: ``(frames, 3)``, the answer. source: what ``see`` gave.
        lead: ``(frames, 3)`` metres, the source's hips scaled to the body. kind: of the path.
        """
        turn = source["turn"]
        turned = facing.turned(rotations.astype(np.float64), turn[:, 0] + 1j * turn[:, 1])
        path = self.path(torch.from_numpy(moves.astype(np.float64)), torch.from_numpy(turn)).numpy()
        hips = path * body.unit + lead[0] * np.array([1.0, float(self.root == "displacement"), 1.0])
        if kind == "relative":
            hips = root_rules.relative(hips, lead, FPS)
        return body.aligned.motion(rotation.continuous(rotation.normalise(turned)), hips, FPS)


def _summed(steps: Tensor) -> Tensor:
    """``(..., frames)`` the way since the first frame; the step that led to the first does not count."""
    total = steps.cumsum(-1)
    return total - total[..., :1]
