"""Bodies with fingers and twist bones, a bird, and gaits that are loops by construction."""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from tests.motion.alignment_rigs import BONES

Bones = dict[str, tuple[str, tuple[float, float, float]]]
FINGERS = {"Thumb": 0.04, "Index": 0.03, "Middle": 0.01, "Ring": -0.01, "Pinky": -0.03}
"""Finger -> how far its knuckle is in front of the wrist, metres."""


def body(extra: Bones | None = None, *, size: float = 1.0, shanks: float = 1.0) -> Character:
    """The body of ``alignment_rigs`` in T-pose, with more joints at the end, and other shanks."""
    bones = {**BONES, **(extra or {})}
    names = list(bones)
    parents = [names.index(parent) if parent else -1 for parent, _ in bones.values()]
    offsets = size * np.array([offset for _, offset in bones.values()])
    offsets[[name.endswith("Foot") for name in names]] *= shanks
    return Character.of("body", Skeleton(tuple(names), np.array(parents), offsets))


def fingers(*names: str, joints: int = 3) -> Bones:
    """Fingers of both hands, palms down, straight out but for the thumb."""
    bones: Bones = {}
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        for name in names or tuple(FINGERS):
            thumb = name == "Thumb"
            above, offset = f"{side}Hand", (x * (0.03 if thumb else 0.09), 0.0, FINGERS[name])
            for number in range(1, joints + 1):
                joint = f"{side}Hand{name}{number}"
                bones[joint] = (above, offset)
                above, offset = joint, (x * 0.025, 0.0, 0.025 if thumb else 0.0)
    return bones


def twists(*shares: float, chained: bool = False) -> Bones:
    """Twist bones on both bones of arms and legs at shares of their lengths, beside or below each other."""
    bones: Bones = {}
    for side in ("Left", "Right"):
        for bone, end in (("Arm", "ForeArm"), ("ForeArm", "Hand"), ("UpLeg", "Leg"), ("Leg", "Foot")):
            line, above, before = np.array(BONES[f"{side}{end}"][1]), f"{side}{bone}", 0.0
            for number, share in enumerate(shares, 1):
                name = f"{side}{bone}Twist{number:02d}"
                bones[name] = (above, tuple(line * (share - before)))
                if chained:
                    above, before = name, share
    return bones


def hen(wings: bool) -> Character:
    """A bird: a trunk that rises by a fifth, a neck, bent legs, and wings out to the sides."""
    bones: Bones = {
        "Hips": ("", (0.0, 0.35, 0.0)),
        "Spine": ("Hips", (0.0, 0.03, 0.08)),
        "Chest": ("Spine", (0.0, 0.03, 0.08)),
        "Neck": ("Chest", (0.0, 0.10, 0.06)),
        "Head": ("Neck", (0.0, 0.12, 0.02)),
    }
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        bones |= {
            f"{side}UpLeg": ("Hips", (0.06 * x, -0.02, 0.0)),
            f"{side}Leg": (f"{side}UpLeg", (0.0, -0.10, 0.08)),
            f"{side}Foot": (f"{side}Leg", (0.0, -0.12, -0.08)),
            f"{side}Toe": (f"{side}Foot", (0.0, -0.10, 0.05)),
        }
        if wings:
            bones |= {
                f"{side}Arm": ("Chest", (0.06 * x, 0.0, 0.0)),
                f"{side}ForeArm": (f"{side}Arm", (0.15 * x, 0.0, 0.0)),
                f"{side}Hand": (f"{side}ForeArm", (0.15 * x, 0.0, 0.0)),
            }
    names = list(bones)
    parents = [names.index(parent) if parent else -1 for parent, _ in bones.values()]
    offsets = np.array([offset for _, offset in bones.values()])
    return Character.of("hen", Skeleton(tuple(names), np.array(parents), offsets))


