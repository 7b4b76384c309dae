"""Flesh around the bones: round cones in the T-pose, blended into one solid.

Sizes go with ``Proportions`` as the points do that hands rest on (``solver/touch_points.py``): palms on
knees, hips and chest lie near the skin.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..conventions import SIDES, sign
from ..curves import soft_min
from .structures import Body

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


class Flesh:
    """Cones as one field."""

    def __init__(self, body: Body, cones: Sequence[Cone], least: float) -> None:
        """least: radius of the thinnest cone."""
        self.start = np.stack([cone.start for cone in cones])
        self.line = np.stack([cone.end for cone in cones]) - self.start
        self.radii = np.maximum(np.array([cone.radii for cone in cones]), least)
        self.melt, self.spread = MELT * body.proportions.girth, SPREAD * body.proportions.girth
        self.edge = 0.05 * body.proportions.girth
        self.follows = np.zeros((len(cones), body.structure.joints))
        for row, cone in enumerate(cones):
            for part, share in cone.follows:
                self.follows[row, joint_of(body, part)] += share

    def distances(self, points: np.ndarray) -> np.ndarray:
        """``(cones, points)`` metres."""
        return np.stack([self._distance(cone, points.T) for cone in range(len(self.line))])

    def _distance(self, cone: int, points: np.ndarray) -> np.ndarray:
        """``(points,)`` metres from one cone; points ``(3, points)``."""
        line, (near, far) = self.line[cone], self.radii[cone]
        x, y, z = (points[axis] - self.start[cone, axis] for axis in range(3))
        square = max(float(line @ line), 1e-12)
        along = np.clip((x * line[0] + y * line[1] + z * line[2]) / square, 0.0, 1.0)
        apart = (x - along * line[0]) ** 2 + (y - along * line[1]) ** 2 + (z - along * line[2]) ** 2
        return np.sqrt(apart) - (near + along * (far - near))

    def field(self, points: np.ndarray) -> np.ndarray:
        """``(points,)`` metres to the skin of all cones melted together, cut flat at the floor."""
        each = self.distances(points)
        nearest = each.min(axis=0)
        melted = nearest - self.melt * np.log(np.exp((nearest - each) / self.melt).sum(axis=0))
        return -soft_min(-melted, points[:, 1], self.edge)

    def weights(self, points: np.ndarray) -> np.ndarray:
        """``(points, joints)`` shares of the joints, fading with the distance from their cones."""
        each = self.distances(points)
        pull = np.exp((each.min(axis=0) - each) / self.spread)
        return (pull / pull.sum(axis=0)).T @ self.follows

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Opposite corners of a box around it."""
        ends = np.concatenate([self.start, self.start + self.line])
        radii = np.concatenate([self.radii[:, 0], self.radii[:, 1]])[:, None] + 4.0 * self.melt
        return (ends - radii).min(axis=0), (ends + radii).max(axis=0)


def joint_of(body: Body, part: str) -> int:
    """The joint of the rig that moves a part: its own, or the nearest above."""
    joint = body.part[part]
    while joint >= body.structure.joints:
        joint = body.structure.parents[joint]
    return joint


# --------------------------------------------------------------------------------- a body on two legs
def person_cones(body: Body) -> list[Cone]:
    """The cones of a person or caricature."""
    at = joints_at(body)
    found = [*_trunk(body, at), *_head(body, at)]
    for side in SIDES:
        found += [*_leg(body, at, side), *_foot(body, at, side), *_arm(body, at, side)]
    return found


def joints_at(body: Body) -> dict[str, np.ndarray]:
    """Part -> ``(3,)`` its joint in the T-pose."""
    positions = np.array(body.offsets)
    for joint, parent in enumerate(body.structure.parents):
        if parent >= 0:
            positions[joint] += positions[parent]
    return {part: positions[joint] for part, joint in body.part.items()}


