"""The volume around the bones: round cones in the T-pose, blended into one solid.

Sizes go with ``Proportions`` as the points do that hands rest on (``solver/touch_points.py``): palms on
knees, hips and chest lie near the skin.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...cones import Cones
from ..conventions import SIDES, sign
from ..curves import soft_min
from .structures import Body

X, Y, Z = np.eye(3)
MELT = 0.15
"""How far neighbouring cones melt into each other, girths."""
SPREAD = 0.35
"""How far the pull of a bone reaches into the skin of the next, girths."""
_SLICES = 9
"""Cones across the trunk from hips to shoulders."""


@dataclass(frozen=True, eq=False)
class Cone:
    """Between two balls: their middles ``(3,)`` and radii, metres, and the shares of joints in its skin."""

    start: np.ndarray
    end: np.ndarray
    radii: tuple[float, float]
    follows: tuple[tuple[str, float], ...]


class BodyVolume(Cones):
    """The cones of a body as one field."""

    def __init__(self, body: Body, least: float) -> None:
        """least: radius of the thinnest cone, metres."""
        cones = _dog_cones(body) if "tail_1" in body.part else _person_cones(body)
        start, girth = np.stack([cone.start for cone in cones]), body.proportions.girth
        super().__init__(
            start,
            line=np.stack([cone.end for cone in cones]) - start,
            radii=np.maximum(np.array([cone.radii for cone in cones]), least),
            follows=_follows(cones, body),
            spread=SPREAD * girth,
        )
        self.melt, self.edge = MELT * girth, 0.05 * girth

    def field(self, points: np.ndarray) -> np.ndarray:
        """``(points,)`` metres to the skin of all cones melted together, cut flat at the floor."""
        each = self.distances(points)
        nearest = each.min(axis=0)
        melted = nearest - self.melt * np.log(np.exp((nearest - each) / self.melt).sum(axis=0))
        return -soft_min(-melted, points[:, 1], self.edge)

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Opposite corners of a box around it."""
        ends = np.concatenate([self.start, self.start + self.line])
        radii = np.concatenate([self.radii[:, 0], self.radii[:, 1]])[:, None] + 4.0 * self.melt
        return (ends - radii).min(axis=0), (ends + radii).max(axis=0)


def _follows(cones: Sequence[Cone], body: Body) -> np.ndarray:
    """``(cones, joints)`` shares of the joints of the rig."""
    shares = np.zeros((len(cones), body.structure.joints))
    for row, cone in enumerate(cones):
        for part, share in cone.follows:
            joint = body.part[part]
            while joint >= body.structure.joints:
                # no joint of the rig: the nearest above moves it
                joint = body.structure.parents[joint]
            shares[row, joint] += share
    return shares


def _chain(part: str, *balls: tuple[np.ndarray, float]) -> list[Cone]:
    """Cones from ball to ball, each a middle and a radius, in the skin of one part."""
    return [Cone(a, b, (near, far), ((part, 1.0),)) for (a, near), (b, far) in pairwise(balls)]


def _shares(levels: Sequence[tuple[str, float]], height: float) -> tuple[tuple[str, float], ...]:
    """Joints of the spine that a slice follows: the one below it, near a joint also the one before."""
    reached = [1.0, *(np.clip((height - start) / 0.16 + 0.5, 0.0, 1.0) for _, start in levels[1:]), 0.0]
    return tuple((part, float(reached[k] - reached[k + 1])) for k, (part, _) in enumerate(levels))


# --------------------------------------------------------------------------------- a body on two legs
def _person_cones(body: Body) -> list[Cone]:
    """The cones of a person or caricature."""
    at = body.places
    size, neck = body.proportions.head, 0.62 * body.proportions.girth
    skull = at["head"] + 0.54 * size * Y
    mouth = skull - 0.3 * size * Y
    cones = [
        *_trunk(body, at),
        *_chain("neck", (at["neck"], 1.2 * neck), (at["head"] + 0.1 * size * Y, neck)),
        *_chain("head", (skull, 0.45 * size), (skull + size * (0.14 * Z - 0.02 * Y), 0.43 * size)),
        *_chain("head", (mouth + 0.12 * size * Z, 0.26 * size), (mouth + 0.28 * size * Z, 0.22 * size)),
    ]
    for side in SIDES:
        cones += [*_leg(body, at, side), *_foot(body, at[f"{side}_foot"], side), *_arm(body, at, side)]
    return cones


