"""How long the parts of a body are: of people by ``anthropometry.py``, of caricatures by exaggeration."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace


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