def _ahead(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
    return np.array([x, y, z])


def _trunk(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    """Slices from the hips to the shoulders, each a cone across the body."""
    p, levels = body.proportions, (("hips", 0.0), *body.structure.levels)
    spine = [(height, at[part]) for part, height in levels] + [(1.0, at["neck"])]
    heights, points = np.array([h for h, _ in spine]), np.stack([point for _, point in spine])
    found = []
    for rank in range(_SLICES + 1):
        height = -0.06 + 0.96 * rank / _SLICES
        middle = np.array([np.interp(height, heights, points[:, axis]) for axis in range(3)])
        middle[1] = at["hips"][1] + height * p.trunk
        depth = p.girth * float(np.interp(height, (0.0, 0.3, 0.65, 0.9), (1.45, 1.3, 1.4, 0.95)))
        waist, chest = 0.95 * p.waist_half, 0.80 * p.shoulder_half
        half = float(np.interp(height, (0.0, 0.35, 0.7, 0.9), (waist, 0.82 * waist, chest, 0.75 * chest)))
        across = _ahead(x=max(half - depth, 0.1 * depth))
        found.append(Cone(middle - across, middle + across, (depth, depth), shares(levels, height)))
    return found


def shares(levels: Sequence[tuple[str, float]], height: float) -> tuple[tuple[str, float], ...]:
    """Which joints of the spine a slice follows: the one below it, near a joint also the one before."""
    reached = [1.0, *(np.clip((height - start) / 0.16 + 0.5, 0.0, 1.0) for _, start in levels[1:]), 0.0]
    return tuple((part, float(reached[k] - reached[k + 1])) for k, (part, _) in enumerate(levels))


def _head(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    size, neck = body.proportions.head, 0.62 * body.proportions.girth
    skull = at["head"] + _ahead(y=0.54 * size)
    return [
        Cone(at["neck"], at["head"] + _ahead(y=0.1 * size), (1.2 * neck, neck), (("neck", 1.0),)),
        Cone(
            skull,
            skull + _ahead(y=-0.02 * size, z=0.14 * size),
            (0.45 * size, 0.43 * size),
            (("head", 1.0),),
        ),
        Cone(
            skull + _ahead(y=-0.3 * size, z=0.12 * size),
            skull + _ahead(y=-0.3 * size, z=0.28 * size),
            (0.26 * size, 0.22 * size),
            (("head", 1.0),),
        ),
    ]


def _leg(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    girth, top, knee, ankle = (
        body.proportions.girth,
        at[f"{side}_up_leg"],
        at[f"{side}_leg"],
        at[f"{side}_foot"],
    )
    calf = knee + 0.3 * (ankle - knee) - _ahead(z=0.18 * girth)
    return [
        Cone(top, knee, (1.12 * girth, 0.75 * girth), ((f"{side}_up_leg", 1.0),)),
        Cone(knee, calf, (0.72 * girth, 0.72 * girth), ((f"{side}_leg", 1.0),)),
        Cone(calf, ankle, (0.72 * girth, 0.48 * girth), ((f"{side}_leg", 1.0),)),
    ]


def _foot(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    """Heel to ball, and toes; flat on the floor."""
    p, ankle = body.proportions, at[f"{side}_foot"]
    ankle = ankle * np.array([1.0, 0.0, 1.0])
    thick = min(0.45 * p.ankle, 0.9 * p.heel)
    ball, tip = 0.45 * p.girth, 0.4 * p.girth
    out = sign(side) * 0.12 * p.girth
    foot, toe = ((f"{side}_foot", 1.0),), ((f"{side}_toe", 1.0),)
    lift = 0.5 * MELT * p.girth
    heel = ankle + _ahead(y=thick + lift, z=-p.heel + thick)
    knuckle = ankle + _ahead(y=ball + lift, z=p.ball)
    end = ankle + _ahead(y=tip + lift, z=max(p.ball + p.toes - tip, p.ball + 0.1 * p.toes))
    aside = _ahead(x=out)
    return [
        Cone(ankle + _ahead(y=p.ankle), heel, (0.5 * p.girth, thick), foot),
        Cone(ankle + _ahead(y=p.ankle), knuckle, (0.5 * p.girth, ball), foot),
        Cone(heel, knuckle + aside, (thick, ball), foot),
        Cone(heel, knuckle - aside, (thick, ball), foot),
        Cone(knuckle + aside, end + aside, (ball, tip), toe),
        Cone(knuckle - aside, end - aside, (ball, tip), toe),
    ]


def _arm(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    p, girth, out = body.proportions, body.proportions.girth, sign(side)
    shoulder, elbow, wrist = at[f"{side}_arm"], at[f"{side}_forearm"], at[f"{side}_hand"]
    collar = np.array([out * p.clavicle, shoulder[1], shoulder[2]])
    hand = ((f"{side}_hand", 1.0),)
    palm = wrist + _ahead(x=out * 0.3 * p.hand)
    fingers = wrist + _ahead(x=out * (p.hand - 0.36 * girth))
    wide = min(0.14 * p.hand, 0.3 * girth)
    return [
        Cone(collar, shoulder, (0.8 * girth, 0.72 * girth), ((f"{side}_shoulder", 1.0),)),
        Cone(shoulder, elbow, (0.66 * girth, 0.48 * girth), ((f"{side}_arm", 1.0),)),
        Cone(elbow, wrist, (0.48 * girth, 0.36 * girth), ((f"{side}_forearm", 1.0),)),
        *(Cone(wrist, palm + _ahead(z=k * wide), (0.36 * girth, 0.36 * girth), hand) for k in (-1.0, 1.0)),
        *(
            Cone(
                palm + _ahead(z=k * wide),
                fingers + _ahead(z=k * 0.5 * wide),
                (0.36 * girth, 0.33 * girth),
                hand,
            )
            for k in (-1.0, 1.0)
        ),
    ]


_DOG_SLICES = 15
_ALONG = (0.0, 0.5, 0.85, 1.0)
_RADIUS, _TOP, _BOTTOM = (2.3, 2.1, 2.7, 2.0), (0.8, 0.6, 1.3, 1.0), (1.9, 2.6, 4.6, 2.2)
"""Of the trunk from the hips to the base of the neck: radius, and how far its middle hangs below the back
on top and at the belly, girths."""


def dog_cones(body: Body) -> list[Cone]:
    """The cones of a dog."""
    at = joints_at(body)
    found = [*_dog_trunk(body, at), *_dog_head(body, at)]
    for side in SIDES:
        found += [*_dog_fore(body, at, side), *_dog_hind(body, at, side)]
    return found


def _dog_trunk(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    girth, levels = body.proportions.girth, (("hips", 0.0), *body.structure.levels)
    # the base of the neck lies below the withers, which the back goes up to
    withers = at["neck"] + np.array([0.0, body.proportions.shoulder_drop + 0.4 * girth, 0.0])
    found = []
    for along in np.linspace(-0.04, 1.0, _DOG_SLICES):
        middle = at["hips"] + along * (withers - at["hips"])
        radius, top, bottom = (
            girth * float(np.interp(along, _ALONG, row)) for row in (_RADIUS, _TOP, _BOTTOM)
        )
        back, belly = (middle - np.array([0.0, down, 0.0]) for down in (top, bottom))
        found.append(Cone(back, belly, (radius, 0.9 * radius), shares(levels, float(along))))
    return found


def _dog_head(body: Body, at: dict[str, np.ndarray]) -> list[Cone]:
    girth, size, nose = body.proportions.girth, body.proportions.head, body.tips["head"]
    skull, tail = at["head"] + 0.2 * nose, at["tail_2"] + body.tips["tail_2"]
    head = (("head", 1.0),)
    return [
        Cone(
            at["neck"] - np.array([0.0, 0.5 * girth, 0.0]),
            at["head"],
            (1.9 * girth, 1.3 * girth),
            (("neck", 1.0),),
        ),
        Cone(skull, skull, (0.27 * size, 0.27 * size), head),
        Cone(skull, at["head"] + 0.87 * nose, (0.19 * size, 0.12 * size), head),
        Cone(at["tail_1"], at["tail_2"], (0.5 * girth, 0.42 * girth), (("tail_1", 1.0),)),
        Cone(at["tail_2"], tail, (0.42 * girth, 0.3 * girth), (("tail_2", 1.0),)),
    ]


def _dog_fore(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    blade, shoulder, elbow, wrist = (
        at[f"{side}_{part}"] for part in ("shoulder", "arm", "forearm", "hand")
    )
    return [
        _dog_cone(body, blade, shoulder, (0.9, 1.2), f"{side}_shoulder"),
        _dog_cone(body, shoulder, elbow, (1.25, 0.85), f"{side}_arm"),
        _dog_cone(body, elbow, wrist, (0.8, 0.48), f"{side}_forearm"),
        *_dog_paw(body, wrist, f"{side}_hand"),
    ]


def _dog_hind(body: Body, at: dict[str, np.ndarray], side: str) -> list[Cone]:
    hip, knee, hock = (at[f"{side}_{part}"] for part in ("up_leg", "leg", "foot"))
    return [
        _dog_cone(body, hip, knee, (1.9, 1.0), f"{side}_up_leg"),
        _dog_cone(body, knee, hock, (0.95, 0.45), f"{side}_leg"),
        *_dog_paw(body, hock, f"{side}_foot"),
    ]


def _dog_paw(body: Body, joint: np.ndarray, part: str) -> list[Cone]:
    """Cones from the last joint down, and forward along the floor."""
    high = (0.45 + 0.5 * MELT) * body.proportions.girth
    tip = joint + body.tips[part]
    ground = tip + np.array([0.0, high, -0.3 * body.proportions.ball])
    toes = tip + np.array([0.0, high, 0.6 * body.proportions.ball])
    return [
        _dog_cone(body, joint, ground, (0.42, 0.45), part),
        _dog_cone(body, ground, toes, (0.45, 0.42), part),
    ]


def _dog_cone(
    body: Body, start: np.ndarray, end: np.ndarray, radii: tuple[float, float], part: str
) -> Cone:
    """radii: girths."""
    girth = body.proportions.girth
    return Cone(start, end, (radii[0] * girth, radii[1] * girth), ((part, 1.0),))
