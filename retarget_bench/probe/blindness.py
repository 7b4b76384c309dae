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


def pose_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Mean distance of joints in heights, over the frames that both have; ``(frames, joints, 3)`` each."""
    frames = min(len(a), len(b))
    return float(np.linalg.norm(a[:frames] - b[:frames], axis=-1).mean())


def poses(motion: Prediction, joints: Sequence[int]) -> np.ndarray:
    """``(frames, joints, 3)`` in heights: relative to the hips and turned to face one way."""
    character = motion.character
    places = motion.positions
    centred = (places - places[:, [character.joint_of.get("hips", 0)]]) / character.height
    yaw = _facing(character, places)
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    x, y, z = (centred[:, list(joints), axis] for axis in range(3))
    return np.stack([cos * x - sin * z, y, sin * x + cos * z], axis=-1)


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

    Distances are of poses (hips in one place, facing one way, in heights), so path and size do not count.
    Left out for fewer than four motions, or without joints in common.
    """
    target = answers[0].character if answers else None
    if target is None or len(answers) < FEWEST:
        return {}
    shared = [r for r in target.joint_of if all(r in each.character.joint_of for each in sources)]
    if not shared:
        return {}
    ours = [poses(each, each.character.joints(shared)) for each in sources]
    theirs = [poses(each, target.joints(shared)) for each in answers]
    pairs = list(combinations(range(len(ours)), 2))
    before = np.array([pose_distance(ours[i], ours[j]) for i, j in pairs])
    after = np.array([pose_distance(theirs[i], theirs[j]) for i, j in pairs])
    varied = before.std() > _STILL and after.std() > _STILL
    turns = [(i, (i + 1) % len(ours)) for i in range(len(ours))]
    moved = np.mean([pose_distance(theirs[i], theirs[j]) for i, j in turns])
    asked = np.mean([pose_distance(ours[i], ours[j]) for i, j in turns])
    found = {"correlation": float(np.corrcoef(before, after)[0, 1]) if varied else 0.0}
    return found | ({"shuffled": float(moved / asked)} if asked > _STILL else {})
