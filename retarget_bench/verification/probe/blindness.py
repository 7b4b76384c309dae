"""Whether an answer depends on its source at all.

Several motions are given to one target. A faithful method keeps who is like whom: distances between its
answers go with the distances between the sources. A method that does not look at its source gives answers
that are all alike, or unlike for reasons of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from retarget_bench.api import Prediction
from retarget_bench.motion.character import Character

FEWEST = 4
"""Motions without which a correlation says nothing."""
_STILL = 1e-9


Bones = Sequence[tuple[str, str]]
"""Roles of the two ends of lines on a body."""


def pose_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of directions ``(frames, bones, 3)``, over the frames that both have: 0 to 2."""
    frames = min(len(a), len(b))
    return float(np.linalg.norm(a[:frames] - b[:frames], axis=-1).mean())


def poses(motion: Prediction, bones: Bones) -> np.ndarray:
    """``(frames, bones, 3)`` unit vectors along the bones, turned so that the hips face one way."""
    joint, places = motion.character.joint_of, motion.positions
    lines = np.stack([places[:, joint[end]] - places[:, joint[start]] for start, end in bones], axis=1)
    lines /= np.maximum(np.linalg.norm(lines, axis=-1, keepdims=True), _STILL)
    yaw = _facing(motion.character, places)
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y, z = (lines[..., axis] for axis in range(3))
    return np.stack([cos * x - sin * z, y, sin * x + cos * z], axis=-1)


def shared_bones(characters: Sequence[Character]) -> Bones:
    """Lines between joints whose roles all bodies have: from each to the next one above it in the first."""
    first = characters[0]
    shared = {role for role in first.joint_of if all(role in each.joint_of for each in characters)}
    bones = []
    for role in sorted(shared):
        above = int(first.skeleton.parents[first.joint_of[role]])
        while above >= 0 and first.roles[above] not in shared:
            above = int(first.skeleton.parents[above])
        if above >= 0:
            bones.append((str(first.roles[above]), role))
    return bones


def _facing(character: Character, places: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians about Y from +Z to where the hips face, by the line between the hip joints."""
    joint = character.joint_of
    if not {"left_up_leg", "right_up_leg"} <= joint.keys():
        return np.zeros(len(places))
    across = places[:, joint["left_up_leg"]] - places[:, joint["right_up_leg"]]
    # forward = across x up = (-across z, 0, across x)
    return np.arctan2(-across[:, 2], across[:, 0])


def dependence(sources: Sequence[Prediction], answers: Sequence[Prediction]) -> dict[str, float]:
    """How answers of one target follow their sources.

    correlation: Pearson's, of the distances between all pairs of sources and those between their answers;
                 0 where either does not vary.
    shuffled:    mean distance between each answer and the answer to the next source, over that between the
                 sources: 0 where shuffling the sources changes nothing, about 1 where it matters in full.

    Distances are of the directions of bones, facing one way: path, size and proportions do not count.
    Left out for fewer than four motions, or without bones in common.
    """
    target = answers[0].character if answers else None
    if target is None or len(answers) < FEWEST:
        return {}
    bones = shared_bones([target, *(each.character for each in sources)])
    if not bones:
        return {}
    ours, theirs = ([poses(each, bones) for each in side] for side in (sources, answers))
    pairs = list(combinations(range(len(ours)), 2))
    before = np.array([pose_distance(ours[i], ours[j]) for i, j in pairs])
    after = np.array([pose_distance(theirs[i], theirs[j]) for i, j in pairs])
    varied = before.std() > _STILL and after.std() > _STILL
    turns = [(i, (i + 1) % len(ours)) for i in range(len(ours))]
    moved = np.mean([pose_distance(theirs[i], theirs[j]) for i, j in turns])
    asked = np.mean([pose_distance(ours[i], ours[j]) for i, j in turns])
    found = {"correlation": float(np.corrcoef(before, after)[0, 1]) if varied else 0.0}
    return found | ({"shuffled": float(moved / asked)} if asked > _STILL else {})
