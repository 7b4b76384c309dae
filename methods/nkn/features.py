"""Features of a motion for the networks, and the motion that an answer means.

Sources: Villegas et al., CVPR 2018, and the published code. Joints are seen from where the body faces, so
that the same walk in another direction is the same walk; where it faces, and the path, are integrated again
from what the decoder says of every frame. A source may be known by positions only.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.motion import facing, rates, rotation
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character, interpolated
from retarget_bench.motion.motion import Motion

CENTIMETRE = 0.01
"""The unit that the losses' weights and the discriminator were made for, metres."""
MIDDLING = 90.0
"""Of a body's own centimetres, how many its hips stand above the floor."""
Lengths = Literal["world", "body"]
SIGNATURE = ".signature"
"""Suffix of the tensor that holds a structure's joints, after the structure's name."""
Signature = list[list[int]]
"""Per joint its parent and a number for its role."""
STILL = 0.01
"""Centimetres per frame: below this the published clean-up takes a source not to rise or fall."""


def unit(character: Character, lengths: Lengths) -> float:
    """Metres: what lengths are counted in. ``world``: centimetres. ``body``: such that all hips are as high
    at rest, whatever the body; a movement that is copied then is one that is scaled."""
    return CENTIMETRE if lengths == "world" else character.measures.hip_height / MIDDLING


@dataclass(frozen=True, eq=False)
class Sight:
    """A motion as the networks see it, at 30 frames per second.

    poses: ``(frames, 3 joints + 4)`` float32; see ``network/pose.py``. The movement of a frame is
           that since the frame before; the first frame is given that of the second.
    turn:  ``(frames,)`` unit complex numbers, where the body faces. hips: ``(frames, 3)`` metres.
    """

    poses: np.ndarray
    turn: np.ndarray
    hips: np.ndarray


def see(source: Prediction, body: Aligned, smoothing: float, unit: float) -> Sight:
    """smoothing: frames over which the direction is averaged (``facing.facing``). unit: metres."""
    places = source.positions
    if len(places) > 1:
        frames = rates.covering(len(places), source.fps)
        places = interpolated(places, *rates.between(frames, rates.FPS, source.fps, len(places)))
    turn = facing.facing(places, source.character, smoothing)
    hips = places[:, body.joints[0]]
    local = facing.seen(places[:, list(body.joints)] - hips[:, None], turn[:, None])
    local[:, 0, 1] = hips[:, 1] - hips[0, 1]
    steps = facing.seen(np.diff(hips, axis=0, prepend=hips[:1]), turn)
    turns = np.angle(turn * np.concatenate([turn[:1], turn[:-1]]).conj())
    moves = np.concatenate([steps / unit, turns[:, None]], axis=1)
    moves[:1] = moves[1:2] if len(moves) > 1 else moves[:1]
    flat = local.reshape(len(local), -1) / unit
    return Sight(np.concatenate([flat, moves], axis=1).astype(np.float32), turn, hips)


def begin(poses: np.ndarray) -> np.ndarray:
    """Windows ``(rows, frames, channels)`` whose hips rise from the window's own first frame."""
    poses = np.array(poses)
    poses[..., 1] -= poses[:, :1, 1]
    return poses


@dataclass
class Path:
    """Places and facing directions of the bodies of a batch; goes on from chunk to chunk.

    place: ``(rows, 3)`` metres. turn: ``(rows,)`` unit complex numbers. unit: ``(rows,)`` metres.
    first: nothing came before.
    """

    place: np.ndarray
    turn: np.ndarray
    unit: np.ndarray
    first: bool = True

    def follow(self, moves: np.ndarray, turn: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Directions ``(frames, rows)`` and hips ``(frames, rows, 3)`` metres after these movements
        ``(frames, rows, 4)``; turn: the directions, where they are known."""
        moves = np.array(moves, dtype=np.float64)
        if self.first:
            moves[0] = 0.0
        if turn is None:
            turn = self.turn * np.exp(1j * np.cumsum(moves[..., 3], axis=0))
        hips = self.place + np.cumsum(facing.placed(moves[..., :3] * self.unit[:, None], turn), axis=0)
        self.place, self.turn, self.first = hips[-1], turn[-1], False
        return turn, hips


def cleaned(moves: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Movements ``(..., 4)`` with the signs of the source's and no rise where the source has none: what
    the published code does to the motions that it writes as BVH files."""
    moves = np.abs(moves) * np.sign(source)
    moves[..., 1] *= np.abs(source[..., 1]) > STILL
    return moves


def answer(
    body: Aligned, turns: np.ndarray, turn: np.ndarray, hips: np.ndarray, frames: int, fps: float
) -> Motion:
    """The body's motion: ``frames`` at ``fps``, from quaternions ``(frames', joints, 4)`` seen from where
    it faces, ``turn`` ``(frames',)`` and ``hips`` ``(frames', 3)`` metres, at 30 frames per second."""
    turns = rotation.normalise(np.asarray(turns, dtype=np.float64))
    turns[:, 0] = rotation.multiply(facing.rotation(turn), turns[:, 0])
    turns = rotation.continuous(turns)
    moments = rates.between(frames, fps, rates.FPS, len(turns))
    return body.motion(interpolated(turns, *moments, turning=True), interpolated(hips, *moments), fps)
