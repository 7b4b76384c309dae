"""Places on a body that its own hands can be put on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from .limbs import unit
from .proportions import Proportions
from .score import sign


@dataclass(frozen=True, eq=False)
class Place:
    """A point of the skin that moves with a joint, in that joint's axes in the T-pose.

    part:   the joint.  at: (3,) metres from it.  normal: (3,) unit, out of the body.
    along:  (3,) where the fingers of a hand that rests there point.
    """

    part: str
    at: np.ndarray
    normal: np.ndarray
    along: np.ndarray


def palm(side: str, sizes: Proportions) -> np.ndarray:
    """(3,) metres from the wrist to the middle of the palm, in the hand's axes."""
    return np.array([0.45 * sign(side) * sizes.hand, -0.12 * sizes.hand, 0.0])


def _hip(side: str, p: Proportions) -> Place:
    """Over the hip bone, fingers forward and down."""
    out = sign(side)
    rise = p.pelvis + 0.12 * p.trunk
    return Place(
        "hips",
        np.array([out * p.waist_half, rise, 0.0]),
        unit(np.array([out * 0.95, 0.2, 0.1])),
        np.array([-out * 0.15, -0.45, 0.9]),
    )


def _knee(side: str, p: Proportions) -> Place:
    """On the thigh just over the knee, fingers down and inward."""
    out = sign(side)
    return Place(
        f"{side}_up_leg",
        np.array([0.15 * out * p.girth, -0.90 * p.thigh, 1.1 * p.girth]),
        unit(np.array([0.25 * out, 0.0, 1.0])),
        np.array([-0.45 * out, -1.0, 0.0]),
    )


def _palm(side: str, p: Proportions) -> Place:
    """The own palm, for the other hand: palm to palm, fingers slightly crossed."""
    out = sign(side)
    return Place(
        f"{side}_hand", palm(side, p), np.array([0.0, -1.0, 0.0]), np.array([1.0 * out, 0.0, 0.35])
    )


_KINDS: Mapping[str, Callable[[str, Proportions], Place]] = {"hip": _hip, "knee": _knee, "palm": _palm}


def place(name: str, sizes: Proportions) -> Place:
    """The place called ``left_hip``, ``right_knee``, ``left_palm`` ... on a body of these sizes."""
    side, _, kind = name.partition("_")
    return _KINDS[kind](side, sizes)


def resting(spot: Place, side: str, sizes: Proportions) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (3, 3) and wrist (3,) of a hand that rests on a place, in the axes of the place's joint.

    The hand's axes: fingers along its outward X, palm down.
    """
    fingers = unit(spot.along - spot.normal * float(spot.along @ spot.normal))
    x = sign(side) * fingers
    turn = np.stack([x, spot.normal, np.cross(x, spot.normal)], axis=-1)
    return turn, spot.at - turn @ palm(side, sizes)
