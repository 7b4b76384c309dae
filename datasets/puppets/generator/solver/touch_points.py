"""Points of a body that its own hands can be put on."""

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


KINDS = (
    *("hip", "knee", "toe", "palm", "upper_arm", "elbow"),
    *("shoulder", "chest", "ribs", "belly", "head", "brow"),
)
_TIPS = ("toe", "brow")
"""Where the finger tips rest rather than the palm."""
Vector = tuple[float, float, float]


def touch_point(name: str, body: Body) -> TouchPoint:
    """The point called ``left_hip``, ``right_knee``, ``left_palm`` ... of a body."""
    side, _, kind = name.partition("_")
    part, at, normal, along = _on_trunk(side, kind, body) or _on_limbs(side, kind, body)
    return TouchPoint(part, np.array(at), unit(np.array(normal)), np.array(along), kind in _TIPS)


def _on_limbs(side: str, kind: str, body: Body) -> tuple[str, Vector, Vector, Vector]:
    """Part, point, normal and direction of the fingers."""
    p, out = body.proportions, sign(side)
    match kind:
        case "knee":  # the thigh just over the knee, fingers down and inward
            at = (0.15 * out * p.girth, -0.90 * p.thigh, 1.1 * p.girth)
            return f"{side}_up_leg", at, (0.25 * out, 0.0, 1.0), (-0.45 * out, -1.0, 0.0)
        case "toe":  # the toes from above
            at = (0.0, 0.3 * p.ball_height, 0.7 * p.toes)
            return f"{side}_toe", at, (0.1 * out, 0.75, 0.65), (0.0, -0.7, 0.7)
        case "palm":  # for the other hand: palm to palm, fingers slightly crossed
            x, y, z = palm(side, p).tolist()
            return f"{side}_hand", (x, y, z), (0.0, -1.0, 0.0), (1.0 * out, 0.0, 0.35)
        case "upper_arm":  # outside and in front, for the other hand: its fingers round the arm
            at = (0.72 * out * p.upper_arm, 0.25 * p.girth, 0.55 * p.girth)
            return f"{side}_arm", at, (0.0, 0.35, 0.94), (-0.25 * out, 0.9, -0.3)
        case "elbow":  # from above when the forearm lies across the body
            at = (0.95 * out * p.upper_arm, 0.3 * p.girth, 0.5 * p.girth)
            return f"{side}_arm", at, (0.0, 0.5, 0.86), (-0.1 * out, 0.9, -0.4)
        case "shoulder":  # on top and a little in front, for the other hand: fingers back over the shoulder
            at = (out * (0.66 * p.shoulder_half - p.clavicle), 0.75 * p.girth, 0.45 * p.girth)
            return f"{side}_shoulder", at, (0.15 * out, 0.75, 0.65), (0.75 * out, 0.3, -0.6)
    raise KeyError(kind)


def _on_trunk(side: str, kind: str, body: Body) -> tuple[str, Vector, Vector, Vector] | None:
    """Likewise of the trunk and the head."""
    p, out, chest = body.proportions, sign(side), body.structure.chest
    match kind:
        case "hip":  # over the hip bone, fingers forward and down
            at = (out * p.waist_half, p.pelvis + 0.12 * p.trunk, 0.0)
            return "hips", at, (out * 0.95, 0.2, 0.1), (-out * 0.15, -0.45, 0.9)
        case "belly":  # beside the navel, the own side's hand laid across
            at = (0.12 * out * p.waist_half, p.pelvis + 0.22 * p.trunk, 1.75 * p.girth)
            return "hips", at, (0.1 * out, 0.0, 1.0), (-1.0 * out, 0.1, 0.0)
        case "chest":  # the breast, for a hand from the other side laid across: on the heart
            level = float(body.reach("left_arm", chest)[1])
            at = (0.35 * out * p.shoulder_half, level - 0.16 * p.trunk, 1.55 * p.girth)
            return chest, at, (0.1 * out, 0.15, 1.0), (0.85 * out, 0.5, 0.0)
        case "ribs":  # the flank below the armpit, for the other hand tucked under the arm
            level = float(body.reach("left_arm", chest)[1])
            at = (0.72 * out * p.shoulder_half, level - 0.30 * p.trunk, 1.2 * p.girth)
            return chest, at, (0.45 * out, 0.0, 0.9), (1.0 * out, 0.15, -0.4)
        case "head":  # the side of the head over the ear, fingers up and back
            at = (0.46 * out * p.head, 0.78 * p.head, 0.08 * p.head)
            return "head", at, (0.85 * out, 0.45, 0.15), (-0.45 * out, 0.75, -0.6)
        case "brow":  # the temple beside the brow: a salute
            at = (0.38 * out * p.head, 0.66 * p.head, 0.48 * p.head)
            return "head", at, (0.25 * out, 0.55, 0.8), (-0.85 * out, 0.55, -0.1)
    return None


def resting(spot: TouchPoint, side: str, sizes: Proportions) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (3, 3) and wrist (3,) of a hand that rests on a place, in the axes of the place's joint.

    The hand's axes: fingers along its outward X, palm down.
    """
    fingers = unit(spot.along - spot.normal * float(spot.along @ spot.normal))
    x = sign(side) * fingers
    turn = np.stack([x, spot.normal, np.cross(x, spot.normal)], axis=-1)
    return turn, spot.at - turn @ touching(spot, side, sizes)
