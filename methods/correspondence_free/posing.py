"""A body's mesh in a pose, brought into the T-pose by the joints that are found on it.

SKR has learned bodies in T-pose and in motion. Arms half-way down it has hardly seen, and finds them up to
twenty degrees off. So limbs are centred in the surface around them (``bones.py``), points are brought into
the T-pose by linear blend skinning with SKIN's weights, SKR finds the joints there, where it is exact, and
these are taken back into the pose, by turns. Where that settles, SKR agrees with the joints that points
were brought to; where it does not, the pose is not known.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.reference_pose import LIMB_TOLERANCE
from retarget_bench.motion.surface_sampling import sampled, uniform

from . import bones
from .bones import ARM, LEG, RANKS, SIDES
from .online import FindsJoints, Networks

_SPOTS, _SETS = 4096, 2
"""Points on the surface, and in how many sets SKR sees them: one set scatters, more say the same."""
_TURNS, _SKINNED = 4, 2
"""How often joints are found anew, and skinning weights each time."""
_SETTLED = 0.01
"""Mean distance of SKR's joints from those that points were brought to, as a share of the height, up to
which a pose is known. Of puppets with lowered arms it is at most 0.009; from 0.012 on poses are often
wrong."""
_LEAN, _NOD = np.radians(15.0), np.radians(30.0)
"""Lean of a trunk, and of a head from its trunk, that a T-pose may have."""
_UNKNOWN = (
    "the joints that are found on its mesh do not fit it ({}): the body is in a pose or of a kind that "
    "SKR does not know; give its mesh in a T-pose, arms straight out, or ask another method"
)
"""Why no target is made of a mesh, with what its joints show."""
_LEGS = [RANKS[f"{side}_{part}"] for side in SIDES for part in LEG]
_UP = np.array([0.0, 1.0, 0.0])


Shares = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Skinning weights of points about joints in T-pose, as of the method ``skin``."""


