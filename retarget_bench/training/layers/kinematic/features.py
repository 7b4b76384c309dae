"""Features of a motion for the networks, and the motion that an answer means.

Sources: Villegas et al., CVPR 2018, and the published code. Joints are seen from where the body faces, so
that the same walk in another direction is the same walk; where it faces, and the path, are integrated again
from what the decoder says of every frame. A source may be known by positions only.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.motion import facing, rates, root_rules, rotation
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character, interpolated
from retarget_bench.motion.motion import Motion

CENTIMETRE = 0.01
"""The unit that the losses' weights and the discriminator were made for, metres."""
MIDDLING = 90.0
"""Of a body's own centimetres, how many its hips stand above the floor."""
Lengths = Literal["world", "body"]
Variant = Literal["own", "released"]
"""Form of input and losses: ours, or that of the authors' code; see ``Nkn``."""
SOLES = ("_foot", "_toe")
"""Ends of the roles of joints that stand on the floor."""
SOFTNESS = 0.5
"""Of the minimum that the authors' code takes over time for the floor, in units of length."""
Yaw = Literal["predicted", "source"]
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

    poses: ``(frames, 3 joints + 4)`` float32; see ``pose.py``. ``own``: the movement of a frame is
           that since the frame before; the first frame is given that of the second. ``released``: it is
           that to the next frame, and the last frame does not move.
    turn:  ``(frames,)`` unit complex numbers, where the body faces. hips: ``(frames, 3)`` metres.
    height: metres of the hips above the floor in the first frame.
    """

    poses: np.ndarray
    turn: np.ndarray
    hips: np.ndarray
    height: float


def see(
    source: Prediction, body: Aligned | Body22, smoothing: float, unit: float, variant: Variant = "own"
) -> Sight:
    """smoothing: frames over which the direction is averaged (``facing.facing``). unit: metres."""
    places = source.positions
    if len(places) > 1:
        frames = rates.covering(len(places), source.fps)
        places = interpolated(places, *rates.between(frames, rates.FPS, source.fps, len(places)))
    turn = facing.facing(places, source.character, smoothing)
    hips = places[:, body.joints[0]]
    local = facing.seen(places[:, list(body.joints)] - hips[:, None], turn[:, None])
    height = hips[0, 1] - floor(places, source.character, unit)
    steps = facing.seen(np.diff(hips, axis=0, prepend=hips[:1]), turn)
    turns = np.angle(turn * np.concatenate([turn[:1], turn[:-1]]).conj())
    moves = np.concatenate([steps / unit, turns[:, None]], axis=1)
    if variant == "released":
        local[..., 1] += height
        moves = np.concatenate([moves[1:], np.zeros_like(moves[:1])])
    else:
        local[:, 0, 1] = hips[:, 1] - hips[0, 1]
        moves[:1] = moves[1:2] if len(moves) > 1 else moves[:1]
    flat = local.reshape(len(local), -1) / unit
    return Sight(np.concatenate([flat, moves], axis=1).astype(np.float32), turn, hips, height)


def floor(places: np.ndarray, character: Character, unit: float) -> float:
    """Metres: the lowest that feet and toes are, softly, as the authors' code takes it for the floor.

    places: ``(frames, joints, 3)`` metres. unit: metres; a foot that stands still is log 1.5 units above
    its floor, any other almost log 0.5 units below.
    """
    feet = [joint for role, joint in character.joint_of.items() if role.endswith(SOLES)]
    heights = places[:, feet or slice(None), 1] / unit
    lowest = heights.min(axis=1)
    return float(lowest.min() - np.log(SOFTNESS + np.exp(lowest.min() - lowest.max()))) * unit


def begin(poses: np.ndarray) -> np.ndarray:
    """Windows ``(rows, frames, channels)`` whose hips rise from the window's own first frame."""
    poses = np.array(poses)
    poses[..., 1] -= poses[:, :1, 1]
    return poses


@dataclass
class Path:
    """Places and facing directions of the bodies of a batch; goes on from chunk to chunk.

    unit: ``(rows,)`` metres. kind: of the path, and of directions where ``yaw`` is ``predicted``.
    variant: ``released`` movements are those to the next frame.
    """

    unit: np.ndarray
    kind: root_rules.PathKind = "integrated"
    yaw: Yaw = "predicted"
    variant: Variant = "own"

    def __post_init__(self) -> None:
        self._lead: tuple[np.ndarray, np.ndarray] | None = None
        self._place = self._turn = self._astray = self._askew = self._due = np.zeros(())

    def follow(
        self, moves: np.ndarray, turn: np.ndarray, hips: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Directions ``(frames, rows)`` and hips ``(frames, rows, 3)`` metres after movements
        ``(frames, rows, 4)``; they begin where the sources do.

        turn, hips: of the sources, directions and places scaled to the targets.
        """
        moves = np.array(moves, dtype=np.float64)
        if self.variant == "released":
            due = np.broadcast_to(self._due, moves[:1].shape)
            moves, self._due = np.concatenate([due, moves[:-1]]), moves[-1:]
        if self._lead is None:
            moves[0], self._lead = 0.0, (turn[0], hips[0])
            self._turn, self._place = self._lead
        turned = np.angle(turn * np.concatenate([self._lead[0][None], turn[:-1]]).conj())
        walked = np.diff(hips, axis=0, prepend=self._lead[1][None])
        self._lead = turn[-1], hips[-1]
        relative = self.kind == "relative"
        if self.yaw == "source":
            faced = turn
        elif relative:
            askew = root_rules.fading(moves[..., 3] - turned, rates.FPS, self._askew)
            faced, self._askew = turn * np.exp(1j * askew), askew[-1]
        else:
            faced = self._turn * np.exp(1j * np.cumsum(moves[..., 3], axis=0))
        steps = facing.placed(moves[..., :3] * self.unit[:, None], faced)
        if relative:
            astray = root_rules.fading(steps - walked, rates.FPS, self._astray)
            places, self._astray = hips + astray, astray[-1]
        else:
            places = self._place + np.cumsum(steps, axis=0)
        self._turn, self._place = faced[-1], places[-1]
        return faced, places


def cleaned(moves: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Movements ``(..., 4)`` with the signs of the source's and no rise where the source has none: what
    the published code does to the motions that it writes as BVH files."""
    moves = np.abs(moves) * np.sign(source)
    moves[..., 1] *= np.abs(source[..., 1]) > STILL
    return moves


def answer(
    body: Aligned | Body22, turns: np.ndarray, turn: np.ndarray, hips: np.ndarray, frames: int, fps: float
) -> Motion:
    """The body's motion: ``frames`` at ``fps``, from quaternions ``(frames', joints, 4)`` seen from where
    it faces, ``turn`` ``(frames',)`` and ``hips`` ``(frames', 3)`` metres, at 30 frames per second."""
    turns = rotation.normalise(np.asarray(turns, dtype=np.float64))
    turns = rotation.continuous(facing.turned(turns, turn))
    moments = rates.between(frames, fps, rates.FPS, len(turns))
    return body.motion(interpolated(turns, *moments, turning=True), interpolated(hips, *moments), fps)
