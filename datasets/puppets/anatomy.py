"""What the solver knows of human limbs: how they hang, bend naturally, and what they weigh."""

from __future__ import annotations

from functools import cache

import numpy as np

from .anthropometry import human
from .bodies import Body
from .limbs import Limb, unit
from .score import SIDES, sign

X, Y, Z = np.eye(3)


@cache
def leg(body: Body) -> Limb:
    """Thigh and shank of either side: both knees bend forward."""
    p = body.proportions
    return Limb(-Y, X, p.thigh, p.shank, ease=-Y, natural=X, tightest=np.radians(28.0), exact=0.996)


@cache
def arm(side: str, body: Body) -> Limb:
    """Upper arm and forearm: easy reach is forward, down and a little outward, elbow behind and below."""
    p, out = body.proportions, sign(side)
    ease = unit(np.array([0.45 * out, -0.25, 0.85]))
    elbow = np.array([0.25 * out, -0.7, -0.65])
    elbow = unit(elbow - ease * float(elbow @ ease))
    return Limb(
        bone=out * X,
        hinge=-out * Y,
        upper=p.upper_arm,
        lower=p.forearm,
        ease=ease,
        natural=np.cross(elbow, ease),
        tightest=np.radians(32.0),
        exact=0.985,
    )


_SEGMENTS = (
    # near end, far end, share of the body's mass, place of its centre from the near end
    ("hips", "neck", 0.459, 0.50),
    ("head", "head", 0.082, 0.50),
    *((f"{side}_up_leg", f"{side}_leg", 0.111, 0.43) for side in SIDES),
    *((f"{side}_leg", f"{side}_foot", 0.051, 0.43) for side in SIDES),
    *((f"{side}_foot", f"{side}_toe", 0.014, 0.50) for side in SIDES),
    *((f"{side}_arm", f"{side}_forearm", 0.031, 0.45) for side in SIDES),
    *((f"{side}_forearm", f"{side}_hand", 0.023, 0.50) for side in SIDES),
)
"""Plagenhoef, Evans and Abdelnour (1983), mean of women and men; the hand's mass goes with the forearm."""


def centre_of_mass(body: Body, places: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` from places ``(frames, parts, 3)``."""
    return np.einsum("fjc,j->fc", places, _weights(body))


@cache
def _weights(body: Body) -> np.ndarray:
    """``(joints,)`` shares of the mass."""
    weights = np.zeros(len(body.structure.parts))
    for (near, far, _, at), mass in zip(_SEGMENTS, _masses(body), strict=True):
        weights[body.part[near]] += mass * (1.0 - at)
        weights[body.part[far]] += mass * at
    return weights


def _masses(body: Body) -> np.ndarray:
    """Shares of the mass: a segment twice as long as a person's, for the same stature, weighs twice."""
    own, usual = _lengths(body), _lengths(Body("", body.structure, human("man", 1.0), "t_pose"))
    mass = np.array([share for _, _, share, _ in _SEGMENTS]) * own / usual
    return mass / mass.sum()


def _lengths(body: Body) -> np.ndarray:
    p = body.proportions
    sizes = {"hips": p.trunk, "head": p.head}
    for side in SIDES:
        sizes |= {f"{side}_up_leg": p.thigh, f"{side}_leg": p.shank, f"{side}_foot": p.ball}
        sizes |= {f"{side}_arm": p.upper_arm, f"{side}_forearm": p.forearm}
    return np.array([sizes[near] for near, *_ in _SEGMENTS])