@dataclass(frozen=True, eq=False)
class _Pose:
    """Joints ``(22, 3)`` metres in a pose and in the T-pose, and ``(22, 3, 3)`` world rotations from one to
    the other."""

    joints: np.ndarray
    resting: np.ndarray
    turns: np.ndarray

    @classmethod
    def of(cls, joints: np.ndarray) -> "_Pose":
        turns = _straightening(joints)
        resting = np.empty_like(joints)
        for rank, above in enumerate(PARENTS):
            moved = turns[above] @ (joints[rank] - joints[above])
            resting[rank] = joints[0] if above < 0 else resting[above] + moved
        return cls(joints, resting, turns)

    def brought(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Points ``(n, 3)`` in the T-pose (linear blend skinning). weights: ``(n, 22)``."""
        shifts = self.resting - np.einsum("jab,jb->ja", self.turns, self.joints)
        transforms = np.concatenate([self.turns, shifts[..., None]], axis=2).reshape(-1, 12)
        each = (weights @ transforms).reshape(-1, 3, 4)
        return np.asarray(np.einsum("nab,nb->na", each[..., :3], points) + each[..., 3])

    def back(self, resting: np.ndarray) -> np.ndarray:
        """Joints ``(22, 3)`` of the T-pose in the pose; each goes with its parent."""
        parents = np.maximum(PARENTS, 0)
        away = resting - self.resting[parents]
        return np.asarray(self.joints[parents] + np.einsum("jba,jb->ja", self.turns[parents], away))


def into_t_pose(
    networks: Networks, vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, tuple[str, ...]]:
    """A body's vertices ``(V, 3)`` metres in the T-pose, facing +Z, and a note on it; as they are, and
    none, where the body stands in it. Y is up.

    Raises NotSupported where its pose is not known.
    """
    skr, shares = networks.skr, networks.skin.shares
    numbers = uniform(0, 3 * _SPOTS).reshape(1, 3, _SPOTS)
    points = sampled(vertices[None], faces, numbers)[0]
    found = _found(skr, points)
    centred = bones.centred(points, found)
    centred[_LEGS] = found[_LEGS]  # clothes around legs hide their middle
    if not (difference := _difference(centred)):
        return vertices, ()
    best, least = None, np.inf
    for _ in range(_TURNS):
        pose = _Pose.of(bones.centred(points, found))
        brought = pose.brought(points, _weights(shares, pose, points))
        resting = _found(skr, brought)
        apart = (resting - resting[0]) - (pose.resting - pose.resting[0])
        unsettled = float(np.linalg.norm(apart, axis=1).mean() / max(np.ptp(brought[:, 1]), 1e-12))
        if unsettled < least:
            best, least = pose, unsettled
        found = pose.back(resting)
    if best is None or least > _SETTLED:
        raise NotSupported(_UNKNOWN.format(difference))
    note = f"its mesh was brought into the T-pose: {_difference(best.joints) or difference}"
    return best.brought(vertices, _weights(shares, best, vertices)), (note,)


def _found(skr: FindsJoints, points: np.ndarray) -> np.ndarray:
    return np.asarray(skr.joints([points[k::_SETS] for k in range(_SETS)]).mean(axis=0))


def _weights(shares: Shares, pose: _Pose, points: np.ndarray) -> np.ndarray:
    """``(n, 22)``: first of the nearest bone alone, then SKIN's for where these bring the points."""
    weights = np.eye(len(PARENTS))[bones.owners(points, pose.joints)]
    for _ in range(_SKINNED):
        weights = shares(pose.brought(points, weights), pose.resting)
    return weights


def _difference(joints: np.ndarray) -> str:
    """What in the pose of joints ``(22, 3)`` is not of a T-pose, as a phrase; "" where all is."""
    up, across = _trunk(joints)
    lean = _angle(up, _UP)
    if lean > _LEAN:
        return f"its trunk leans by {np.degrees(lean):.0f} degrees"
    arms = [
        _angle(_bone(joints, side, *ARM[1:]), outward * across)
        for side, outward in zip(SIDES, (1.0, -1.0), strict=True)
    ]
    if max(arms) > LIMB_TOLERANCE:
        return f"its arms are {np.degrees(max(arms)):.0f} degrees from straight out"
    legs = [_angle(_bone(joints, side, *each), -_UP) for side in SIDES for each in (LEG[:2], LEG[1:3])]
    if max(legs) > LIMB_TOLERANCE:
        return f"its legs are {np.degrees(max(legs)):.0f} degrees from straight down"
    return ""


def _straightening(joints: np.ndarray) -> np.ndarray:
    """``(22, 3, 3)`` world rotations that bring a body into the T-pose, facing +Z: chest and pelvis turn to
    the front, and limbs swing the shortest way from there."""
    up, _ = _trunk(joints)
    upright = up if _angle(up, _UP) > _LEAN else _UP
    pelvis, chest = (_front(_across(joints, part), upright) for part in ("up_leg", "arm"))
    both = rotation.from_matrix(np.stack([pelvis, chest]))
    between = rotation.to_matrix(rotation.slerp(both[[0, 0]], both[[1, 1]], np.array([1.0, 2.0]) / 3.0))
    turns = np.empty((len(PARENTS), 3, 3))
    spine = [RANKS[part] for part in ("hips", "spine_1", "spine_2", "spine_3")]
    turns[spine] = [pelvis, *between, chest]
    head = joints[RANKS["head"]] - joints[RANKS["neck"]]
    nods = _angle(chest @ head, _UP) > _NOD
    turns[[RANKS["neck"], RANKS["head"]]] = _swung(chest, head, _UP) if nods else chest
    for side, outward in zip(SIDES, (1.0, -1.0), strict=True):
        turns[RANKS[f"{side}_shoulder"]] = chest
        for (top, middle, *ends), turn, way in (
            (ARM, chest, np.array([outward, 0.0, 0.0])),
            (LEG, pelvis, -_UP),
        ):
            upper = _swung(turn, _bone(joints, side, top, middle), way)
            lower = _swung(upper, _bone(joints, side, middle, ends[0]), way)
            turns[RANKS[f"{side}_{top}"]] = upper
            turns[[RANKS[f"{side}_{part}"] for part in (middle, *ends)]] = lower
    return turns


def _trunk(joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors ``(3,)`` from hips to neck, and from right to left."""
    up = joints[RANKS["neck"]] - joints[RANKS["hips"]]
    across = _across(joints, "up_leg") + _across(joints, "arm")
    return up / np.linalg.norm(up), across / max(float(np.linalg.norm(across)), 1e-12)


def _across(joints: np.ndarray, part: str) -> np.ndarray:
    return np.asarray(joints[RANKS[f"left_{part}"]] - joints[RANKS[f"right_{part}"]])


def _bone(joints: np.ndarray, side: str, first: str, last: str) -> np.ndarray:
    return np.asarray(joints[RANKS[f"{side}_{last}"]] - joints[RANKS[f"{side}_{first}"]])


def _front(across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """``(3, 3)``: the rotation that brings ``across`` to +X and ``up`` to +Y."""
    level = across - (across @ up) * up
    level = level / max(float(np.linalg.norm(level)), 1e-12)
    return np.stack([level, up, np.cross(level, up)])


def _swung(turn: np.ndarray, bone: np.ndarray, way: np.ndarray) -> np.ndarray:
    """``(3, 3)``: a turn, and after it the shortest one that brings a bone to a direction."""
    return np.asarray(rotation.to_matrix(rotation.between(turn @ bone, way)) @ turn)


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    cos = one @ other / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-12)
    return float(np.arccos(np.clip(cos, -1.0, 1.0)))
