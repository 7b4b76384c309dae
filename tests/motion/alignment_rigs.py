"""One body, exactly in T-pose at rest, and the same body re-framed: only how it is written changes."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

BONES: dict[str, tuple[str, tuple[float, float, float]]] = {
    "Hips": ("", (0.0, 1.0, 0.0)),
    "Spine": ("Hips", (0.0, 0.1, 0.0)),
    "Spine1": ("Spine", (0.0, 0.2, 0.0)),
    "Neck": ("Spine1", (0.0, 0.25, 0.0)),
    "Head": ("Neck", (0.0, 0.1, 0.0)),
    "HeadTop_End": ("Head", (0.0, 0.2, 0.0)),
}
_SIDES = (("Left", 1.0), ("Right", -1.0))
for _side, _x in _SIDES:
    BONES |= {
        f"{_side}Shoulder": ("Spine1", (_x * 0.05, 0.2, 0.0)),
        f"{_side}Arm": (f"{_side}Shoulder", (_x * 0.12, 0.0, 0.0)),
        f"{_side}ForeArm": (f"{_side}Arm", (_x * 0.28, 0.0, 0.0)),
        f"{_side}Hand": (f"{_side}ForeArm", (_x * 0.25, 0.0, 0.0)),
    }
for _side, _x in _SIDES:
    BONES |= {
        f"{_side}UpLeg": ("Hips", (_x * 0.1, -0.05, 0.0)),
        f"{_side}Leg": (f"{_side}UpLeg", (0.0, -0.45, 0.0)),
        f"{_side}Foot": (f"{_side}Leg", (0.0, -0.42, 0.0)),
        f"{_side}ToeBase": (f"{_side}Foot", (0.0, -0.06, 0.14)),
        f"{_side}Toe_End": (f"{_side}ToeBase", (0.0, 0.0, 0.07)),
    }


def t_pose() -> Skeleton:
    names = list(BONES)
    parents = [names.index(parent) if parent else -1 for parent, _ in BONES.values()]
    return Skeleton(tuple(names), np.array(parents), np.array([offset for _, offset in BONES.values()]))


def reframed(skeleton: Skeleton, frames: np.ndarray) -> Skeleton:
    """The same body whose joint j carries its frame turned by ``frames[j]`` (quaternions, in T-pose)."""
    offsets = np.array(skeleton.offsets)
    above = frames[skeleton.parents[1:]]
    offsets[1:] = rotation.rotate(rotation.conjugate(above), offsets[1:])
    return Skeleton(skeleton.names, skeleton.parents, offsets)


def rewritten(skeleton: Skeleton, rotations: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Local rotations ``(frames, joints, 4)`` of a motion as the re-framed body writes them."""
    _, turned = kinematics.forward(skeleton, rotations, np.zeros((len(rotations), 3)))
    return kinematics.local_from_global(skeleton, rotation.multiply(turned, frames[None]))


def performance(character: Character, count: int = 240, seed: int = 3) -> np.ndarray:
    """``(count, joints, 4)`` local rotations of a two-legged T-pose body: it turns about, leans, swings its
    arms with elbows and knees as hinges; its feet stand level on the floor two thirds of the time."""
    draw = np.random.Generator(np.random.PCG64(seed))
    t = np.arange(count) / 30.0
    joints = character.joint_of
    out = rotation.identity(count, len(character.skeleton))

    def wave(size: float) -> np.ndarray:
        return size * np.sin(t[:, None] * draw.uniform(1, 3, 3) + draw.uniform(0, 6, 3)) * [1.0, 0.6, 0.6]

    for role in ("hips", "spine_1", "spine_2", "neck", "head"):
        out[:, joints[role]] = rotation.from_rotation_vector(wave(0.15))
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), 0.4 * t)
    out[:, joints["hips"]] = rotation.multiply(turn, out[:, joints["hips"]])
    for side, x in (("left", 1.0), ("right", -1.0)):
        lowered = rotation.about(np.array([0.0, 0.0, 1.0]), np.full(count, -1.2 * x))
        swing = rotation.from_rotation_vector(wave(0.4))
        out[:, joints[f"{side}_arm"]] = rotation.multiply(swing, lowered)
        out[:, joints[f"{side}_shoulder"]] = rotation.from_rotation_vector(wave(0.1))
        bend = 0.8 + 0.5 * np.sin(2 * t + x)
        out[:, joints[f"{side}_forearm"]] = rotation.about(np.array([0.0, -x, 0.0]), bend)
        out[:, joints[f"{side}_hand"]] = rotation.from_rotation_vector(wave(0.2))
        lift = 0.5 + 0.4 * np.sin(2 * t + 2 * x)
        out[:, joints[f"{side}_up_leg"]] = rotation.about(np.array([-1.0, 0.0, 0.0]), lift)
        out[:, joints[f"{side}_leg"]] = rotation.about(np.array([1.0, 0.0, 0.0]), 0.2 + lift)
    _, turned = kinematics.forward(character.skeleton, out, np.zeros((count, 3)))
    for side in ("left", "right"):
        level = np.array(turn)
        level[::3] = rotation.multiply(turned[::3, joints[f"{side}_leg"]], turn[::3])
        turned[:, joints[f"{side}_foot"]] = level
        turned[:, joints[f"{side}_toe"]] = level
        turned[:, joints[f"{side}_toe_end"]] = level
    return kinematics.local_from_global(character.skeleton, turned)
