"""Points of a body that its own hands can be put on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ..bodies.proportions import Proportions
from ..bodies.structures import Body
from ..conventions import SIDES, sign
from ..matrices import unit

LOW = tuple(f"{side}_{part}" for side in SIDES for part in ("up_leg", "leg", "foot", "toe"))
"""Parts that come nearer when the trunk bends forward."""
OF_ARM = {
    side: tuple(f"{side}_{spot}" for spot in ("palm", "upper_arm", "elbow", "shoulder")) for side in SIDES
}
"""Places that are known once the arm of a side is posed."""


@dataclass(frozen=True, eq=False)
class TouchPoint:
    """A point of the skin that moves with a joint, in that joint's axes in the T-pose.

    part:   the joint.  at: (3,) metres from it.  normal: (3,) unit, out of the body.
    along:  (3,) where the fingers of a hand that rests there point.
    tips:   whether the finger tips rest there rather than the palm.
    """

    part: str
    at: np.ndarray
    normal: np.ndarray
    along: np.ndarray
    tips: bool = False


def palm(side: str, sizes: Proportions) -> np.ndarray:
    """(3,) metres from the wrist to the middle of the palm, in the hand's axes."""
    return np.array([0.45 * sign(side) * sizes.hand, -0.12 * sizes.hand, 0.0])


def finger_tips(side: str, sizes: Proportions) -> np.ndarray:
    """(3,) metres from the wrist to the tips of the long fingers, in the hand's axes."""
    return np.array([0.95 * sign(side) * sizes.hand, -0.05 * sizes.hand, 0.0])


def touching(spot: TouchPoint, side: str, sizes: Proportions) -> np.ndarray:
    """(3,) metres from the wrist to what rests on the place, in the hand's axes."""
    return finger_tips(side, sizes) if spot.tips else palm(side, sizes)


# ------------------------------------------------------------------------------------- legs and hips
def _hip(side: str, body: Body) -> TouchPoint:
    """Over the hip bone, fingers forward and down."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        "hips",
        np.array([out * p.waist_half, p.pelvis + 0.12 * p.trunk, 0.0]),
        unit(np.array([out * 0.95, 0.2, 0.1])),
        np.array([-out * 0.15, -0.45, 0.9]),
    )


def _knee(side: str, body: Body) -> TouchPoint:
    """The thigh just over the knee, fingers down and inward."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_up_leg",
        np.array([0.15 * out * p.girth, -0.90 * p.thigh, 1.1 * p.girth]),
        unit(np.array([0.25 * out, 0.0, 1.0])),
        np.array([-0.45 * out, -1.0, 0.0]),
    )


def _toe(side: str, body: Body) -> TouchPoint:
    """The toes from above, with the finger tips."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_toe",
        np.array([0.0, 0.3 * p.ball_height, 0.7 * p.toes]),
        unit(np.array([0.1 * out, 0.75, 0.65])),
        np.array([0.0, -0.7, 0.7]),
        tips=True,
    )


# ------------------------------------------------------------------------------------- arms
def _palm(side: str, body: Body) -> TouchPoint:
    """The own palm, for the other hand: palm to palm, fingers slightly crossed."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_hand", palm(side, p), np.array([0.0, -1.0, 0.0]), np.array([1.0 * out, 0.0, 0.35])
    )


def _upper_arm(side: str, body: Body) -> TouchPoint:
    """Outside and in front, for the other hand: its fingers round the arm."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_arm",
        np.array([0.72 * out * p.upper_arm, 0.25 * p.girth, 0.55 * p.girth]),
        unit(np.array([0.0, 0.35, 0.94])),
        np.array([-0.25 * out, 0.9, -0.3]),
    )


def _elbow(side: str, body: Body) -> TouchPoint:
    """Over the elbow, from above when the forearm lies across the body."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_arm",
        np.array([0.95 * out * p.upper_arm, 0.3 * p.girth, 0.5 * p.girth]),
        unit(np.array([0.0, 0.5, 0.86])),
        np.array([-0.1 * out, 0.9, -0.4]),
    )


