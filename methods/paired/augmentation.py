"""Other bodies out of a body: its mirror image, and bodies without some joints."""

from collections.abc import Mapping, Sequence

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.structures import BODY22

from .features import MIRRORED, PARENTS

Arrays = dict[str, np.ndarray]

_FLIPPED = np.array([-1.0, 1.0, 1.0], np.float32)
SPARED: Mapping[str, tuple[str, ...]] = {
    "toes": ("left_toe", "right_toe"),
    "collar bones": ("left_shoulder", "right_shoulder"),
    "spine": ("spine_3",),
    "neck": ("neck",),
}
"""Joints that bodies may lack."""
_CHANCE = {"toes": 0.2, "collar bones": 0.2, "spine": 0.2, "neck": 0.08}
_TOES = (1, 3)
"""Columns of ``planted``."""


def mirrored(arrays: Mapping[str, np.ndarray]) -> Arrays:
    """A motion (as ``RoleBody.see`` gives it) of the mirrored body."""
    return {
        "rotations": arrays["rotations"][:, MIRRORED] * np.array([1, 1, -1, -1], np.float32),
        "hips": arrays["hips"] * _FLIPPED,
        "turn": arrays["turn"] * np.array([1, -1], np.float32),
        "planted": arrays["planted"][:, [2, 3, 0, 1]],
    }


def mirrored_bones(offsets: np.ndarray) -> np.ndarray:
    """Bones ``(22, 3)`` of the mirrored body."""
    found: np.ndarray = offsets[list(MIRRORED)] * _FLIPPED
    return found


def spare(numbers: np.random.Generator) -> list[str]:
    """Names of ``SPARED`` that a body shall do without: never toes, collar bones and spine at once, since
    that structure is one that the puppets' test holds out."""
    found = [name for name, chance in _CHANCE.items() if numbers.random() < chance]
    if {"toes", "collar bones", "spine"} <= set(found):
        del found[numbers.integers(3)]
    return found


def without(
    arrays: Mapping[str, np.ndarray], offsets: np.ndarray, names: Sequence[str]
) -> tuple[Arrays, np.ndarray]:
    """A motion and the bones of a body that lacks these joints: what hangs from them hangs, as it is at
    rest, from what they hung from."""
    found, bones = dict(arrays), offsets.copy()
    rotations = found["rotations"].copy()
    # parents first, so that what a joint that is left out hung from is settled
    for joint in sorted(BODY22.index(role) for name in names for role in SPARED[name]):
        for child in (child for child, parent in enumerate(PARENTS) if parent == joint):
            rotations[:, child] = rotation.multiply(rotations[:, joint], rotations[:, child])
            bones[child] += bones[joint]
        rotations[:, joint], bones[joint] = (1.0, 0.0, 0.0, 0.0), 0.0
    found["rotations"] = rotations
    if "toes" in names:
        found["planted"] = found["planted"].copy()
        found["planted"][:, _TOES] = 0.0
    return found, bones
