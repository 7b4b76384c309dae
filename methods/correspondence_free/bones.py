"""Bones between the 22 joints, and the points of a surface around each."""

import numpy as np

from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.structures import BODY22

RANKS = {role: rank for rank, role in enumerate(BODY22)}
SIDES = ("left", "right")
ARM, LEG = ("arm", "forearm", "hand"), ("up_leg", "leg", "foot", "toe")
_TIPS = {"head": 1.0, "toe": 0.5, "hand": 0.7}
"""How far the last bones reach beyond their joint, in lengths of the bone before: to the top of the head,
and the tips of toes and fingers."""
_LIMB_ROUNDS, _RADIUS_ROUNDS = 12, 2
"""How often limbs are moved into their middle, and points shared out; more changes next to nothing."""
_FEWEST = 8
"""Points that a cross-section and the radius of a bone are found from."""
_SLAB = 0.25
"""Half the thickness of a cross-section, in lengths of the bone above."""


def _bones() -> list[tuple[int, int, float, int]]:
    """First and last joint, how far beyond the last it reaches, and the joint that it follows."""
    bones = [(above, rank, 0.0, above) for rank, above in enumerate(PARENTS) if above >= 0]
    for side in SIDES:  # what lies between collar bones and shoulders is one with the collar bone
        collar = RANKS[f"{side}_shoulder"]
        bones.remove((collar, RANKS[f"{side}_arm"], 0.0, collar))
        bones.remove((RANKS["spine_3"], collar, 0.0, RANKS["spine_3"]))
        bones.append((RANKS["spine_3"], RANKS[f"{side}_arm"], 0.0, collar))
    for rank, role in enumerate(BODY22):
        if (beyond := _TIPS.get(role.removeprefix("left_").removeprefix("right_"))) is not None:
            bones.append((PARENTS[rank], rank, beyond, rank))
    return bones


_BONES = _bones()
_OWNERS = np.array([owner for *_, owner in _BONES])


def _distances(points: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """``(n, bones)`` metres from points ``(n, 3)`` to the bones of joints ``(22, 3)``."""
    first, last, beyond = (np.array(each) for each in list(zip(*_BONES, strict=True))[:3])
    bones = joints[last] - joints[first]
    starts = np.where(beyond[:, None] > 0, joints[last], joints[first])
    bones = np.where(beyond[:, None] > 0, beyond[:, None] * bones, bones)
    away = points[:, None] - starts
    along = np.einsum("nbc,bc->nb", away, bones) / np.maximum((bones**2).sum(axis=1), 1e-12)
    nearest = np.clip(along, 0.0, 1.0)[..., None] * bones
    return np.asarray(np.linalg.norm(away - nearest, axis=2))


def owners(points: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """``(n,)`` the joint that each point ``(n, 3)`` follows: that of the nearest cylinder around a bone,
    whose radius is the median of its own points' distances."""
    distances = _distances(points, joints)
    nearest = distances.argmin(axis=1)
    for _ in range(_RADIUS_ROUNDS):
        radii = np.zeros(len(_BONES))
        for bone in range(len(_BONES)):
            own = distances[nearest == bone, bone]
            radii[bone] = np.median(own) if len(own) >= _FEWEST else 0.0
        nearest = (distances - radii).argmin(axis=1)
    return np.asarray(_OWNERS[nearest])


def centred(points: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """``(22, 3)`` joints of which elbows, wrists, knees and ankles have moved into the middle of the limbs
    that points ``(n, 3)`` show. Bones keep their lengths; all other joints stay, toes go with their
    foot."""
    joints = joints.copy()
    for _ in range(_LIMB_ROUNDS):
        followed = owners(points, joints)
        for side in SIDES:
            for limb in (ARM, LEG):
                top, middle, end, *toe = (RANKS[f"{side}_{part}"] for part in limb)
                own = np.isin(followed, (top, middle, *(() if toe else (end,))))
                before = joints.copy()
                for above, joint in ((top, middle), (middle, end)):
                    bone = before[joint] - before[above]
                    to = _middle(points[own], before[joint], bone) - joints[above]
                    joints[joint] = joints[above] + to * (_length(bone) / max(_length(to), 1e-12))
                joints[toe] += joints[end] - before[end]
    return joints


def _middle(points: np.ndarray, joint: np.ndarray, bone: np.ndarray) -> np.ndarray:
    """``(3,)`` the middle of the limb's cross-section through a joint, across the bone above it."""
    along = bone / max(_length(bone), 1e-12)
    near = points[np.abs((points - joint) @ along) < _SLAB * _length(bone)]
    if len(near) < _FEWEST:
        return joint
    away = near.mean(axis=0) - joint
    return np.asarray(joint + away - (away @ along) * along)


def _length(vector: np.ndarray) -> float:
    return float(np.linalg.norm(vector))
