"""Dogs: the joint set ``dog21`` and how its bones are laid out.

Parts carry the same words as people's: fore legs are arms, fore paws hands. Withers are those of the
breeds' FCI standards (No. 166 German shepherd 60-65 cm, 158 greyhound 71-76, 12 fox terrier at most 39);
dachshund, mastiff and the caricature, and the shares of the segments, are ours.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..conventions import SIDES, sign
from .proportions import Proportions
from .structures import Structure

PAWS = ("left_foot", "right_foot", "left_hand", "right_hand")
"""Roles of the joints whose contacts are labelled: hind paws, then fore paws."""


@dataclass(frozen=True)
class DogSizes(Proportions):
    """Metres. What people's words mean on four legs: ``ankle`` is the height of the hock, ``hand`` that of
    the carpus, ``trunk`` goes along the back, ``shoulder_drop`` is how far the base of the neck lies below
    the top of the blades."""

    blade: float = 0.0
    """From the top of the shoulder blade to the shoulder joint."""
    tail: float = 0.0

    @property
    def leg(self) -> float:
        """Height of the hip joint, standing."""
        return self.ankle + self.thigh * _COS["thigh"] + self.shank * _COS["shank"]

    @property
    def fore_leg(self) -> float:
        """Height of the shoulder joint, standing."""
        return self.hand + self.forearm * _COS["forearm"] + self.upper_arm * _COS["upper_arm"]


SLANT = {"thigh": 0.58, "shank": -0.74, "upper_arm": -0.82, "forearm": 0.14, "blade": 0.60}
"""How far the bones of a standing dog lean forward on their way down, radians."""
_COS = {bone: float(np.cos(angle)) for bone, angle in SLANT.items()}
_SIN = {bone: float(np.sin(angle)) for bone, angle in SLANT.items()}
NECK_UP, HEAD_DOWN, TAIL_DOWN = 0.75, 0.15, 0.75
"""How far neck, head and tail of a standing dog point up or down, radians."""


class FourLegged(Structure):
    """A structure whose bones are laid out for four legs."""

    @property
    def contacts(self) -> tuple[int, ...]:
        return tuple(range(len(PAWS)))

    @property
    def labelled(self) -> tuple[str, ...]:
        return PAWS

    def positions(self, sizes: Proportions) -> dict[str, np.ndarray]:
        """Part -> ``(3,)`` metres, standing on the floor with the hips over the middle."""
        assert isinstance(sizes, DogSizes)
        found = _trunk(sizes)
        for side in SIDES:
            out = np.array([sign(side), 1.0, 1.0])
            for part, place in {**_hind(sizes), **_fore(sizes)}.items():
                found[f"{side}_{part}"] = out * np.array(place)
        return {part: found[part] for part in self.parts}

    def tips(self, sizes: Proportions) -> dict[str, np.ndarray]:
        """Where the last bones end, from their joint."""
        assert isinstance(sizes, DogSizes)
        down = sizes.head * np.array([0.0, -np.sin(HEAD_DOWN), np.cos(HEAD_DOWN)])
        ends = {"head": down, "tail_2": 0.5 * _tail(sizes)}
        for side in SIDES:
            ends[f"{side}_foot"] = np.array([0.0, -sizes.ankle, sizes.ball])
            ends[f"{side}_hand"] = np.array([0.0, -sizes.hand, 0.8 * sizes.ball])
        return ends


def _tail(sizes: DogSizes) -> np.ndarray:
    return sizes.tail * np.array([0.0, -np.sin(TAIL_DOWN), -np.cos(TAIL_DOWN)])


def _trunk(sizes: DogSizes) -> dict[str, np.ndarray]:
    hips = np.array([0.0, sizes.leg + sizes.pelvis, 0.0])
    top = np.array([0.0, _withers(sizes) - sizes.shoulder_drop, sizes.trunk])
    tail = hips + np.array([0.0, -0.2 * sizes.pelvis, -0.6 * sizes.pelvis])
    neck = sizes.neck * np.array([0.0, np.sin(NECK_UP), np.cos(NECK_UP)])
    return {
        "hips": hips,
        "spine_1": hips + 0.12 * (top - hips),
        "spine_2": hips + 0.50 * (top - hips) + np.array([0.0, 0.05 * sizes.trunk, 0.0]),
        "neck": top,
        "head": top + neck,
        "tail_1": tail,
        "tail_2": tail + 0.5 * _tail(sizes),
    }


def _withers(sizes: DogSizes) -> float:
    """Height of the top of the shoulder blades."""
    return sizes.fore_leg + sizes.blade * _COS["blade"]


def _hind(sizes: DogSizes) -> dict[str, tuple[float, float, float]]:
    """Outward, up and forward."""
    out, knee = sizes.hip_half, sizes.thigh * _SIN["thigh"]
    return {
        "up_leg": (out, sizes.leg, 0.0),
        "leg": (out, sizes.leg - sizes.thigh * _COS["thigh"], knee),
        "foot": (out, sizes.ankle, knee + sizes.shank * _SIN["shank"]),
    }


def _fore(sizes: DogSizes) -> dict[str, tuple[float, float, float]]:
    out, ahead = sizes.shoulder_half, 0.90 * sizes.trunk
    elbow = ahead + sizes.upper_arm * _SIN["upper_arm"]
    return {
        "shoulder": (sizes.clavicle, _withers(sizes), ahead - sizes.blade * _SIN["blade"]),
        "arm": (out, sizes.fore_leg, ahead),
        "forearm": (out, sizes.fore_leg - sizes.upper_arm * _COS["upper_arm"], elbow),
        "hand": (out, sizes.hand, elbow + sizes.forearm * _SIN["forearm"]),
    }


def _rows() -> list[tuple[str, str, str]]:
    """Joint name, part, parent's part."""
    rows = [
        ("Hips", "hips", ""),
        ("Spine", "spine_1", "hips"),
        ("Spine1", "spine_2", "spine_1"),
        ("Neck", "neck", "spine_2"),
        ("Head", "head", "neck"),
    ]
    fore = (("Shoulder", "shoulder", "spine_2"), ("Arm", "arm", "*"), ("ForeArm", "forearm", "*"))
    hind = (("UpLeg", "up_leg", "hips"), ("Leg", "leg", "*"), ("Foot", "foot", "*"))
    for limb in ((*fore, ("Hand", "hand", "*")), hind):
        for side in SIDES:
            above = ""
            for name, part, parent in limb:
                rows.append(
                    (side.capitalize() + name, f"{side}_{part}", above if parent == "*" else parent)
                )
                above = f"{side}_{part}"
    return [*rows, ("Tail", "tail_1", "hips"), ("Tail1", "tail_2", "tail_1")]


_PARTS = tuple(part for _, part, _ in _rows())
DOG21 = FourLegged(
    name="dog21",
    names=tuple(name for name, _, _ in _rows()),
    parts=_PARTS,
    parents=tuple(_PARTS.index(parent) if parent else -1 for _, _, parent in _rows()),
    bending=(("spine_1", 0.5), ("spine_2", 0.5)),
    levels=(("spine_1", 0.12), ("spine_2", 0.50)),
    silent=(),
    roles=_PARTS,
)


def dog(build: Mapping[str, float], withers: float, **factors: float) -> DogSizes:
    """A dog of a build (lengths as shares of the withers) with its withers at a height, metres; then the
    named lengths are multiplied."""
    unused = dict.fromkeys(("ball_height", "toes", "heel"), 0.0)
    drawn = DogSizes(**{name: share * withers for name, share in build.items()}, **unused)
    sized = drawn.scaled(**factors)
    assert isinstance(sized, DogSizes)
    return sized
