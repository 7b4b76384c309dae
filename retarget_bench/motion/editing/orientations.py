"""World orientations of joints relative to the reference pose, read from motions and put into them."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion


def orientation(motion: Motion, joint: int) -> np.ndarray:
    """``(frames, 4)`` one of ``transfer.relative``."""
    reference = motion.character.reference_globals[joint]
    return rotation.multiply(motion.global_rotations[:, joint], rotation.conjugate(reference)[None])


def with_orientations(motion: Motion, turned: Mapping[int, np.ndarray]) -> Motion:
    """The motion with other orientations of some joints: joint -> ``(frames, 4)``, as ``orientation`` gives
    them. Joints below that are not named go with them."""
    if not turned:
        return motion
    body, rotations = motion.character, np.array(motion.rotations)
    world: dict[int, np.ndarray] = {}
    for joint, parent in enumerate(body.skeleton.parents.tolist()):
        above = (
            world.get(parent, motion.global_rotations[:, parent]) if parent >= 0 else rotation.identity(1)
        )
        if joint in turned:
            world[joint] = rotation.multiply(turned[joint], body.reference_globals[joint][None])
            local = rotation.normalise(rotation.multiply(rotation.conjugate(above), world[joint]))
            rotations[:, joint] = rotation.continuous(local)
        elif parent in world:
            world[joint] = rotation.multiply(above, rotations[:, joint])
    return body.motion(rotations, motion.root, motion.fps)
