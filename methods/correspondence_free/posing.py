"""A body's mesh in a pose, brought into the T-pose by the joints that are found on it.

SKR has learned bodies in T-pose and in motion; arms half-way down it has hardly seen, and finds them up to
twenty degrees off. So limbs are centred in the surface around their joints (``bones.py``), points are
brought into the T-pose by linear blend skinning with SKIN's weights, SKR finds the joints there, where it is
exact, and these are taken back into the pose, by turns. Where that settles, SKR agrees with the joints that
points were brought to; where it does not, the pose is not known.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import PARENTS
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.reference_pose import LIMB_TOLERANCE
from retarget_bench.motion.surface_sampling import sampled, uniform

from . import bones
from .bones import ARM, LEG, RANKS, SIDES

_SPOTS, _SETS = 4096, 2
"""Points on the surface, and in how many sets SKR sees them."""
_TURNS, _SKINNED = 4, 2
"""How often joints are found anew from each start, and skinning weights at each."""
_SETTLED = 0.012
"""Mean distance of SKR's joints from those that points were brought to, as a share of the height, up to
which a pose is known. Of puppets whose pose was found it is at most 0.009, of others at least 0.02."""
_AS_CLOSE = 1.4
"""How many times as far as in the T-pose points may be from their bones in the pose that was found."""
_LOWERED = np.radians(60.0)
"""The second start: arms so far down, where SKR's own does not settle."""
_SHOULDER, _UPPER_ARM, _WHOLE_ARM = 0.36, 0.55, 1.05
"""Of that start, in lengths from hips to neck."""
_LEAN, _NOD = np.radians(15.0), np.radians(30.0)
"""Lean of a trunk, and of a head from its trunk, that a T-pose may have."""
UP = np.array([0.0, 1.0, 0.0])


class FindsJoints(Protocol):
    """The part of the method ``skr`` that is used."""

    def joints(self, points: list[np.ndarray], /) -> np.ndarray: ...


Shares = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Skinning weights of points about joints in T-pose, as of the method ``skin``."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Joints ``(22, 3)`` metres in a pose and in the T-pose, and ``(22, 3, 3)`` world rotations from one to
    the other."""

    joints: np.ndarray
    resting: np.ndarray
    turns: np.ndarray

    @classmethod
    def of(cls, joints: np.ndarray) -> "Pose":
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


@dataclass(frozen=True, eq=False)
class _Trial:
    """A pose, SKR's joints where it was brought to, and how far off both are, as shares of the height."""

    pose: Pose
    found: np.ndarray
    unsettled: float
    closeness: float

    @property
    def known(self) -> bool:
        return self.unsettled <= _SETTLED and self.closeness <= _AS_CLOSE

    @property
    def cost(self) -> float:
        return self.unsettled / _SETTLED + self.closeness / _AS_CLOSE


def into_t_pose(skr: FindsJoints, shares: Shares, vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray | None, str]:
    """A body's vertices ``(V, 3)`` metres in the T-pose, facing +Z, and what about its own pose differs:
    "" where it stands in a T-pose, and the vertices are returned as they are; no vertices where its pose
    is not known. Y is up."""
    numbers = uniform(0, 3 * _SPOTS).reshape(1, 3, _SPOTS)
    points = sampled(vertices[None], faces, numbers)[0]
    first = bones.centred(points, _found(skr, points))
    if not (difference := from_t_pose(first)):
        return vertices, ""
    best: _Trial | None = None
    for start in (first, _lowered(first)):
        joints = start
        for _ in range(_TURNS):
            trial = _tried(skr, shares, points, joints)
            joints = trial.pose.back(trial.found)
            best = trial if best is None or trial.cost < best.cost else best
        if best is not None and best.known:
            break
    assert best is not None
    if not best.known:
        return None, difference
    difference = from_t_pose(best.pose.joints) or difference
    return best.pose.brought(vertices, _weights(shares, best.pose, vertices)), difference


def _tried(skr: FindsJoints, shares: Shares, points: np.ndarray, joints: np.ndarray) -> _Trial:
    pose = Pose.of(bones.centred(points, joints))
    brought = pose.brought(points, _weights(shares, pose, points))
    found, height = _found(skr, brought), float(np.ptp(brought[:, 1]))
    apart = (found - found[0]) - (pose.resting - pose.resting[0])
    closeness = bones.fitted(points, pose.joints)[1] / max(bones.fitted(brought, pose.resting)[1], 1e-12)
    return _Trial(pose, found, float(np.linalg.norm(apart, axis=1).mean()) / max(height, 1e-12), closeness)


