"""Orientations relative to the common reference pose: ``G * G_ref^-1`` means the same on every body."""

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character, Motion


def relative(motion: Motion) -> np.ndarray:
    """``(frames, joints, 4)`` world orientations relative to the reference pose: G * G_ref^-1."""
    reference = motion.character.reference_globals
    return rotation.multiply(motion.global_rotations, rotation.conjugate(reference)[None])


def from_relative(character: Character, orientations: np.ndarray) -> np.ndarray:
    """``(frames, joints, 4)`` local rotations of a body whose joints are turned by ``orientations`` (same
    shape) from its reference pose: the inverse of ``relative``, signs continuous along time."""
    turned = rotation.multiply(orientations, character.reference_globals[None])
    local = rotation.normalise(kinematics.local_from_global(character.skeleton, turned))
    return rotation.continuous(local)
