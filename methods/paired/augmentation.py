"""Other bodies out of a body: its mirror image, other reference poses, bodies without some joints."""

from collections.abc import Mapping, Sequence

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import JOINTS, PARENTS, folded
from retarget_bench.motion.structures import BODY22

from .features import MIRRORED
from .pose import END

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
PLAIN = 0.2
"""Share of bodies whose reference pose is left as it is."""
UNALIGNED = 0.07
"""Radians: standard deviation, over other bodies, of the size of the turns of their joints in the reference
pose; feet and hands turn twice as much."""


def mirrored(arrays: Mapping[str, np.ndarray]) -> Arrays:
    """A motion (as ``RoleBody.see`` gives it) of the mirrored body."""
    return {
        "rotations": arrays["rotations"][:, MIRRORED] * np.array([1, 1, -1, -1], np.float32),
        "hips": arrays["hips"] * _FLIPPED,
        "turn": arrays["turn"] * np.array([1, -1], np.float32),
        "planted": arrays["planted"][:, [2, 3, 0, 1]],
        "near": arrays["near"][:, ::-1],
    }


def mirrored_bones(offsets: np.ndarray) -> np.ndarray:
    """Bones ``(22, 3)`` of the mirrored body."""
    mirrored: np.ndarray = offsets[list(MIRRORED)] * _FLIPPED
    return mirrored


def turns(numbers: np.random.Generator) -> np.ndarray:
    """``(22, 4)`` by which the joints of a body are turned in its reference pose from where they ought to
    be: little, as on rigs that people make."""
    size = 0.0 if numbers.random() < PLAIN else UNALIGNED * numbers.standard_normal()
    vectors = size * numbers.standard_normal((len(BODY22), 3))
    vectors[END] *= 2.0
    return rotation.from_rotation_vector(vectors)


def reposed(
    arrays: Mapping[str, np.ndarray], offsets: np.ndarray, turned: np.ndarray
) -> tuple[Arrays, np.ndarray]:
    """The same motion and bones of the same body, its reference pose turned by ``turned`` ``(22, 4)``:
    every joint stays where it is in the world. Joints of no length still do not turn."""
    turned = turned.copy()
    for joint in np.flatnonzero(~offsets[1:].any(-1)) + 1:
        turned[joint] = turned[PARENTS[joint]]
    back = rotation.conjugate(turned[list(PARENTS[1:])])
    bones = offsets.copy()
    bones[1:] = rotation.rotate(back, offsets[1:])
    rotations = rotation.multiply(arrays["rotations"], turned)
    rotations[:, 1:] = rotation.multiply(back, rotations[:, 1:])
    return {**arrays, "rotations": rotations.astype(np.float32)}, bones


def spare(numbers: np.random.Generator) -> list[str]:
    """Names of ``SPARED`` that a body shall do without: never toes, collar bones and spine at once, since
    that structure is one that the puppets' test holds out."""
    names = [name for name, chance in _CHANCE.items() if numbers.random() < chance]
    if {"toes", "collar bones", "spine"} <= set(names):
        del names[numbers.integers(3)]
    return names


def without(
    arrays: Mapping[str, np.ndarray], offsets: np.ndarray, names: Sequence[str]
) -> tuple[Arrays, np.ndarray]:
    """A motion and the bones of a body that lacks these joints: what hangs from them hangs, as it is at
    rest, from what they hung from."""
    missing = np.isin(np.arange(JOINTS), _left_out(names))
    changed = {**arrays, "rotations": np.asarray(folded(arrays["rotations"], missing), np.float32)}
    if "toes" in names:
        changed["planted"] = changed["planted"].copy()
        changed["planted"][:, _TOES] = 0.0
    return changed, bones_without(offsets, names)


def bones_without(offsets: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """The bones ``(22, 3)`` of a body that lacks these joints."""
    bones = offsets.copy()
    for joint in _left_out(names):
        bones[np.array(PARENTS) == joint] += bones[joint]
        bones[joint] = 0.0
    return bones


def _left_out(names: Sequence[str]) -> list[int]:
    """Parents first, so that what a joint that is left out hung from is settled."""
    return sorted(BODY22.index(role) for name in names for role in SPARED[name])