def _found(skr: FindsJoints, points: np.ndarray) -> np.ndarray:
    return np.asarray(skr.joints([points[k::_SETS] for k in range(_SETS)]).mean(axis=0))


def _weights(shares: Shares, pose: Pose, points: np.ndarray) -> np.ndarray:
    """``(n, 22)``: first of the nearest bone alone, then SKIN's for where these bring the points."""
    weights = np.eye(len(PARENTS))[bones.fitted(points, pose.joints)[0]]
    for _ in range(_SKINNED):
        weights = shares(pose.brought(points, weights), pose.resting)
    return weights


def from_t_pose(joints: np.ndarray) -> str:
    """What in the pose of joints ``(22, 3)`` is not of a T-pose, as a phrase; "" where all is."""
    up, across = _trunk(joints)
    lean = _angle(up, UP)
    if lean > _LEAN:
        return f"its trunk leans by {np.degrees(lean):.0f} degrees"
    arms = [_angle(_bone(joints, side, *ARM[-2:]), sign * across) for side, sign in zip(SIDES, (1, -1), strict=True)]
    if max(arms) > LIMB_TOLERANCE:
        return f"its arms are {np.degrees(max(arms)):.0f} degrees from straight out"
    legs = [_angle(_bone(joints, side, *each), -UP) for side in SIDES for each in (LEG[:2], LEG[1:3])]
    if max(legs) > LIMB_TOLERANCE:
        return f"its legs are {np.degrees(max(legs)):.0f} degrees from straight down"
    return ""


def _straightening(joints: np.ndarray) -> np.ndarray:
    """``(22, 3, 3)`` world rotations that bring a body into the T-pose, facing +Z: chest and pelvis turn to
    the front, and limbs swing the shortest way from there."""
    up, _ = _trunk(joints)
    upright = up if _angle(up, UP) > _LEAN else UP
    pelvis, chest = (_front(_across(joints, part), upright) for part in ("up_leg", "arm"))
    both = rotation.from_matrix(np.stack([pelvis, chest]))
    between = rotation.to_matrix(rotation.slerp(both[[0, 0]], both[[1, 1]], np.array([1.0, 2.0]) / 3.0))
    turns = np.empty((len(PARENTS), 3, 3))
    turns[[RANKS[f"{part}"] for part in ("hips", "spine_1", "spine_2", "spine_3")]] = [pelvis, *between, chest]
    head = joints[RANKS["head"]] - joints[RANKS["neck"]]
    nods = _angle(chest @ head, UP) > _NOD
    turns[[RANKS["neck"], RANKS["head"]]] = _swung(chest, head, UP) if nods else chest
    for side, outward in zip(SIDES, (1.0, -1.0), strict=True):
        turns[RANKS[f"{side}_shoulder"]] = chest
        for (top, middle, *ends), turn, way in (
            (ARM, chest, np.array([outward, 0.0, 0.0])),
            (LEG, pelvis, -UP),
        ):
            upper = _swung(turn, _bone(joints, side, top, middle), way)
            lower = _swung(upper, _bone(joints, side, middle, ends[0]), way)
            turns[RANKS[f"{side}_{top}"]] = upper
            turns[[RANKS[f"{side}_{part}"] for part in (middle, *ends)]] = lower
    return turns


def _lowered(joints: np.ndarray) -> np.ndarray:
    """``(22, 3)``: the same body with its arms straight, out and down."""
    joints, unit = joints.copy(), float(np.linalg.norm(joints[RANKS["neck"]] - joints[RANKS["hips"]]))
    arms = [RANKS[f"{side}_arm"] for side in SIDES]
    middle, across = joints[arms].mean(axis=0), _across(joints, "arm")
    width = max(_SHOULDER * unit, float(np.linalg.norm(joints[arms[0]] - joints[arms[1]])) / 2.0)
    across = across * [1.0, 0.0, 1.0]
    across /= max(float(np.linalg.norm(across)), 1e-12)
    for side, outward in zip(SIDES, (1.0, -1.0), strict=True):
        way = np.cos(_LOWERED) * outward * across - np.sin(_LOWERED) * UP
        for part, far in zip(ARM, (0.0, _UPPER_ARM, _WHOLE_ARM), strict=True):
            joints[RANKS[f"{side}_{part}"]] = middle + outward * width * across + far * unit * way
    return joints


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
