"""Proportions of people: means, spreads and correlations of segment lengths, and samples of them.

All lengths are shares of stature. The primary reports were not at hand: each source says what its figures
were checked against. ANSUR II measured soldiers, so these people are no sample of any population.

- Legs, feet, hands, breadths, statures of women and men: ANSUR II (Gordon et al. 2014, NATICK/TR-15/007),
  ratios of means of its 1986 women and 4082 men, as others computed them from its public records; legs
  are differences of the heights of trochanterion, lateral femoral epicondyle and lateral malleolus. Hip
  and knee heights of 28 women of the records agree to 1.3 %. Deviations of stature are from one
  transcription.
- Arms: from joint to joint, de Leva, J. Biomechanics 29 (1996), table 4, by two transcriptions that
  agree. ANSUR measures arms over the acromion, which lies above the joint.
- Girls and boys: sitting height Fredriks et al. 2005 (Dutch, 1997), head, arm, hand, foot and breadths
  Snyder et al. 1977 (UM-HSRI-77-17), statures CDC 2000; medians as others computed them. The deviation of
  a child's stature is assumed.
- Spreads at given stature: others' regressions on all 6068 records of ANSUR II; of thigh, shank and
  forearm, and correlations: computed from the first 29 women of the records, but one of 1.45 m, and drawn
  towards what the regressions say. With so few a correlation is known to 0.2 at best; men and children
  have the women's.
- Distances of hip and of shoulder joints, neck, ball of the foot, thickness: ours, inside the measured
  breadths.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from ..randomness import Stream


@dataclass(frozen=True)
class Proportions:
    """Metres. The T-pose is built from these alone (``structures.py``)."""

    thigh: float
    shank: float
    ankle: float
    """Height of the ankle joint over the sole."""
    ball: float
    """How far the toe joint lies before the ankle."""
    ball_height: float
    toes: float
    """From the toe joint to the tip."""
    heel: float
    """How far the sole reaches behind the ankle."""
    hip_half: float
    pelvis: float
    """How far the root joint lies over the hip joints."""
    trunk: float
    """From the root joint to the base of the neck."""
    shoulder_drop: float
    """How far the shoulder joints lie below the base of the neck."""
    clavicle: float
    """How far the collar bone starts from the middle."""
    shoulder_half: float
    upper_arm: float
    forearm: float
    hand: float
    neck: float
    head: float
    waist_half: float
    """Half the breadth of the body over the hip bones, for hands that rest there."""
    girth: float
    """Radius of the thigh over the knee, and the measure of all other thickness."""
    hunch: float = 0.0
    """How far a hunched back brings the base of the neck forward."""

    @property
    def leg(self) -> float:
        """Length from the hip joint to the sole, standing."""
        return self.thigh + self.shank + self.ankle

    @property
    def arm(self) -> float:
        """Length from the shoulder joint to the wrist."""
        return self.upper_arm + self.forearm

    def scaled(self, everything: float = 1.0, **factors: float) -> Proportions:
        """Proportions with every length multiplied by ``everything``, and the named ones by their own
        factor too."""
        values = {f.name: getattr(self, f.name) * everything for f in fields(self)}
        return replace(self, **{name: value * factors.get(name, 1.0) for name, value in values.items()})


ADULT = 25
STATURE = {"woman": (1.629, 0.064), "man": (1.756, 0.069)}
"""Mean and standard deviation, metres."""

_LEVA_STATURE = {"woman": 1.735, "man": 1.741}
_LEVA = {"woman": {"upper_arm": 0.2751, "forearm": 0.2643}, "man": {"upper_arm": 0.2817, "forearm": 0.2689}}
"""Metres, of people of that stature."""
_HEIGHTS = {
    "woman": {"hip": 0.5190, "knee": 0.2860, "ankle": 0.0385},
    "man": {"hip": 0.5128, "knee": 0.2799, "ankle": 0.0415},
}
_ENDS = {"woman": {"hand": 0.1112, "foot": 0.1510}, "man": {"hand": 0.1101, "foot": 0.1540}}
_HALF_BREADTH = {
    "woman": {"hip_half": 0.0535, "shoulder_half": 0.100, "waist_half": 0.086},
    "man": {"hip_half": 0.0500, "shoulder_half": 0.110, "waist_half": 0.088},
}
"""Half the distances of hip and shoulder joints, which lie inside the iliac crests (half of them 0.084 and
0.079 of stature) and the acromia (0.112, 0.118), and half the breadth over the hip bones, skin included."""

_GROWTH_PARTS = ("stature", "head", "leg", "arm", "hand", "foot", "shoulder", "hip")
_GROWTH = {
    "woman": {
        6: (1.147, 0.159, 0.459, 0.316, 0.109, 0.155, 0.224, 0.161),
        8: (1.276, 0.148, 0.469, 0.319, 0.109, 0.156, 0.218, 0.162),
        10: (1.380, 0.142, 0.478, 0.322, 0.109, 0.156, 0.217, 0.161),
        12: (1.512, 0.133, 0.484, 0.327, 0.109, 0.155, 0.217, 0.162),
        ADULT: (1.629, 0.128, 0.473, 0.339, 0.111, 0.151, 0.2245, 0.167),
    },
    "man": {
        6: (1.154, 0.162, 0.459, 0.329, 0.111, 0.157, 0.224, 0.162),
        8: (1.279, 0.150, 0.469, 0.333, 0.109, 0.156, 0.218, 0.161),
        10: (1.386, 0.143, 0.480, 0.337, 0.109, 0.157, 0.218, 0.159),
        12: (1.491, 0.136, 0.487, 0.343, 0.109, 0.158, 0.216, 0.157),
        ADULT: (1.756, 0.127, 0.476, 0.343, 0.110, 0.154, 0.2365, 0.157),
    },
}
"""Age in years -> metres; then shares of stature: vertex to chin, stature less sitting height, acromion to
wrist, hand, foot, breadths over the acromia and over the iliac crests."""
_CHILD_SPREAD = 0.045
"""Of a child's stature, share of the median."""

