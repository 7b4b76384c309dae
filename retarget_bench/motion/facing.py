"""Facing direction of a character, and vectors relative to it.

The forward direction is square to the line from the right to the left, hips and shoulders together, level.
Directions on the floor are unit complex numbers z + ix: 1 is forward along +Z, i is +X, the left.
"""

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.rotation import multiply

SIDES = (("left_up_leg", "right_up_leg"), ("left_arm", "right_arm"))


def unknown(character: Character) -> str:
    """The reason why a character has no facing direction, as a sentence; "" where it has one."""
    if any(a in character.joint_of and b in character.joint_of for a, b in SIDES):
        return ""
    return f"{character.name} has neither both upper legs nor both upper arms to tell where it faces"


def facing(places: np.ndarray, character: Character, smoothing: float = 0.0) -> np.ndarray:
    """``(frames,)`` unit complex numbers: the forward direction.

    places:    ``(frames, joints, 3)`` of all joints of the character.
    smoothing: frames, standard deviation of the Gaussian over which the direction is averaged; 0: none.
    Where the direction cannot be told (lying on one side), the last frame that could tell decides.
    """
    across = np.zeros((len(places), 3))
    for left, right in SIDES:
        if left in character.joint_of and right in character.joint_of:
            across += places[:, character.joint_of[left]] - places[:, character.joint_of[right]]
    forward = across[:, 0] - 1j * across[:, 2]  # across x up = (-z, 0, x)
    if smoothing > 0:
        forward = smooth(forward, smoothing)
    defined = np.abs(forward) > 1e-3 * character.height
    if not defined.any():
        return np.ones(len(places), dtype=complex)
    last = np.maximum.accumulate(np.where(defined, np.arange(len(places)), int(defined.argmax())))
    return forward[last] / np.abs(forward[last])


def smooth(signal: np.ndarray, deviation: float) -> np.ndarray:
    """A Gaussian average over frames ``(frames,)``, the ends repeated."""
    reach = int(3 * deviation)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    return np.convolve(np.pad(signal, reach, mode="edge"), weights / weights.sum(), mode="valid")


def seen(vectors: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Vectors ``(..., 3)`` of the world as left, up, forward of a direction ``(...)`` (broadcast)."""
    return _with_level(vectors, (vectors[..., 2] + 1j * vectors[..., 0]) * turn.conj())


def placed(vectors: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """The inverse of ``seen``: left, up, forward as vectors of the world."""
    return _with_level(vectors, (vectors[..., 2] + 1j * vectors[..., 0]) * turn)


def rotation(turn: np.ndarray) -> np.ndarray:
    """``(..., 4)`` quaternions that turn +Z into the direction ``(...)``, about the vertical axis."""
    half = np.angle(turn) / 2
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, np.sin(half), zero], axis=-1)


def turned(rotations: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Local rotations ``(frames, joints, 4)`` of a body that is turned as +Z is into the direction
    ``(frames,)``; by the conjugate direction: as they are seen from there."""
    result = np.array(rotations)
    result[:, 0] = multiply(rotation(turn), result[:, 0])
    return result


def parts(turn: np.ndarray) -> np.ndarray:
    """``(..., 2)`` the real and the imaginary parts of directions, for arrays of real numbers."""
    return np.stack([turn.real, turn.imag], axis=-1)


def _with_level(vectors: np.ndarray, level: np.ndarray) -> np.ndarray:
    return np.stack([level.imag, vectors[..., 1], level.real], axis=-1)
