"""Dogs: the joint set ``dog21`` and how its bones are laid out.

Parts carry the same words as people's: fore legs are arms, fore paws hands. Withers are those of the
breeds' FCI standards (No. 166 German shepherd 60-65 cm, 158 greyhound 71-76, 12 fox terrier at most 39),
the shepherd's by several transcriptions, the greyhound's by clubs' figures, the terrier's from memory;
dachshund, mastiff and the caricature, and the shares of the segments, are ours.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .proportions import Proportions
from .structures import ARMS, Places, Structure, paired

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
_TAIL = np.array([0.0, -np.sin(TAIL_DOWN), -np.cos(TAIL_DOWN)])


class FourLegged(Structure):
    """A structure whose bones are laid out for four legs."""

    def layout(self, sizes: Proportions) -> tuple[Places, Places]:
        assert isinstance(sizes, DogSizes)
        withers = sizes.fore_leg + sizes.blade * _COS["blade"]
        hips = np.array([0.0, sizes.leg + sizes.pelvis, 0.0])
        top = np.array([0.0, withers - sizes.shoulder_drop, sizes.trunk])
        tail = hips + np.array([0.0, -0.2 * sizes.pelvis, -0.6 * sizes.pelvis])
        trunk = {
            "hips": hips,
            "spine_1": hips + 0.12 * (top - hips),
            "spine_2": hips + 0.50 * (top - hips) + np.array([0.0, 0.05 * sizes.trunk, 0.0]),
            "neck": top,
            "head": top + sizes.neck * np.array([0.0, np.sin(NECK_UP), np.cos(NECK_UP)]),
            "tail_1": tail,
            "tail_2": tail + 0.5 * sizes.tail * _TAIL,
        }
        out, knee, half = sizes.hip_half, sizes.thigh * _SIN["thigh"], sizes.shoulder_half
        ahead = 0.90 * sizes.trunk
        elbow = ahead + sizes.upper_arm * _SIN["upper_arm"]
        legs = {
            "up_leg": (out, sizes.leg, 0.0),
            "leg": (out, sizes.leg - sizes.thigh * _COS["thigh"], knee),
            "foot": (out, sizes.ankle, knee + sizes.shank * _SIN["shank"]),
            "shoulder": (sizes.clavicle, withers, ahead - sizes.blade * _SIN["blade"]),
            "arm": (half, sizes.fore_leg, ahead),
            "forearm": (half, sizes.fore_leg - sizes.upper_arm * _COS["upper_arm"], elbow),
            "hand": (half, sizes.hand, elbow + sizes.forearm * _SIN["forearm"]),
        }
        return trunk, legs

    def ends(self, sizes: Proportions) -> tuple[Places, Places]:
        assert isinstance(sizes, DogSizes)
        nose = sizes.head * np.array([0.0, -np.sin(HEAD_DOWN), np.cos(HEAD_DOWN)])
        paws = {"foot": (0.0, -sizes.ankle, sizes.ball), "hand": (0.0, -sizes.hand, 0.8 * sizes.ball)}
        return {"head": nose, "tail_2": 0.5 * sizes.tail * _TAIL}, paws


DOG21 = FourLegged(
    "dog21",
    [
        ("Hips", "hips", ""),
        ("Spine", "spine_1", "hips"),
        ("Spine1", "spine_2", "spine_1"),
        ("Neck", "neck", "spine_2"),
        ("Head", "head", "neck"),
        *paired([("*Shoulder", "shoulder", "spine_2"), *ARMS[1:]]),
        *paired([("*UpLeg", "up_leg", "hips"), ("*Leg", "leg", "up_leg"), ("*Foot", "foot", "leg")]),
        ("Tail", "tail_1", "hips"),
        ("Tail1", "tail_2", "tail_1"),
    ],
    bending={"spine_1": 0.5, "spine_2": 0.5},
    levels={"spine_1": 0.12, "spine_2": 0.50},
    contact_roles=PAWS,
)


def dog(build: Mapping[str, float], withers: float, **factors: float) -> DogSizes:
    """A dog of a build (lengths as shares of the withers) with its withers at a height, metres; then the
    named lengths are multiplied."""
    unused = dict.fromkeys(("ball_height", "toes", "heel"), 0.0)
    drawn = DogSizes(**{name: share * withers for name, share in build.items()}, **unused)
    sized = drawn.scaled(**factors)
    assert isinstance(sized, DogSizes)
    return sized
