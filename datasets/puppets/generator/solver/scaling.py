"""Scaling of a performance to another body: every rule, in one place.

| of the performance | measured in | on this body |
|---|---|---|
| travel, sway and step places | leg lengths | times its leg (hip joint to sole) |
| stance width | half hip widths | times half the distance of its hip joints; less where legs are short |
| pitch of the sole | radians of a usual foot | less on a foot that is long for its leg |
| height of the hip joints | leg lengths | times its leg, lowered where a foot would not reach the floor |
| feet carried in the air | leg lengths from the hip joint | times its own leg, less its ankle |
| foot contacts | schedule | kept: the same frames, its own sole |
| hands in the air | arm lengths | times its arm (shoulder joint to wrist), from its own shoulder |
| knees on the floor | before the own toes | kept: as far off and high as its own shin and skin |
| hands on the floor | leg lengths | kept: the same frames; on all fours under its shoulders |
| hands on the body | places | kept: its own hip, knee, other palm |
| turning, leaning, gaze | radians | the same |
| balance | share of each foot | kept: its own centre of mass over its own feet |
| time | frames | the same |
| gravity | leg lengths per square second | times its leg: a leap is as high and wide in leg lengths |
| stairs | leg lengths | treads and rises times its leg; the sole as far on a tread as it fits |
"""

import numpy as np

from ..bodies.structures import Body
from ..conventions import sign
from ..performances.score import Air, FootContact, Hand, Score


def foot_place(contact: FootContact, side: str, body: Body) -> tuple[float, float]:
    """(x, z) in metres of the ankle's place on the floor while the foot is flat."""
    sizes = body.proportions
    out, ahead = sign(side) * stance_width(contact.width, body), _fit(contact, body)
    c, s = np.cos(contact.heading), np.sin(contact.heading)
    x, z = contact.place
    return float(x * sizes.leg + out * c + ahead * s), float(z * sizes.leg - out * s + ahead * c)


USUAL_HIPS = 0.105
"""Half the distance of the hip joints, leg lengths: a woman's or man's."""


def stance_width(width: float, body: Body) -> float:
    """Metres from the middle outward to a standing foot.

    Short legs under wide hips would slant by twice a person's angle when the weight goes from foot to foot,
    and look knock-kneed: what a stance is wider than a walk's is made less there."""
    sizes = body.proportions
    share = min(USUAL_HIPS * sizes.leg / sizes.hip_half, 1.0) ** 1.5
    return (min(width, 0.75) + share * max(width - 0.75, 0.0)) * sizes.hip_half


_GAP = 0.02
"""Between a sole and the riser before or behind it, leg lengths."""


def _fit(contact: FootContact, body: Body) -> float:
    """Metres ahead of its place at which a foot does not touch a riser. What does not fit on the
    tread hangs over its free edge."""
    sizes = body.proportions
    room = (abs(contact.riser) - _GAP) * sizes.leg
    if contact.riser > 0.0:
        return min(0.0, room - sizes.ball - sizes.toes)
    return max(0.0, sizes.heel - room) if contact.riser < 0.0 else 0.0


USUAL_FOOT = 0.141
"""From ankle to toe joint, leg lengths: a man's by the tables of ``bodies/proportions.py``."""


def foot_pitch(body: Body) -> float:
    """The factor of a sole's angles on this body."""
    sizes = body.proportions
    return min(max(USUAL_FOOT * sizes.leg / sizes.ball, 0.4), 1.15)


KNEELING_PITCH = 1.3
"""Of the sole of a kneeling leg, whose toes are turned under, radians: the same on every body."""


def pelvis_place(score: Score, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres: the middle between the hip joints, before corrections for feet and
    balance."""
    c, s = np.cos(score.heading), np.sin(score.heading)
    left, ahead = score.sway[:, 0], score.sway[:, 1]
    x = score.path[:, 0] + left * c + ahead * s
    z = score.path[:, 1] - left * s + ahead * c
    return np.stack([x, score.height, z], axis=-1) * body.proportions.leg


USUAL_LIMB = 0.923
"""From hip joint to ankle, leg lengths: of the same man."""


def air_reach(air: Air, side: str, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres (left, up, forward) from the hip joint to the ankle of a carried foot."""
    limb = (body.proportions.thigh + body.proportions.shank) / USUAL_LIMB
    return air.reach * (limb * np.array([sign(side), 1.0, 1.0]))


def air_point(air: Air, body: Body) -> np.ndarray:
    """``(frames,)`` how far the toes of a carried foot point, radians: a long foot is held flatter."""
    return air.point - 0.9 * (1.0 - min(foot_pitch(body), 1.0))


def hand_reach(hand: Hand, side: str, body: Body) -> np.ndarray:
    """``(frames, 3)`` metres (left, up, forward) from where the hand is measured to the wrist."""
    return hand.reach * (body.proportions.arm * np.array([sign(side), 1.0, 1.0]))