def _trunk(body: Body, at: Mapping[str, np.ndarray]) -> list[Cone]:
    """Slices from the hips to the shoulders, each a cone across the body."""
    p, levels = body.proportions, (("hips", 0.0), *body.structure.levels.items())
    spine = [(height, at[part]) for part, height in levels] + [(1.0, at["neck"])]
    heights, points = np.array([h for h, _ in spine]), np.stack([point for _, point in spine])
    cones = []
    for rank in range(_SLICES + 1):
        height = -0.06 + 0.96 * rank / _SLICES
        middle = np.array([np.interp(height, heights, points[:, axis]) for axis in range(3)])
        middle[1] = at["hips"][1] + height * p.trunk
        depth = p.girth * float(np.interp(height, (0.0, 0.3, 0.65, 0.9), (1.45, 1.3, 1.4, 0.95)))
        waist, chest = 0.95 * p.waist_half, 0.80 * p.shoulder_half
        half = float(np.interp(height, (0.0, 0.35, 0.7, 0.9), (waist, 0.82 * waist, chest, 0.75 * chest)))
        across = max(half - depth, 0.1 * depth) * X
        cones.append(Cone(middle - across, middle + across, (depth, depth), _shares(levels, height)))
    return cones


def _leg(body: Body, at: Mapping[str, np.ndarray], side: str) -> list[Cone]:
    girth = body.proportions.girth
    top, knee, ankle = (at[f"{side}_{part}"] for part in ("up_leg", "leg", "foot"))
    calf = knee + 0.3 * (ankle - knee) - 0.18 * girth * Z
    return [
        *_chain(f"{side}_up_leg", (top, 1.12 * girth), (knee, 0.75 * girth)),
        *_chain(f"{side}_leg", (knee, 0.72 * girth), (calf, 0.72 * girth), (ankle, 0.48 * girth)),
    ]


def _foot(body: Body, ankle: np.ndarray, side: str) -> list[Cone]:
    """Heel to ball, and toes; flat on the floor."""
    p, foot, toe = body.proportions, f"{side}_foot", f"{side}_toe"
    thick, ball, tip = min(0.45 * p.ankle, 0.9 * p.heel), 0.45 * p.girth, 0.4 * p.girth
    floor = ankle * [1.0, 0.0, 1.0]
    aside, lift, high = sign(side) * 0.12 * p.girth * X, 0.5 * MELT * p.girth, floor + p.ankle * Y
    heel = floor + (thick + lift) * Y + (thick - p.heel) * Z
    knuckle = floor + (ball + lift) * Y + p.ball * Z
    end = floor + (tip + lift) * Y + max(p.ball + p.toes - tip, p.ball + 0.1 * p.toes) * Z
    return [
        *_chain(foot, (high, 0.5 * p.girth), (heel, thick)),
        *_chain(foot, (high, 0.5 * p.girth), (knuckle, ball)),
        *_chain(foot, (heel, thick), (knuckle + aside, ball)),
        *_chain(foot, (heel, thick), (knuckle - aside, ball)),
        *_chain(toe, (knuckle + aside, ball), (end + aside, tip)),
        *_chain(toe, (knuckle - aside, ball), (end - aside, tip)),
    ]


