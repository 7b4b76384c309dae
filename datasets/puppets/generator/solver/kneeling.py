"""Knees on the floor: where they rest, where the hips are then, and how the trunk lies on all fours.

A kneeling leg stands on its toes and its knee. Toes rest where the foot's contact is; how far before them
the knee does follows from the body's own foot and shin, so the hip joint stays on a sphere about the knee.
"""

from collections.abc import Mapping

import numpy as np

from ..bodies.structures import Body
from ..conventions import SIDES
from ..matrices import unit
from ..performances.score import HandContact, Score
from .feet import FootPath
from .scaling import KNEELING_PITCH

KNEE_HEIGHT = 0.8
"""Of a knee joint over the floor on which it rests, shares of the body's girth."""

SEAT_HEIGHT = 1.3
"""Of a hip joint over what is sat on, likewise."""


def knee_height(body: Body) -> float:
    """Height of the knee joint over the floor, metres."""
    return KNEE_HEIGHT * body.proportions.girth


def _ankle(body: Body) -> tuple[float, float]:
    """The ankle of a kneeling leg: metres over its knee, and behind its toe joint."""
    p, c, s = body.proportions, np.cos(KNEELING_PITCH), np.sin(KNEELING_PITCH)
    up = p.ball_height - p.ankle
    return float(p.ball_height - (up * c - p.ball * s) - knee_height(body)), float(up * s + p.ball * c)


def knee_ahead(body: Body) -> float:
    """Metres from the toe joint forward to the resting knee."""
    rise, behind = _ankle(body)
    return float(np.sqrt(body.proportions.shank**2 - rise**2)) - behind


def knees(score: Score, feet: Mapping[str, FootPath], body: Body) -> np.ndarray | None:
    """``(2, frames, 3)`` metres: where the knees, left and right, are while their legs kneel; they go along
    with the toes. None where no leg ever kneels."""
    if not any(kneels(score, side).any() for side in SIDES):
        return None
    p, places = body.proportions, []
    for foot in (feet[side] for side in SIDES):
        toe = foot.ankle + foot.sole @ np.array([0.0, p.ball_height - p.ankle, p.ball])
        ahead = np.stack([np.sin(foot.yaw), np.zeros_like(foot.yaw), np.cos(foot.yaw)], axis=-1)
        places.append(toe + knee_ahead(body) * ahead + [0.0, knee_height(body) - p.ball_height, 0.0])
    return np.stack(places)


def kneels(score: Score, side: str) -> np.ndarray:
    """``(frames,)`` how far a leg kneels."""
    kneel = score.feet[side].kneel
    return np.zeros(score.frames) if kneel is None else kneel


def on_knees(
    score: Score, middle: np.ndarray, hips: np.ndarray, knees: np.ndarray, body: Body
) -> np.ndarray:
    """Path ``(frames, 3)`` of the middle between the hip joints, so far as the body kneels.

    hips: ``(2, frames, 3)`` of either hip joint from the middle; knees: ``(2, frames, 3)`` at rest.
    """
    weight = np.stack([kneels(score, side) for side in SIDES])[..., None]
    thigh, back = body.proportions.thigh, np.zeros(score.frames)
    if score.sit_back is not None:
        # no farther than until the knees are bent by 138 degrees
        most = float(np.radians(48.0) - np.arcsin(abs(_ankle(body)[0]) / body.proportions.shank))
        back = most * np.tanh(score.sit_back / most)
    s = np.sin(back)
    upward = np.stack([-s * np.sin(score.heading), np.cos(back), -s * np.cos(score.heading)], axis=-1)
    centre = knees - hips
    apart = centre[1] - centre[0]
    square = (apart * apart).sum(axis=-1, keepdims=True)
    # eased where the two knees are side by side and the direction between their spheres means nothing
    across = (apart * upward).sum(axis=-1, keepdims=True) * apart / (square + (0.12 * thigh) ** 2)
    high = np.sqrt(np.maximum(thigh * thigh - 0.25 * square, 0.01 * thigh * thigh))
    both = 0.5 * (centre[0] + centre[1]) + high * unit(upward - across)
    (left, right), one = weight, centre + thigh * upward
    path = (1.0 - left) * ((1.0 - right) * middle + right * one[1])
    path = path + left * ((1.0 - right) * one[0] + right * both)
    # while the second knee comes or goes the first one stays: back onto its sphere
    for k, side in enumerate(SIDES):
        bears = score.feet[side].bears
        if bears is not None:
            weight[k] *= bears[:, None]
    for own, other, place in zip(weight, weight[::-1], centre, strict=True):
        line = path - place
        path = path + own**4 * (1.0 - other**8) * (thigh * unit(line) - line)
    return path


def over_floor(height: np.ndarray, body: Body) -> np.ndarray:
    """Heights ``(frames,)`` of the hip joints, no lower than sitting on the floor; unchanged from a little
    above that on."""
    seat = SEAT_HEIGHT * body.proportions.girth
    ease = 0.25 * seat
    deep = np.clip(seat + ease - height, 0.0, 2.0 * ease)
    return np.maximum(height, seat - ease) + deep * deep / (4.0 * ease)


def all_fours(body: Body) -> tuple[float, float]:
    """Lean of the trunk on hands and knees, radians, and the way of the shoulder joints
    before the knees, metres: the arms all but straight, elbows bent where they are too long for that.
    Where no collar bone follows a hand, the shoulders are lower, for the arms to reach as far."""
    p = body.proportions
    shoulder = body.reach("left_arm", "hips") - body.reach("left_up_leg", "hips")
    far = float(np.sqrt(shoulder[1] ** 2 + shoulder[2] ** 2))
    wrist = float(p.hand * np.sin(HandContact.tilt))
    straight = 0.91 if body.structure.collars else 0.875
    share = (straight * p.arm + wrist - knee_height(body) - p.thigh) / far
    share = min(max(share, -0.30), 0.75)
    lean = float(np.arccos(share)) - float(np.arctan2(shoulder[2], shoulder[1]))
    return lean, far * float(np.sqrt(1.0 - share * share))
