"""Paws: on their contacts exactly, between them in a swing; and when each is in contact."""

from dataclasses import dataclass

import numpy as np

from ..bodies.dogs import DogSizes
from ..bodies.structures import Body
from ..conventions import across, along, sign
from ..curves import bump, hermite, smooth
from ..matrices import about
from ..performances.score import DogScore, Paw, PawContact

THICK = 0.055
"""Height of the middle of a leg that lies on the floor, hind leg lengths."""


PARTS = {"hind": ("up_leg", "leg", "foot"), "fore": ("arm", "forearm", "hand")}
"""Parts of the legs at either end of the trunk: upper and lower bone, and paw."""


@dataclass(frozen=True, eq=False)
class End:
    """One end of the trunk, by which paws are placed. floor: ``(frames, 2)`` the point under its hip or
    shoulder joints, metres. height, heading: ``(frames,)`` of these as the score wants them. half: metres
    between the middle and either joint. lain: how far ahead of the joints the tips of the paws are while
    the body lies, metres."""

    floor: np.ndarray
    height: np.ndarray
    heading: np.ndarray
    half: float
    lain: float


def sizes_of(body: Body) -> DogSizes:
    assert isinstance(body.proportions, DogSizes)
    return body.proportions


_ELBOW = 0.72
"""How high the shoulder joint of a lying dog is over its elbow, lengths of the upper arm."""


def ends(score: DogScore, body: Body) -> dict[str, End]:
    """Both ends of the trunk, which keeps its length: where one end sinks, they come nearer."""
    sizes, bent = sizes_of(body), 0.5 * score.trunk.chest[:, 0]
    half = 0.5 * float((body.reach("left_arm", "hips") - body.reach("left_up_leg", "hips"))[2])
    hind, fore = score.heading - bent, score.heading + bent
    middle = sizes.leg * score.path
    # heights of hip and shoulder joints while the body lies
    lying = 1.3 * THICK * sizes.leg + sizes.girth, THICK * sizes.leg + _ELBOW * sizes.upper_arm
    up = lying[0] + (sizes.leg - lying[0]) * score.height
    ahead = lying[1] + (sizes.fore_leg - lying[1]) * score.fore
    length = 4.0 * half * half + (sizes.fore_leg - sizes.leg) ** 2
    nearer = 2.0 * half - np.sqrt(length - (ahead - up) ** 2)
    share = score.anchor
    rear = middle - (half - share * nearer)[:, None] * along(hind)
    front = middle + (half - (1.0 - share) * nearer)[:, None] * along(fore)
    paws = float(np.hypot(sizes.ankle, sizes.ball)), float(np.hypot(sizes.hand, 0.8 * sizes.ball))
    elbow = -sizes.upper_arm * float(np.sqrt(1.0 - _ELBOW * _ELBOW))
    return {
        "hind": End(rear, up, hind, sizes.hip_half, 0.58 * sizes.shank + 0.95 * paws[0]),
        "fore": End(front, ahead, fore, sizes.shoulder_half, elbow + sizes.forearm + 0.93 * paws[1]),
    }


def at(values: np.ndarray, moment: float) -> np.ndarray:
    """A channel between frames; beyond the ends it goes on as it went over the last quarter second."""
    last = len(values) - 1
    low = min(max(int(np.floor(moment)), 0), last - 1)
    if moment < 0.0 or moment > last:
        back = min(8, last)
        low = 0 if moment < 0.0 else last - back
        start = values[low] if moment < 0.0 else values[last]
        slope = (values[low + back] - values[low]) / back
        return np.asarray(start + slope * (moment - (0.0 if moment < 0.0 else last)))
    return np.asarray(values[low] + (moment - low) * (values[low + 1] - values[low]))


@dataclass(frozen=True, eq=False)
class PawPath:
    """joint: ``(frames, 3)`` of the joint over the paw. orientation: ``(frames, 3, 3)`` of the paw.
    planted, pivoting: ``(frames,)`` bool. down: likewise, whether the tip is on the floor at all."""

    joint: np.ndarray
    orientation: np.ndarray
    planted: np.ndarray
    pivoting: np.ndarray
    down: np.ndarray


