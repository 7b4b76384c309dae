"""Two-bone limbs: how they hang, bend and reach a goal in closed form, and what a body's parts weigh."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..bodies.proportions import human
from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..matrices import carry, cross, dot, length, unit


@dataclass(frozen=True, eq=False)
class Limb:
    """Two bones as they are drawn: of a person in one line, in the T-pose; of a standing dog at an angle.

    bones:  (2, 3) unit, along the upper and the lower bone. hinges: (2, 3) unit, square to them, the axis
           about which the lower bone turns forward (arm) or backward (leg) when the middle joint bends.
    upper, lower: metres.
    ease, natural: (3,) unit, in the frame the limb hangs on: a direction of easy reach, and the hinge
           that feels natural there. Elsewhere the hinge is carried along by the shortest turn, which is
           smooth in every direction but the one opposite to ``ease``.
    tightest: of the angle between the bones, radians (0 would be folded flat).
    exact: share of its length within which goals are met exactly.
    """

    bones: np.ndarray
    hinges: np.ndarray
    upper: float
    lower: float
    ease: np.ndarray
    natural: np.ndarray
    tightest: float
    exact: float

    @property
    def longest(self) -> float:
        return self.upper + self.lower

    @property
    def shortest(self) -> float:
        """Distance between its ends when bent as far as it goes."""
        a, b = self.upper, self.lower
        return float(np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(self.tightest)))


def bend(
    limbs: tuple[Limb, ...],
    start: np.ndarray,
    goal: np.ndarray,
    frame: np.ndarray,
    swivel: np.ndarray,
    pole: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """World orientations ``(limbs, frames, 3, 3)`` of the two bones of limbs, against how they are drawn.

    limbs: as long as each other, of one or both sides, solved at once.
    start, goal: ``(limbs, frames, 3)`` of a limb's two ends; frame: ``(frames, 3, 3)`` of what all hang
    on; swivel: ``(limbs, frames)`` turns the middle joint about the line between the ends, left-handed
    for +1. pole: positions ``(limbs, frames, 3)`` towards which the middle joint points, and how far
    ``(limbs, frames)``.
    Goals within ``limb.exact`` are met exactly, those farther are neared ever more slowly.
    """
    limb = limbs[0]
    line = goal - start
    distance = length(line)
    to = line / np.maximum(distance, 1e-12)[..., None]
    hung, drawn = _drawn(limbs)
    ease, natural = (hung @ frame.reshape(-1, 3).T).reshape(2, *line.shape)
    hinge = carry(ease, to, natural)
    hinge = unit(hinge - to * dot(hinge, to))
    # along the limb, about its hinge, and where its middle joint is pushed: three orthogonal directions
    aside = cross(to, hinge)
    c, s = np.cos(swivel)[..., None], np.sin(swivel)[..., None]
    hinge, aside = c * hinge + s * aside, c * aside - s * hinge
    if pole is not None:
        away = pole[0] - start
        direction = cross(unit(away - to * dot(away, to)), to)
        hinge = hinge + pole[1][..., None] * (direction - hinge)
        hinge = unit(hinge - to * dot(hinge, to))
        aside = cross(to, hinge)
    d = _within(distance, limb)
    a, b = limb.upper, limb.lower
    cosine = np.clip((a * a + d * d - b * b) / (2.0 * a * d), -1.0, 1.0)
    sine = np.sqrt(1.0 - cosine * cosine)
    # both bones, one after the other, in the plane of ``to`` and ``aside``
    c = np.stack([cosine, (d - a * cosine) / b])[..., None]
    s = np.stack([sine, -a / b * sine])[..., None]
    oriented = np.empty((2, *line.shape, 3))
    oriented[..., 0] = c * to + s * aside
    oriented[..., 1] = hinge
    oriented[..., 2] = c * aside - s * to
    upper, lower = (oriented.reshape(2, len(limbs), -1, 3) @ drawn).reshape(oriented.shape)
    return upper, lower


@cache
def _drawn(limbs: tuple[Limb, ...]) -> tuple[np.ndarray, np.ndarray]:
    """``(2 limbs, 3)``: all directions of easy reach, then all natural hinges; and ``(2, limbs, 3, 3)``:
    bone, hinge and what is orthogonal to both, as rows."""
    hung = np.stack([*(limb.ease for limb in limbs), *(limb.natural for limb in limbs)])
    rows = [[limb.bones, limb.hinges, cross(limb.bones, limb.hinges)] for limb in limbs]
    return hung, np.array(rows).transpose(2, 0, 1, 3)


def _within(distance: np.ndarray, limb: Limb) -> np.ndarray:
    """The distance that the limb makes: unchanged in reach, eased towards its limits beyond."""
    far, end = limb.exact * limb.longest, (0.15 * limb.exact + 0.85) * limb.longest
    near, stop = 1.06 * limb.shortest, limb.shortest
    out = np.maximum(distance - far, 0.0)
    inward = np.maximum(near - distance, 0.0)
    eased = np.clip(distance, near, far)
    eased = eased + (end - far) * (1.0 - np.exp(-out / (end - far)))
    return eased - (near - stop) * (1.0 - np.exp(-inward / (near - stop)))


X, Y, Z = np.eye(3)


def _exact(share: float, slack: float) -> float:
    """``Limb.exact`` of a limb that keeps a part of the bend which it has at a share of its length."""
    return share + (1.0 - slack) * (1.0 - share)


@cache
def leg_limb(body: Body, slack: float = 1.0) -> Limb:
    """Thigh and shank of either side of a person: both knees bend forward. slack: of ``Score``."""
    p, bones, hinges = body.proportions, np.stack([-Y, -Y]), np.stack([X, X])
    exact = _exact(0.996, slack)
    return Limb(bones, hinges, p.thigh, p.shank, ease=-Y, natural=X, tightest=np.radians(28.0), exact=exact)


@cache
def arm_limb(side: str, body: Body, slack: float = 1.0) -> Limb:
    """Upper arm and forearm: easy reach is forward, down and a little outward, elbow behind and below.
    slack: of ``Score``."""
    p, out = body.proportions, sign(side)
    ease = unit(np.array([0.45 * out, -0.25, 0.85]))
    elbow = np.array([0.25 * out, -0.7, -0.65])
    elbow = unit(elbow - ease * float(elbow @ ease))
    return Limb(
        bones=out * np.stack([X, X]),
        hinges=-out * np.stack([Y, Y]),
        upper=p.upper_arm,
        lower=p.forearm,
        ease=ease,
        natural=np.cross(elbow, ease),
        tightest=np.radians(32.0),
        exact=_exact(0.985, slack),
    )


_SEGMENTS = (
    # near end, far end, length, share of the body's mass, place of its centre from the near end
    ("hips", "neck", "trunk", 0.459, 0.50),
    ("head", "head", "head", 0.082, 0.50),
    *((f"{side}_up_leg", f"{side}_leg", "thigh", 0.111, 0.43) for side in SIDES),
    *((f"{side}_leg", f"{side}_foot", "shank", 0.051, 0.43) for side in SIDES),
    *((f"{side}_foot", f"{side}_toe", "ball", 0.014, 0.50) for side in SIDES),
    *((f"{side}_arm", f"{side}_forearm", "upper_arm", 0.031, 0.45) for side in SIDES),
    *((f"{side}_forearm", f"{side}_hand", "forearm", 0.023, 0.50) for side in SIDES),
)
"""Plagenhoef, Evans and Abdelnour (1983), mean of women and men; the hand's mass goes with the forearm."""


def centre_of_mass(body: Body, positions: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` from positions ``(frames, parts, 3)``."""
    return np.einsum("fjc,j->fc", positions, _weights(body))


@cache
def _weights(body: Body) -> np.ndarray:
    """``(joints,)`` shares of the mass: a segment twice as long as a person's, for the same stature, weighs
    twice."""
    own, usual = body.proportions, human("man", 1.0)
    masses = [mass * getattr(own, size) / getattr(usual, size) for _, _, size, mass, _ in _SEGMENTS]
    weights = np.zeros(len(body.structure.parts))
    for (near, far, _, _, at), mass in zip(_SEGMENTS, np.array(masses) / np.sum(masses), strict=True):
        weights[body.part[near]] += mass * (1.0 - at)
        weights[body.part[far]] += mass * at
    return weights