def _shoulder(side: str, body: Body) -> TouchPoint:
    """The top of the shoulder and a little in front, for the other hand: fingers back over the shoulder."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        f"{side}_shoulder",
        np.array([out * (0.66 * p.shoulder_half - p.clavicle), 0.75 * p.girth, 0.45 * p.girth]),
        unit(np.array([0.15 * out, 0.75, 0.65])),
        np.array([0.75 * out, 0.3, -0.6]),
    )


# ------------------------------------------------------------------------------------- trunk
def _on_chest(
    body: Body, across: float, below: float, ahead: float, normal: tuple[float, float, float]
) -> tuple[str, np.ndarray, np.ndarray]:
    """A place of the rib cage: metres from the middle and below the shoulder joints."""
    chest = body.structure.chest
    level = body.reach("left_arm", chest)[1]
    return chest, np.array([across, level - below, ahead]), unit(np.array(normal))


def _chest(side: str, body: Body) -> TouchPoint:
    """The breast, for a hand from the other side laid across: on the heart."""
    p, out = body.proportions, sign(side)
    spot = _on_chest(
        body, 0.35 * out * p.shoulder_half, 0.16 * p.trunk, 1.55 * p.girth, (0.1 * out, 0.15, 1.0)
    )
    return TouchPoint(*spot, np.array([0.85 * out, 0.5, 0.0]))


def _ribs(side: str, body: Body) -> TouchPoint:
    """The flank below the armpit, for the other hand tucked under the arm."""
    p, out = body.proportions, sign(side)
    spot = _on_chest(
        body, 0.72 * out * p.shoulder_half, 0.30 * p.trunk, 1.2 * p.girth, (0.45 * out, 0.0, 0.9)
    )
    return TouchPoint(*spot, np.array([1.0 * out, 0.15, -0.4]))


def _belly(side: str, body: Body) -> TouchPoint:
    """Beside the navel, the own side's hand laid across."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        "hips",
        np.array([0.12 * out * p.waist_half, p.pelvis + 0.22 * p.trunk, 1.75 * p.girth]),
        unit(np.array([0.1 * out, 0.0, 1.0])),
        np.array([-1.0 * out, 0.1, 0.0]),
    )


# ------------------------------------------------------------------------------------- head
def _head(side: str, body: Body) -> TouchPoint:
    """The side of the head over the ear, fingers up and back."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        "head",
        np.array([0.46 * out * p.head, 0.78 * p.head, 0.08 * p.head]),
        unit(np.array([0.85 * out, 0.45, 0.15])),
        np.array([-0.45 * out, 0.75, -0.6]),
    )


def _brow(side: str, body: Body) -> TouchPoint:
    """The temple beside the brow, with the finger tips: a salute."""
    p, out = body.proportions, sign(side)
    return TouchPoint(
        "head",
        np.array([0.38 * out * p.head, 0.66 * p.head, 0.48 * p.head]),
        unit(np.array([0.25 * out, 0.55, 0.8])),
        np.array([-0.85 * out, 0.55, -0.1]),
        tips=True,
    )


KINDS: Mapping[str, Callable[[str, Body], TouchPoint]] = {
    "hip": _hip,
    "knee": _knee,
    "toe": _toe,
    "palm": _palm,
    "upper_arm": _upper_arm,
    "elbow": _elbow,
    "shoulder": _shoulder,
    "chest": _chest,
    "ribs": _ribs,
    "belly": _belly,
    "head": _head,
    "brow": _brow,
}


def touch_point(name: str, body: Body) -> TouchPoint:
    """The place called ``left_hip``, ``right_knee``, ``left_palm`` ... on a body."""
    side, _, kind = name.partition("_")
    return KINDS[kind](side, body)


def resting(spot: TouchPoint, side: str, sizes: Proportions) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (3, 3) and wrist (3,) of a hand that rests on a place, in the axes of the place's joint.

    The hand's axes: fingers along its outward X, palm down.
    """
    fingers = unit(spot.along - spot.normal * float(spot.along @ spot.normal))
    x = sign(side) * fingers
    turn = np.stack([x, spot.normal, np.cross(x, spot.normal)], axis=-1)
    return turn, spot.at - turn @ touching(spot, side, sizes)
