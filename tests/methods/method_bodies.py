"""Small bodies and motions with known answers, for the tests of the methods."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from retarget_bench.api import Context, Prediction
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import EndSite, Skeleton

ANKLE = 0.1


def body(
    name: str = "puppet",
    *,
    thigh: float = 0.45,
    shin: float = 0.42,
    hip: float = 0.1,
    arm: float = 0.28,
    shoulder: float = 0.18,
    spines: int = 3,
    droop: float = 0.0,
    scale: float = 1.0,
) -> Character:
    """A biped in T-pose, its soles on the floor.

    spines: how many joints share a straight trunk of 0.5 m. droop: degrees that the arms hang at rest (an
    A-pose): only the rest pose differs then, not the body.
    """
    rows: list[tuple[str, str, tuple[float, float, float]]] = [
        ("Hips", "", (0.0, ANKLE + shin + thigh, 0.0))
    ]
    for k in range(spines):
        rows.append((f"Spine{k or ''}", rows[-1][0], (0.0, 0.5 / spines, 0.0)))
    chest = rows[-1][0]
    rows += [("Neck", chest, (0.0, 0.12, 0.0)), ("Head", "Neck", (0.0, 0.1, 0.02))]
    fall = np.radians(droop)
    for side, out in (("Left", 1.0), ("Right", -1.0)):
        along = np.array([out * np.cos(fall), -np.sin(fall), 0.0])
        rows += [
            (f"{side}Shoulder", chest, (0.04 * out, 0.08, 0.0)),
            (f"{side}Arm", f"{side}Shoulder", ((shoulder - 0.04) * out, 0.0, 0.0)),
            (f"{side}ForeArm", f"{side}Arm", tuple(arm * along)),
            (f"{side}Hand", f"{side}ForeArm", tuple(0.9 * arm * along)),
            (f"{side}UpLeg", "Hips", (hip * out, 0.0, 0.0)),
            (f"{side}Leg", f"{side}UpLeg", (0.0, -thigh, 0.0)),
            (f"{side}Foot", f"{side}Leg", (0.0, -shin, 0.0)),
            (f"{side}ToeBase", f"{side}Foot", (0.0, -ANKLE, 0.15)),
        ]
    names = [row[0] for row in rows]
    parents = [names.index(row[1]) if row[1] else -1 for row in rows]
    tips = tuple(EndSite(names.index(f"{side}ToeBase"), (0.0, 0.0, 0.05)) for side in ("Left", "Right"))
    offsets = scale * np.array([row[2] for row in rows])
    return Character.of(name, Skeleton(tuple(names), np.array(parents), offsets, tips))


def without(character: Character, *joints: str) -> Character:
    """The body without these joints: what hangs from them hangs, as it is at rest, from what they hung
    from."""
    full = character.skeleton
    kept = [k for k, name in enumerate(full.names) if name not in joints]
    above = full.parents.copy()
    for k in range(len(above)):  # parents come first
        if above[k] >= 0 and full.names[above[k]] in joints:
            above[k] = above[above[k]]
    places = full.rest_positions
    offsets = np.where(above[:, None] >= 0, places - places[above], places)[kept]
    parents = np.array([kept.index(above[k]) if above[k] >= 0 else -1 for k in kept])
    tips = tuple(EndSite(kept.index(t.parent), t.offset) for t in full.end_sites if t.parent in kept)
    names = tuple(full.names[k] for k in kept)
    return Character.of("short of joints", Skeleton(names, parents, offsets, tips))


SHORT = without(body("short"), "LeftToeBase", "RightToeBase", "LeftShoulder", "RightShoulder", "Spine2")
"""A body without toes, collar bones and the third joint of the spine."""


def about(axis: str, degrees: np.ndarray) -> np.ndarray:
    """``(frames, 4)`` turns about a coordinate axis, w first, by SciPy."""
    vector = np.radians(degrees)[:, None] * np.eye(3)["XYZ".index(axis)]
    return first(Rotation.from_rotvec(vector))


def first(turn: Rotation) -> np.ndarray:
    """``(..., 4)`` SciPy's quaternions with w in front."""
    return turn.as_quat()[..., [3, 0, 1, 2]]


def pose(character: Character, frames: int, turns: dict[str, np.ndarray], root: np.ndarray) -> Motion:
    """A motion with these local rotations by joint name, identity elsewhere."""
    rotations = np.zeros((frames, len(character.skeleton), 4))
    rotations[..., 0] = 1.0
    for joint, turn in turns.items():
        rotations[:, character.skeleton.index(joint)] = turn
    return character.motion(rotations, root, 30.0)


def dance(character: Character, frames: int = 40, seed: int = 0) -> Motion:
    """Every joint turning smoothly about its own axis, travelling."""
    random = np.random.default_rng(seed)
    t = np.linspace(0.0, 2.0 * np.pi, frames)
    turns = {}
    for joint in character.skeleton.names:
        axis = random.normal(size=3)
        angle = random.uniform(0.2, 0.7) * np.sin(t + random.uniform(0, 6))
        turn = Rotation.from_rotvec(angle[:, None] * axis / np.linalg.norm(axis))
        turns[joint] = first(turn)
    height = character.measures.hip_height
    root = np.stack([0.3 * np.sin(t), height + 0.05 * np.cos(t), 0.5 * t], axis=1)
    return pose(character, frames, turns, root)


def elsewhere(motion: Motion, degrees: float, shift: Sequence[float] = (0.0, 0.0, 0.0)) -> Motion:
    """The motion turned about the vertical axis, then shifted."""
    turn = Rotation.from_euler("Y", degrees, degrees=True)
    rotations = motion.rotations.copy()
    rotations[:, 0] = first(turn * Rotation.from_quat(rotations[:, 0], scalar_first=True))
    return motion.character.motion(rotations, turn.apply(motion.root) + shift, motion.fps)


def squat(character: Character, frames: int = 60, deepest: float = 60.0) -> Motion:
    """Knee bends with both feet flat and exactly still, the hips straight over the ankles.

    The knee angles follow from the law of sines, so that thigh and shin of any lengths work.
    """
    joint = character.skeleton.index
    thigh, shin = (character.skeleton.bone_lengths[joint(name)] for name in ("LeftLeg", "LeftFoot"))
    ankle = -character.skeleton.offsets[joint("LeftToeBase"), 1]
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, frames))
    thigh_angle = np.radians(deepest) * share
    shin_angle = np.arcsin(thigh / shin * np.sin(thigh_angle))
    turns = {}
    for side in ("Left", "Right"):
        turns[f"{side}UpLeg"] = about("X", -np.degrees(thigh_angle))
        turns[f"{side}Leg"] = about("X", np.degrees(thigh_angle + shin_angle))
        turns[f"{side}Foot"] = about("X", -np.degrees(shin_angle))
    root = np.zeros((frames, 3))
    root[:, 1] = ankle + thigh * np.cos(thigh_angle) + shin * np.cos(shin_angle)
    return pose(character, frames, turns, root)


def carried(method: Any, source: Any, target: Character, **context: Any) -> Any:
    """The method's answer."""
    return method.retarget(source, target, context=Context(**context))


def apart(one: Prediction, other: Prediction) -> float:
    """The largest distance of joints in two motions of a body, in heights."""
    return float(np.linalg.norm(one.positions - other.positions, axis=-1).max() / one.character.height)
