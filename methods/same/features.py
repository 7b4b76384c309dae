"""SAME's features of a motion: numbers of every node in every frame, from where the hips face.

The order of the numbers is that of the released weights.
"""

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.motion import Motion

from .bodies import CM, SameBody

FPS = 30.0
ROTATION, POSITION, ROOT = slice(0, 6), slice(6, 9), slice(9, 13)
VELOCITY, CHANGE, BEFORE, CONTACT = slice(13, 16), slice(16, 22), slice(22, 25), slice(25, 26)
"""Columns of a node: local rotation (two columns of its matrix); place; of the hips alone, their turn
(radians) and steps left and ahead since the frame before, and height; velocity, per second; rotation since
the frame before; place in the frame before; contact. Lengths are in cm."""
INPUTS = 26
LOW, SLOW = 5.0, 40.0
"""cm and cm/s: a node that is lower and slower is in contact."""


def see(body: SameBody, motion: Motion) -> np.ndarray:
    """``(frames, nodes, 26)`` float32: a motion at 30 fps.

    The first frame has no frame before it, and moves as the second does.
    """
    rotations, hips = _of_nodes(body, motion)
    places = CM * kinematics.forward(body.skeleton, rotations, hips)[0]
    turn = twist(rotations[:, 0])
    back = rotation.conjugate(turn)
    rotations[:, 0] = rotation.multiply(back, rotations[:, 0])
    level = places[:, 0] * np.array([1.0, 0.0, 1.0])
    step = rotation.rotate(back[:-1], np.diff(level, axis=0))
    moved = np.column_stack([angle(rotation.multiply(back[:-1], turn[1:])), step[:, 0], step[:, 2]])
    features = np.zeros((*places.shape[:2], INPUTS))
    features[..., ROTATION] = columns(rotations)
    features[..., POSITION] = rotation.rotate(back[:, None], places - level[:, None])
    features[:, 0, ROOT] = np.column_stack([_since(moved), places[:, 0, 1]])
    features[..., VELOCITY] = FPS * _since(rotation.rotate(back[1:, None], np.diff(places, axis=0)))
    changed = rotation.multiply(rotation.conjugate(rotations[:-1]), rotations[1:])
    features[..., CHANGE] = _since(columns(changed), np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0]))
    features[..., BEFORE] = features[..., POSITION] - features[..., VELOCITY] / FPS
    slow = np.linalg.norm(features[..., VELOCITY], axis=-1) < SLOW
    features[..., CONTACT.start] = (places[..., 1] < LOW) & slow
    return features.astype(np.float32)


def twist(orientations: np.ndarray) -> np.ndarray:
    """``(..., 4)`` the part of orientations ``(..., 4)`` that turns about the vertical axis.

    One that turns something upside down has none.
    """
    twists = orientations * np.array([1.0, 0.0, 1.0, 0.0])
    length = np.linalg.norm(twists, axis=-1, keepdims=True)
    defined = length > 1e-6
    return np.where(defined, twists / np.where(defined, length, 1.0), rotation.identity())


def angle(turns: np.ndarray) -> np.ndarray:
    """``(...)`` radians, from -pi to pi, of turns ``(..., 4)`` about the vertical axis."""
    half = np.arctan2(turns[..., 2], turns[..., 0])
    return np.asarray((2.0 * half + np.pi) % (2.0 * np.pi) - np.pi)


def columns(rotations: np.ndarray) -> np.ndarray:
    """``(..., 6)`` the first two columns of the matrices of rotations ``(..., 4)``, one after the other."""
    return np.swapaxes(rotation.to_matrix(rotations)[..., :2], -2, -1).reshape(*rotations.shape[:-1], 6)


def _of_nodes(body: SameBody, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Local rotations ``(frames, nodes, 4)``, tips without any, and the place of the hips, metres."""
    rotations, hips = body.aligned.see(motion)
    tips = rotation.identity(motion.frames, len(body.skeleton) - rotations.shape[1])
    return np.concatenate([rotations, tips], axis=1), hips


def _since(moves: np.ndarray, still: np.ndarray | float = 0.0) -> np.ndarray:
    """Moves ``(frames - 1, ...)`` from each frame to the next, of all frames; ``still`` of a single one."""
    first = moves[:1] if len(moves) else np.broadcast_to(still, (1, *moves.shape[1:]))
    return np.concatenate([first, moves])