def _arm(body: Body, at: Mapping[str, np.ndarray], side: str) -> list[Cone]:
    p, girth, out, hand = body.proportions, body.proportions.girth, sign(side), f"{side}_hand"
    shoulder, elbow, wrist = at[f"{side}_arm"], at[f"{side}_forearm"], at[hand]
    collar = np.array([out * p.clavicle, shoulder[1], shoulder[2]])
    palm, fingers = wrist + out * 0.3 * p.hand * X, wrist + out * (p.hand - 0.36 * girth) * X
    wide, thick = min(0.14 * p.hand, 0.3 * girth) * Z, 0.36 * girth
    return [
        *_chain(f"{side}_shoulder", (collar, 0.8 * girth), (shoulder, 0.72 * girth)),
        *_chain(f"{side}_arm", (shoulder, 0.66 * girth), (elbow, 0.48 * girth)),
        *_chain(f"{side}_forearm", (elbow, 0.48 * girth), (wrist, thick)),
        *_chain(hand, (wrist, thick), (palm - wide, thick)),
        *_chain(hand, (wrist, thick), (palm + wide, thick)),
        *_chain(hand, (palm - wide, thick), (fingers - 0.5 * wide, 0.33 * girth)),
        *_chain(hand, (palm + wide, thick), (fingers + 0.5 * wide, 0.33 * girth)),
    ]


# -------------------------------------------------------------------------------------------- dogs
_DOG_SLICES = 15
_ALONG = (0.0, 0.5, 0.85, 1.0)
_RADIUS, _TOP, _BOTTOM = (2.3, 2.1, 2.7, 2.0), (0.8, 0.6, 1.3, 1.0), (1.9, 2.6, 4.6, 2.2)
"""Of the trunk from the hips to the base of the neck: radius, and how far its middle hangs below the back
on top and at the belly, girths."""


def _dog_cones(body: Body) -> list[Cone]:
    """The cones of a dog."""
    at, p, girth = body.places, body.proportions, body.proportions.girth
    levels, nose = (("hips", 0.0), *body.structure.levels.items()), body.tips["head"]
    # the base of the neck lies below the withers, which the back goes up to
    withers = at["neck"] + (p.shoulder_drop + 0.4 * girth) * Y
    cones = []
    for along in np.linspace(-0.04, 1.0, _DOG_SLICES):
        middle = at["hips"] + along * (withers - at["hips"])
        radius, top, bottom = (
            girth * float(np.interp(along, _ALONG, row)) for row in (_RADIUS, _TOP, _BOTTOM)
        )
        follows = _shares(levels, float(along))
        cones.append(Cone(middle - top * Y, middle - bottom * Y, (radius, 0.9 * radius), follows))
    skull, tail = at["head"] + 0.2 * nose, at["tail_2"] + body.tips["tail_2"]
    cones += [
        *_chain("neck", (at["neck"] - 0.5 * girth * Y, 1.9 * girth), (at["head"], 1.3 * girth)),
        *_chain("head", (skull, 0.27 * p.head), (skull, 0.27 * p.head)),
        *_chain("head", (skull, 0.19 * p.head), (at["head"] + 0.87 * nose, 0.12 * p.head)),
        *_chain("tail_1", (at["tail_1"], 0.5 * girth), (at["tail_2"], 0.42 * girth)),
        *_chain("tail_2", (at["tail_2"], 0.42 * girth), (tail, 0.3 * girth)),
    ]
    for side in SIDES:
        for parts, radii in _DOG_LEGS:
            names = [f"{side}_{part}" for part in parts]
            for part, below, (near, far) in zip(names, names[1:], radii, strict=False):
                cones += _chain(part, (at[part], near * girth), (at[below], far * girth))
            # from the last joint down, and forward along the floor
            paw = names[-1]
            tip = at[paw] + body.tips[paw] + (0.45 + 0.5 * MELT) * girth * Y
            ground, toes = tip - 0.3 * p.ball * Z, tip + 0.6 * p.ball * Z
            cones += _chain(paw, (at[paw], 0.42 * girth), (ground, 0.45 * girth), (toes, 0.42 * girth))
    return cones


_DOG_LEGS = (
    (("shoulder", "arm", "forearm", "hand"), ((0.9, 1.2), (1.25, 0.85), (0.8, 0.48))),
    (("up_leg", "leg", "foot"), ((1.9, 1.0), (0.95, 0.45))),
)
"""Parts of a fore and of a hind leg from the top, and the radii of all but the paw at both ends, girths."""
