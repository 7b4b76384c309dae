"""Bodies of other shapes, and limbs held otherwise, than training has: not in the paper.

A motion carried to bones of other lengths, or that slant otherwise from the joints that turn them, is what
two bodies with one code have in common. A limb turned as a whole goes where nobody of the training data
puts it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.roles import SIDES

from .features import HumotBody

REGION, BONE = 0.2, 0.15
"""Deviations of the logarithm of lengths: of all bones of the arms, legs or trunk, and of each pair."""
LIMITS = (0.5, 2.0)
OWN = 0.5
"""How often a body keeps its proportions."""
SWUNG = 0.25
"""How often a limb is turned."""
SLANT = 0.25
"""Radians: the largest deviation, of a body, of the turns of its bones; those to toes, shoulders and upper
arms turn by twice as much. On real rigs bones of legs are 5 to 10 degrees on average from where generated
bodies have them, these 16 to 27."""
LOOSE = ("toe", "shoulder", "arm")
FARTHEST = 0.9
"""Radians: no bone turns farther."""
ARMS = 1
REACH = {"arm": np.radians(120.0), "up_leg": np.radians(40.0)}
"""Radians: how far, at most, by the role of the limb's first joint."""


@dataclass(frozen=True, eq=False)
class Build:
    """Tree and sizes of a body.

    chains:  ``(joints, joints)``: 1 where the second joint is the first or above it, but for the hips.
    pairs:   ``(joints,)`` which bones, told by the joint they lead to, are of one length: both sides'.
    regions: ``(joints,)`` 0 trunk, 1 (``ARMS``) arms, 2 legs.
    limbs:   of each, its first joint, ``(joints,)`` bool those below it, and how far it is turned.
    """

    chains: np.ndarray
    pairs: np.ndarray
    regions: np.ndarray
    limbs: tuple[tuple[int, np.ndarray, float], ...]


@lru_cache(maxsize=1024)
def build(body: HumotBody) -> Build:
    count = len(body.joints)
    chains = np.eye(count)
    for joint, parent in enumerate(body.parents):
        if parent >= 0:
            chains[joint] += chains[parent]
    chains[:, 0] = 0.0
    roles = [body.character.roles[joint] for joint in body.joints]
    kinds = [_sideless(role) if role else "" for role in roles]
    for joint, parent in reversed(list(enumerate(body.parents))):
        if not roles[parent] and parent >= 0:  # told by the joint that it leads to, as on the other side
            kinds[parent] = f"above {kinds[joint]}"
    pairs = np.unique(kinds, return_inverse=True)[1]
    regions = np.zeros(count, dtype=np.int64)
    limbs = []
    for joint, kind in enumerate(kinds):
        if joint and kind in REACH:
            below = (chains[:, joint] > 0) & (np.arange(count) != joint)
            regions[below] = 1 + list(REACH).index(kind)
            limbs.append((joint, below, REACH[kind]))
    return Build(chains, pairs, regions, tuple(limbs))


def _sideless(role: str) -> str:
    side, _, part = role.partition("_")
    return part if side in SIDES else role


def proportions(numbers: np.random.Generator, body: HumotBody) -> np.ndarray:
    """``(joints,)`` what the bone to each joint is longer by; both sides alike, half of the time 1."""
    groups = build(body)
    if numbers.random() < OWN:
        return np.ones(len(body.joints))
    regions = REGION * numbers.standard_normal(3)[groups.regions]
    bones = BONE * numbers.standard_normal(len(body.joints))[groups.pairs]
    return np.asarray(np.exp(regions + bones).clip(*LIMITS))


def reproportion(positions: np.ndarray, factors: np.ndarray, body: HumotBody) -> np.ndarray:
    """``(..., joints, 3)``: bones longer by factors, in the directions that they had, about the hips."""
    bones = positions - positions[..., list(body.parents), :]
    return np.asarray(positions[..., :1, :] + build(body).chains @ (factors[:, None] * bones))


def slants(numbers: np.random.Generator, body: HumotBody) -> np.ndarray:
    """``(joints, 3)`` metres: what is added to the bone to each joint of the template, which turns it; both
    sides are mirror images, half of the time all are zero. Joints without a role keep theirs, and so do
    arms, which hang straight down in every template."""
    groups, bones = build(body), body.template - body.template[list(body.parents)]
    if numbers.random() < OWN:
        return np.zeros_like(bones)
    size = SLANT * numbers.random()
    vectors = size * numbers.standard_normal((len(bones), 3))[groups.pairs]
    for joint, number in enumerate(body.joints):
        role = body.character.roles[number]
        kind = _sideless(role) if role else ""
        if joint == 0 or not kind or groups.regions[joint] == ARMS:
            vectors[joint] = 0.0
        if kind in LOOSE:
            vectors[joint] *= 2.0
        if kind == role:  # in the plane that both sides mirror
            vectors[joint, 1:] = 0.0
        elif role and role.startswith("right"):
            vectors[joint, 1:] *= -1.0
    far = np.linalg.norm(vectors, axis=1, keepdims=True) / FARTHEST
    turns = rotation.from_rotation_vector(vectors / far.clip(min=1.0))
    return rotation.rotate(turns, bones) - bones


def slanted(positions: np.ndarray, turns: np.ndarray, added: np.ndarray, body: HumotBody) -> np.ndarray:
    """``(frames, joints, 3)``: the same rotations of a body with ``slants``, about the hips.

    turns: ``(frames, joints, 4)`` how what each bone hangs from is turned from the template.
    """
    moved = rotation.rotate(turns, np.broadcast_to(added, positions.shape))
    return np.asarray(positions + build(body).chains @ moved)


def rotate_limbs(
    numbers: np.random.Generator, positions: np.ndarray, turns: np.ndarray, body: HumotBody
) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, joints, 3)`` and turns (see ``slanted``): some limbs turned as a whole about where they
    begin, all frames alike."""
    moved, turned = positions.copy(), turns.copy()
    for joint, below, reach in build(body).limbs:
        if numbers.random() < SWUNG:
            axis = numbers.standard_normal(3)
            turn = rotation.about(axis / np.linalg.norm(axis), reach * numbers.random())
            start = moved[:, joint : joint + 1]
            moved[:, below] = start + rotation.rotate(turn, moved[:, below] - start)
            turned[:, below] = rotation.multiply(turn, turned[:, below])
    return moved, turned
