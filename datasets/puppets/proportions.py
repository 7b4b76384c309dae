"""How long the parts of a body are: people by published tables, caricatures by exaggeration.

Segment lengths of women and men: de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia
parameters, J. Biomechanics 29 (1996), table 4, divided by his mean statures. Heights and breadths that
he does not give: Drillis and Contini (1966) as drawn in Winter, Biomechanics and Motor Control of Human
Movement, figure 4.1. Statures: ANSUR II (Gordon et al. 2014), mean and standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

STATURE = {"woman": (1.629, 0.064), "man": (1.756, 0.069)}
"""Mean and standard deviation, metres."""

_LEVA_STATURE = {"woman": 1.735, "man": 1.741}
_LEVA = {
    "woman": {"thigh": 0.3685, "shank": 0.4323, "upper_arm": 0.2751, "forearm": 0.2643, "foot": 0.2283},
    "man": {"thigh": 0.4222, "shank": 0.4340, "upper_arm": 0.2817, "forearm": 0.2689, "foot": 0.2581},
}
_BREADTH = {
    "woman": {"hip_half": 0.053, "shoulder_half": 0.100, "waist_half": 0.086},
    "man": {"hip_half": 0.050, "shoulder_half": 0.110, "waist_half": 0.088},
}
"""Joint centres lie inside the breadths over skin (0.191 and 0.259 of stature)."""


@dataclass(frozen=True)
class Proportions:
    """Metres. The T-pose is built from these alone (``bodies.py``)."""

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
        """From the hip joint to the sole, standing."""
        return self.thigh + self.shank + self.ankle

    @property
    def arm(self) -> float:
        """From the shoulder joint to the wrist."""
        return self.upper_arm + self.forearm

    def scaled(self, everything: float = 1.0, **factors: float) -> Proportions:
        """With every length multiplied by ``everything``, and the named ones by their own factor too."""
        values = {f.name: getattr(self, f.name) * everything for f in fields(self)}
        return replace(self, **{name: value * factors.get(name, 1.0) for name, value in values.items()})


def human(sex: str, stature: float) -> Proportions:
    """A woman's or man's mean proportions at this stature (metres)."""
    part = {name: length / _LEVA_STATURE[sex] * stature for name, length in _LEVA[sex].items()}
    breadth = {name: share * stature for name, share in _BREADTH[sex].items()}
    ankle, pelvis = 0.039 * stature, 0.020 * stature
    hips = ankle + part["shank"] + part["thigh"]
    return Proportions(
        thigh=part["thigh"],
        shank=part["shank"],
        ankle=ankle,
        ball=0.47 * part["foot"],
        ball_height=0.012 * stature,
        toes=0.27 * part["foot"],
        heel=0.26 * part["foot"],
        hip_half=breadth["hip_half"],
        pelvis=pelvis,
        trunk=0.840 * stature - hips - pelvis,
        shoulder_drop=0.030 * stature,
        clavicle=0.016 * stature,
        shoulder_half=breadth["shoulder_half"],
        upper_arm=part["upper_arm"],
        forearm=part["forearm"],
        hand=0.108 * stature,
        neck=0.065 * stature,
        head=0.095 * stature,
        waist_half=breadth["waist_half"],
        girth=0.040 * stature,
    )