def paw_path(paw: Paw, limb: str, body: Body, ends: dict[str, End]) -> PawPath:
    """The path of the paw of a limb through its contacts."""
    (side, end), frames, leg = limb.split("_"), len(paw.flat), sizes_of(body).leg
    tip = body.tips[f"{side}_{PARTS[end][2]}"]
    spots = [_spot(contact, side, end, body, ends[end]) for contact in paw.contacts]
    t = np.arange(frames, dtype=float)
    place = np.tile(spots[0][0], (frames, 1))
    yaw = np.full(frames, spots[0][1])
    up, pitch = np.zeros(frames), np.zeros(frames)
    for k, contact in enumerate(paw.contacts):
        pitch += _rolled(contact, t, first=k == 0, last=k + 1 == len(paw.contacts))
        if k + 1 < len(paw.contacts):
            after = paw.contacts[k + 1]
            share = (t - contact.off) / (after.strike - contact.off)
            part = smooth(share)
            place += part[:, None] * (spots[k + 1][0] - spots[k][0])
            yaw += part * (spots[k + 1][1] - spots[k][1])
            up += contact.lift_height * leg * bump(share)
            pitch += contact.curl * bump(share) + _between(contact, after, t)
    if paw.drift is not None:
        place += leg * paw.drift
    tips = np.stack([place[:, 0], up, place[:, 1]], axis=-1)
    pitch = pitch - paw.flat * _lying(tip, THICK * leg)
    orientation = about(1, yaw) @ about(0, pitch)
    return PawPath(tips - orientation @ tip, orientation, *_rests(paw, frames))


def _spot(contact: PawContact, side: str, end: str, body: Body, ground: End) -> tuple[np.ndarray, float]:
    """(x, z) of the tip, and the heading of the paw."""
    top, _, paw = PARTS[end]
    drawn = body.reach(f"{side}_{paw}", f"{side}_{top}") + body.tips[f"{side}_{paw}"]
    heading, start = float(at(ground.heading, contact.moment)), at(ground.floor, contact.moment)
    ahead = contact.ahead * sizes_of(body).leg + (1.0 - contact.lain) * float(drawn[2])
    ahead += contact.lain * ground.lain
    return start + sign(side) * contact.out * ground.half * across(heading) + ahead * along(
        heading
    ), heading


def _rolled(contact: PawContact, t: np.ndarray, first: bool, last: bool) -> np.ndarray:
    """Pitch while the paw is down."""
    landing = 1.0 - smooth((t - contact.strike) / max(contact.flat - contact.strike, 1))
    leaving = np.clip((t - contact.lift) / max(contact.off - contact.lift, 1), 0.0, 1.0) ** 2
    pitch = contact.rest + (contact.strike_pitch - contact.rest) * landing
    down = (t >= contact.strike) & (t <= contact.off)
    ever = down | (first & (t < contact.strike)) | (last & (t > contact.off))
    return np.where(ever, pitch + (contact.off_pitch - contact.rest) * leaving, 0.0)


def _between(contact: PawContact, after: PawContact, t: np.ndarray) -> np.ndarray:
    """Pitch of a swing beside its curl: it leaves turning as it rolled last, and lands in no hurry."""
    rolling = 2.0 * (contact.off_pitch - contact.rest) / max(contact.off - contact.lift, 1)
    ends, pitches = (contact.off, after.strike), (contact.off_pitch, after.strike_pitch)
    inside = (t > contact.off) & (t < after.strike)
    return np.where(inside, hermite(t, ends, pitches, (rolling, 0.0)), 0.0)


def _lying(tip: np.ndarray, thick: float) -> float:
    """Radians that the bone over the paw turns back until its joint lies on the floor."""
    up, behind = -float(tip[1]), float(tip[2])
    length = float(np.hypot(up, behind))
    return float(np.arctan2(up, behind) - np.arcsin(min(thick / length, 0.9)))


_AT_REST = 2e-5
"""Less change of ``Paw.flat`` in a frame is none: some micrometres."""


def _rests(paw: Paw, frames: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frames in which it is planted, pivoting, and down at all."""
    still, held, down = (np.zeros(frames, dtype=bool) for _ in range(3))
    before = np.concatenate([paw.flat[:1], paw.flat[:-1]])
    for contact in paw.contacts:
        still[max(contact.flat + 1, 0) : max(contact.lift + 1, 0)] = True
        held[max(contact.strike + 1, 0) : max(contact.off + 1, 0)] = True
        down[max(contact.strike, 0) : max(contact.off + 1, 0)] = True
    grounded = np.ones(frames, dtype=bool) if paw.air is None else paw.air.weight == 0.0
    planted = still & (np.abs(paw.flat - before) < _AT_REST) & grounded
    return planted, held & ~planted & grounded, down & grounded