def gait(
    character: Character,
    frames: int = 31,
    *,
    turn: float = 0.0,
    speed: float = 1.2,
    seed: int = 0,
    fps: float = 30.0,
) -> Motion:
    """One period of a walk on the spot's arms and legs that travels, and turns by ``turn`` radians in all:
    the last frame is the first, moved as a whole."""
    draw, share = np.random.default_rng(seed), np.linspace(0.0, 1.0, frames)
    swing = np.sin(2 * np.pi * share)
    vectors = (
        0.08 * draw.normal(size=(len(character.skeleton), 3)) * np.sin(2 * np.pi * share)[:, None, None]
    )
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for role, axis, size in (("up_leg", 0, 0.5), ("leg", 0, 0.0), ("arm", 1, -0.4)):
            if f"{side}_{role}" in character.joint_of:
                vectors[:, character.joint_of[f"{side}_{role}"], axis] += sign * size * swing
        if (arm := character.joint_of.get(f"{side}_arm")) is not None:
            vectors[:, arm, 2] -= sign * 1.2
        if (knee := character.joint_of.get(f"{side}_leg")) is not None:
            vectors[:, knee, 0] += 0.4 * (1.0 - np.cos(2 * np.pi * share + (np.pi if sign < 0 else 0.0)))
    local = rotation.multiply(character.reference_pose[None], rotation.from_rotation_vector(vectors))
    heading = turn * share
    about = np.broadcast_to([0.0, 1.0, 0.0], (frames, 3))
    local[:, 0] = rotation.multiply(rotation.about(about, heading), local[:, 0])
    steps = speed / fps * np.stack([np.sin(heading), 0 * heading, np.cos(heading)], axis=1)
    root = np.concatenate([np.zeros((1, 3)), np.cumsum(steps[:-1], axis=0)])
    root[:, 1] = 0.97 * character.measures.hip_height + 0.02 * np.cos(4 * np.pi * share)
    return character.motion(rotation.continuous(local), root, fps)


def squat(character: Character, frames: int = 37) -> Motion:
    """A loop of bent knees under a swaying trunk, in full motion at its ends; feet hardly move."""
    share = np.linspace(0.0, 1.0, frames)
    bend = 0.4 * (1.0 + np.sin(2 * np.pi * share))
    vectors = np.zeros((frames, len(character.skeleton), 3))
    for side in ("left", "right"):
        for role, size in (("up_leg", -1.0), ("leg", 2.0), ("foot", -1.0)):
            vectors[:, character.joint_of[f"{side}_{role}"], 0] = size * bend
    vectors[:, character.joint_of["spine_1"], 0] = 0.3 * np.sin(2 * np.pi * share)
    local = rotation.multiply(character.reference_pose[None], rotation.from_rotation_vector(vectors))
    plain = character.motion(local, np.zeros((frames, 3)), 30.0)
    feet = plain.positions[:, character.joints(["left_foot", "right_foot"])].mean(axis=1)
    return character.motion(local, np.array([0.0, 0.06, 0.0]) - feet, 30.0)


def jump(character: Character, high: float, low: float, *, before: int = 20, after: int = 30) -> Motion:
    """Bent knees on a floor at ``high`` metres for so many frames, a jump down to ``low``, and bent knees
    there; feet stand at one place before and after."""
    air = round(30 * np.sqrt(2 * (high - low) / 9.81)) + 4
    way = np.linspace(0.0, 1.0, air + 1)[1:-1]
    falling = high + (low - high) * way**2 + 0.4 * way * (1.0 - way)
    sole = np.concatenate([np.full(before, high), falling, np.full(after, low)])
    along = np.concatenate([np.zeros(before), 0.8 * way, np.full(after, 0.8)])
    bend = 0.1 + 0.6 * np.concatenate(
        [np.sin(np.linspace(0.0, np.pi, n)) ** 2 for n in (before, air - 1, after)]
    )
    vectors = np.zeros((len(bend), len(character.skeleton), 3))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        for role, size in (("up_leg", -1.0), ("leg", 2.0), ("foot", -1.0)):
            vectors[:, character.joint_of[f"{side}_{role}"], 0] = size * bend
        vectors[:, character.joint_of[f"{side}_arm"], 2] = -sign * 1.2
    local = rotation.multiply(character.reference_pose[None], rotation.from_rotation_vector(vectors))
    plain = character.motion(local, np.zeros((len(bend), 3)), 30.0)
    ankles = character.joints(["left_foot", "right_foot"])
    goal = np.stack([0 * sole, sole + character.standing_places[ankles[0], 1], along], axis=1)
    return character.motion(local, goal - plain.positions[:, ankles].mean(axis=1), 30.0)