_VARYING = ("thigh", "shank", "upper_arm", "forearm", "hand", "foot", "shoulder", "hip", "head")
_SPREAD = (0.032, 0.034, 0.035, 0.036, 0.040, 0.033, 0.041, 0.055, 0.052)
"""Standard deviations among people of one stature, shares of the mean."""
_CORRELATION = (
    (1.00,),
    (0.30, 1.00),
    (0.15, 0.50, 1.00),
    (0.10, 0.55, 0.40, 1.00),
    (0.05, 0.30, 0.20, 0.60, 1.00),
    (0.05, 0.20, 0.00, 0.45, 0.60, 1.00),
    (-0.10, 0.25, 0.35, 0.30, 0.20, 0.20, 1.00),
    (0.00, 0.00, 0.00, 0.00, 0.00, 0.00, 0.00, 1.00),
    (0.00, 0.00, 0.00, 0.00, 0.00, 0.00, 0.00, 0.00, 1.00),
)
"""Of the same, lower triangle. The trunk is what remains of the stature: people with long legs sit low."""


def human(sex: str, stature: float, age: int = ADULT) -> Proportions:
    """A woman's or man's (under 13 a girl's or boy's) mean proportions at this stature (metres)."""
    return _built(sex, stature, age, dict.fromkeys(_VARYING, 1.0))


def drawn(name: str, sex: str, age: int = ADULT) -> Proportions:
    """The one person of this name among women or men of an age (6, 8, 10, 12 or ``ADULT`` years)."""
    stream = Stream("puppets", "person", name)
    middle, spread = STATURE[sex]
    if age != ADULT:
        middle = _GROWTH[sex][age][0]
        spread = _CHILD_SPREAD * middle
    stature = middle + stream.normal(spread)
    own = [stream.normal() for _ in _VARYING]
    values = np.linalg.cholesky(correlation()) @ np.array(own)
    factors = {
        part: math.exp(size * float(value))
        for part, size, value in zip(_VARYING, _SPREAD, values, strict=True)
    }
    return _built(sex, stature, age, factors)


def correlation() -> np.ndarray:
    """``(9, 9)``: thigh, shank, upper arm, forearm, hand, foot, shoulders, hips, head, at one stature."""
    rows = np.zeros((len(_VARYING), len(_VARYING)))
    for row, values in enumerate(_CORRELATION):
        rows[row, : row + 1] = values
    return rows + np.tril(rows, -1).T


def _built(sex: str, stature: float, age: int, own: Mapping[str, float]) -> Proportions:
    """A body out of means for sex and age and a person's own factors; the trunk takes up the rest."""
    grown = dict(zip(_GROWTH_PARTS, _GROWTH[sex][ADULT], strict=True))
    now = dict(zip(_GROWTH_PARTS, _GROWTH[sex][age], strict=True))
    share = {part: now[part] / grown[part] for part in _GROWTH_PARTS}
    heights, half = _HEIGHTS[sex], _HALF_BREADTH[sex]
    ankle, pelvis = heights["ankle"] * stature, 0.020 * stature
    leg = (heights["hip"] * share["leg"] - heights["ankle"]) / (heights["hip"] - heights["ankle"])
    thigh = (heights["hip"] - heights["knee"]) * leg * own["thigh"] * stature
    shank = (heights["knee"] - heights["ankle"]) * leg * own["shank"] * stature
    arm = share["arm"] / _LEVA_STATURE[sex] * stature
    foot = _ENDS[sex]["foot"] * share["foot"] * own["foot"] * stature
    head = 0.095 * share["head"] * own["head"]
    neck = 0.065 - 0.25 * (head - 0.095)
    return Proportions(
        thigh=thigh,
        shank=shank,
        ankle=ankle,
        ball=0.47 * foot,
        ball_height=0.012 * stature,
        toes=0.27 * foot,
        heel=0.26 * foot,
        hip_half=half["hip_half"] * share["hip"] * own["hip"] * stature,
        pelvis=pelvis,
        trunk=(1.0 - head - neck) * stature - ankle - shank - thigh - pelvis,
        shoulder_drop=0.030 * stature,
        clavicle=0.016 * stature,
        shoulder_half=half["shoulder_half"] * share["shoulder"] * own["shoulder"] * stature,
        upper_arm=_LEVA[sex]["upper_arm"] * arm * own["upper_arm"],
        forearm=_LEVA[sex]["forearm"] * arm * own["forearm"],
        hand=_ENDS[sex]["hand"] * share["hand"] * own["hand"] * stature,
        neck=neck * stature,
        head=head * stature,
        waist_half=half["waist_half"] * share["hip"] * own["hip"] * stature,
        girth=0.040 * stature,
    )
