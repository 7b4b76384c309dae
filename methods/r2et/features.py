"""Inputs of R2ET's network: bodies and motions, in centimetres and relative to where the body faces.

Sources: Zhang et al., CVPR 2023, and its published code, which prepares motions as NKN's does. In aligned
form (``motion/aligned.py``) a Mixamo rig has the rotations and offsets of its own file.
"""

from typing import Literal

import numpy as np

from retarget_bench.motion import facing, kinematics, rates, root_rules, transfer
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.structures import BODY22

CENTIMETRE = 0.01
"""The unit of the published statistics and losses, metres."""
LEAVES = tuple(BODY22.index(role) for role in ("head", "left_toe", "right_toe", "left_hand", "right_hand"))
"""Joints that turn nothing that a loss on positions sees. Their rotations are the source's: the published
code does not write those of its network either."""
REACH = 4.0
"""Standard deviations at which the Gaussian of the facing direction is cut off, as SciPy's."""

Size = Literal["hip_height", "chain", "published"]
"""Length by whose ratio the path is scaled. ``chain``: bones from hips to head and from hip to toe (the
paper's height, and that of training). ``published``: of the released inference, which takes the differences
of successive offsets for bones."""

_LEFT, _RIGHT = (
    [BODY22.index(f"{side}_{part}") for part in ("up_leg", "shoulder")] for side in ("left", "right")
)


def offsets(character: Character) -> np.ndarray:
    """``(22, 3)`` float32 centimetres: bones in the reference pose; in the row of the hips their height
    above the floor, in that pose.

    In the published code it is their height in the first frame, for the target that of its own motion in
    the same clip, which is part of the answer.
    """
    bones = np.array(Body22.of(character).offsets)
    bones[0] = (0.0, character.measures.hip_height, 0.0)
    return (bones / CENTIMETRE).astype(np.float32)


def rotations(motion: Motion, smoothing: float) -> np.ndarray:
    """``(frames, 22, 4)`` float32, w >= 0: local rotations in aligned form, the hips' seen from where the
    body faces. smoothing: frames at 30 per second over which that direction is averaged."""
    turns, _ = Body22.of(motion.character).see(motion)
    turn = direction(motion, smoothing * motion.fps / rates.FPS)
    turns = facing.turned(turns, turn.conj())
    return np.where(turns[..., :1] < 0, -turns, turns).astype(np.float32)


def see(motion: Motion, smoothing: float) -> dict[str, np.ndarray]:
    """A training clip at 30 fps; see ``R2ET.prepare``."""
    own = Body22.of(motion.character)
    turned = rotations(motion, smoothing)
    turn = direction(motion, smoothing)
    hips = np.zeros((motion.frames, 3))
    hips[:, 1] = motion.character.measures.hip_height
    positions, _ = kinematics.forward(own.skeleton, turned, hips)
    return {
        "rotations": turned,
        "positions": (positions / CENTIMETRE).astype(np.float32),
        "hips": (transfer.hips(motion) / CENTIMETRE).astype(np.float32),
        "turn": facing.parts(turn).astype(np.float32),
    }


def direction(motion: Motion, deviation: float) -> np.ndarray:
    """``(frames,)`` unit complex numbers, where the body faces, averaged over so many frames.

    As published: lines between upper legs and between collar bones, each frame of equal weight; a body
    without collar bones is told by its upper legs. Where it cannot be told it is +Z.
    """
    places = motion.positions[:, list(Body22.of(motion.character).joints)]
    across = (places[:, _LEFT] - places[:, _RIGHT]).sum(1)
    across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
    forward = _averaged(across[:, 0] - 1j * across[:, 2], deviation)
    defined = np.abs(forward) > 1e-6
    return np.where(defined, forward / np.where(defined, np.abs(forward), 1.0), 1.0)


def _averaged(signal: np.ndarray, deviation: float) -> np.ndarray:
    """A Gaussian average over frames ``(frames,)``, the ends repeated."""
    reach = int(REACH * deviation + 0.5)
    if reach == 0:
        return signal
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    return np.convolve(np.pad(signal, reach, mode="edge"), weights / weights.sum(), mode="valid")


def size(character: Character, kind: Size) -> float:
    """Metres: the length of a body by whose ratio paths are scaled."""
    if kind == "hip_height":
        return character.measures.hip_height
    if kind == "chain":
        return character.measures.h2
    rows = offsets(character)[:10] * CENTIMETRE
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=-1)
    return float(steps.sum() - steps[5])  # none from the head to the left upper leg


def path(hips: np.ndarray, source: Character, target: Character, kind: Size) -> np.ndarray:
    """``(frames, 3)`` metres: the source's hips as the target's, about the world's origin.

    They begin as high as the ratio of hip heights says and move by the ratio of sizes; the released code
    lets them begin at the target's own place in the same clip.
    """
    ratio = size(target, kind) / size(source, kind)
    scaled = ratio * hips
    scaled[:, 1] += (root_rules.ratios("hip_height", source, target)[1] - ratio) * hips[0, 1]
    return scaled
