"""Input of a feature network: channels per frame in the facing frame, cut into windows.

The channels are chosen so that nothing depends on where a clip is done and which way it faces, while
gliding feet, trembling and standing still are visible. With h the height of the body, for every frame

    places   (x, y, z) of every joint: x and z from the hips, y from the floor, over h
    speeds   log(0.01 + |velocity|) of every joint in the world, heights per second
    jolts    log(0.2 + |acceleration|) likewise, heights per second squared
    root     (x, z) velocity of the hips, over h, per second, and the yaw rate in radians per second

seen in the facing frame: left is +x, forward is +z. Its forward direction is square to the line from
the right to the left (hips and shoulders together), made smooth over a third of a second.

Speeds and jolts are sizes, not vectors, since filters that learn to rebuild real motion let hardly anything
pass that goes to and fro from frame to frame, as trembling does.
"""

from collections.abc import Sequence

import numpy as np

from retarget_bench.api import Source
from retarget_bench.api.comparison import structure_joints
from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing
from retarget_bench.motion.character import Character

FRAMES = 64
"""Of a window of one structure's network, at ``RATE`` frames per second."""
RATE = 30.0
HOP = 8
"""Frames from one scored window to the next, likewise."""
SMOOTHING = 10.0
"""Frames: standard deviation of the Gaussian over which the facing direction is averaged."""
SPEED_OFFSET = 0.01
"""Heights per second, added before the logarithm: slower counts about as standing still. Real motion that
stands still sways by more."""
ACCELERATION_OFFSET = 0.2
"""Heights per second squared, likewise of accelerations."""


def unseeable(character: Character) -> str:
    """Reason why a body has no facing frame or scale; "" where it has."""
    if not character.height > 0:
        return f"{character.name} has no height"
    return facing.unknown(character)


def channels(motion: Source, joints: Sequence[int] | None = None, floor: float = 0.0) -> np.ndarray:
    """``(frames, 5 * joints + 3)`` float64 channels of a motion, brought to 30 frames per second.

    joints: which joints are seen, in this order; None: the body's, without fingers, props and hair.
    floor:  metres, the height of the floor. Raises NotSupported where ``unseeable`` says why.
    """
    character = motion.character
    if reason := unseeable(character):
        raise NotSupported(reason)
    places = _at_rate(motion)
    indices = structure_joints(character) if joints is None else np.asarray(joints)
    hips = places[:, character.joint_of.get("hips", 0)] * (1.0, 0.0, 1.0)
    turn = facing.facing(places, character, SMOOTHING)
    centred = places[:, indices] - hips[:, None] - (0.0, floor, 0.0)
    height = float(character.height)
    velocity, root = _rates(places[:, indices]) / height, _rates(hips) / height
    yaw = np.angle(turn[1:] * turn[:-1].conj(), deg=False) * RATE if len(turn) > 1 else np.zeros(0)
    parts = [
        facing.seen(centred, turn[:, None]) / height,
        np.log(SPEED_OFFSET + _length(velocity)),
        np.log(ACCELERATION_OFFSET + _length(_rates(velocity))),
        facing.seen(root, turn)[:, [0, 2]],
        np.concatenate([yaw[:1], yaw]) if len(yaw) else np.zeros(len(turn)),
    ]
    return np.concatenate([part.reshape(len(places), -1) for part in parts], axis=1)


def windows(channels: np.ndarray, hop: int = HOP, frames: int = FRAMES) -> np.ndarray:
    """``(windows, frames, channels)`` view of channels ``(all frames, channels)``; none where too few."""
    if len(channels) < frames:
        return np.zeros((0, frames, channels.shape[1]))
    cut = np.lib.stride_tricks.sliding_window_view(channels, frames, axis=0)[::hop]
    return cut.transpose(0, 2, 1)


def speeds(channels: np.ndarray, hop: int = HOP, frames: int = FRAMES) -> np.ndarray:
    """``(windows,)`` mean level speed of the hips in every window, heights per second."""
    level = np.hypot(channels[:, -3], channels[:, -2])
    return windows(level[:, None], hop, frames)[..., 0].mean(axis=1)


def _at_rate(motion: Source) -> np.ndarray:
    """``(frames, joints, 3)`` metres at 30 frames per second."""
    if abs(motion.fps - RATE) <= 1e-3 * RATE:
        return motion.positions
    return motion.character.positions(motion.positions, motion.fps).resample(RATE).positions


def _rates(places: np.ndarray) -> np.ndarray:
    """Change per second of places ``(frames, ..., 3)``; the first frame has the second one's."""
    if len(places) < 2:
        return np.zeros_like(places)
    steps = np.diff(places, axis=0) * RATE
    return np.concatenate([steps[:1], steps])


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("fjc,fjc->fj", vectors, vectors))
