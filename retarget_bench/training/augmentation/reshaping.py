"""Bodies of other shapes made of a body: bones that slant otherwise and have other lengths.

Generated bodies rest alike: straight legs, flat feet, feet and hands of a share of the height. On rigs that
people make thighs slant, shoulders droop, and feet and hands differ, which copied rotations keep.
"""

from dataclasses import replace

import numpy as np

from retarget_bench.files import digest
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.measures import measure
from retarget_bench.motion.roles import SIDES, is_tip
from retarget_bench.training.augmentation.body import AugmentedBody

NAME = "{} reshaped"
LEVEL, LOOSE = ("forearm", "hand"), ("shoulder", "arm", "toe", "neck", "head")
"""Bones to these joints lie along x in every reference pose; bones to those slant by twice as much."""
LENGTH, FARTHEST = 0.15, 3.0
"""Deviation of the logarithm of a bone's length; deviations that no number exceeds."""


def reshaped(body: Character, slant: float) -> Character | None:
    """Another body of the same structure, always the same; None of one that does not stand on two legs.

    slant: degrees, the deviation about each axis by which bones turn in the reference pose. Both sides
    are mirror images; bones to joints without a role, and to tips, stay.
    """
    if body.four_legged or not body.measures.hip_height > 0:
        return None
    numbers = np.random.default_rng(int(digest(body.name, 16), 16))
    seen = AugmentedBody(body)
    bones = seen.offsets.copy()
    drawn: dict[str, np.ndarray] = {}
    for joint, role in enumerate(body.roles):
        if joint == 0 or role is None or is_tip(role):
            continue
        side, _, part = role.partition("_")
        kind = part if side in SIDES else role
        changes = drawn.setdefault(kind, numbers.standard_normal(4).clip(-FARTHEST, FARTHEST))
        vector = np.radians(slant) * (1.0 + (kind in LOOSE)) * (kind not in LEVEL) * changes[:3]
        if kind == role:
            vector[1:] = 0.0  # in the plane that both sides mirror
        elif side == SIDES[1]:
            vector[1:] *= -1.0
        turn = rotation.from_rotation_vector(vector)
        bones[joint] = np.exp(LENGTH * changes[3]) * rotation.rotate(turn, bones[joint])
    offsets = rotation.rotate(rotation.conjugate(seen.above), bones)
    offsets[0] = body.skeleton.offsets[0]
    skeleton = replace(body.skeleton, offsets=offsets)
    measures = measure(skeleton, body.roles, body.reference_pose)
    name = NAME.format(body.name)
    other = replace(body, name=name, skeleton=skeleton, measures=measures, skin=None, whole=None)
    return other if measures.hip_height > 0 else None


def carried(motion: Motion, body: Character) -> Motion:
    """A motion on its own body's ``reshaped`` one: the same rotations, and in every frame the lowest joint
    as high above the floor, in heights of the hips."""
    ratio = body.measures.hip_height / motion.character.measures.hip_height
    other = transfer.carry(motion, body, "hip_height")
    lift = ratio * motion.positions[..., 1].min(axis=1) - other.positions[..., 1].min(axis=1)
    root = other.root + lift[:, None] * np.array([0.0, 1.0, 0.0])
    return body.motion(other.rotations, root, motion.fps)
