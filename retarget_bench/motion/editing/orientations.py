"""World orientations of single joints, relative to the reference pose, put into a motion."""

from collections.abc import Mapping

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion


def with_orientations(motion: Motion, turned: Mapping[int, np.ndarray]) -> Motion:
    """The motion with other orientations of some joints, relative to the reference pose as those of
    ``transfer.relative``: joint -> ``(frames, 4)``. Joints below that are not named go with them."""
    if not turned:
        return motion
    body, rotations = motion.character, np.array(motion.rotations)
    world = np.array(motion.global_rotations)
    for joint, parent in enumerate(body.skeleton.parents.tolist()):
        above = world[:, parent] if parent >= 0 else rotation.identity(1)
        if joint in turned:
            world[:, joint] = rotation.multiply(turned[joint], body.reference_globals[joint][None])
            rotations[:, joint] = rotation.multiply(rotation.conjugate(above), world[:, joint])
        else:
            world[:, joint] = rotation.multiply(above, rotations[:, joint])
    return body.motion(rotation.continuous(rotation.normalise(rotations)), motion.root, motion.fps)
