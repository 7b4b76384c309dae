"""One pose for all rigs: what rotations are measured from when they go from one body to another.

Rigs differ in their rest poses: a T-pose in world axes, an A-pose, every bone along +X, Z up. The
*reference pose* is the same for all of them: a T-pose, Y up, facing +Z, left is +X (four-legged bodies
stand with their spine along +Z). ``reference_pose`` finds the local rotations that bring a rig into it.
An orientation relative to it then means the same on every body (``transfer.py``).

- A limb that rests within the tolerances below of the T-pose is left exactly as the artist made it, so two
  T-pose rigs exchange plain local rotations.
- Another limb of a body that rests in a pose (A-pose, arms down, legs apart) is swung the shortest way.
- A rest pose that no body could take (bones all along one axis) cannot tell how bones are twisted: a sample
  of the body's motion does (``sampled.py``).
- A four-legged body that rests on its legs is left as it is but for the frame of its hips.
"""

from collections.abc import Sequence

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import rotation, sampled
from retarget_bench.motion.body import DOWN, PosedBody
from retarget_bench.motion.roles import SIDES
from retarget_bench.motion.skeleton import Skeleton

LIMB_TOLERANCE = np.radians(15.0)
"""A limb rests in T-pose when the line from its first joint to its last is this near."""
BONE_TOLERANCE = np.radians(25.0)
"""... and each of its bones this near."""


def reference_pose(
    skeleton: Skeleton, roles: Sequence[str | None], sample: np.ndarray | None = None
) -> np.ndarray:
    """``(joints, 4)`` local rotations that bring the rest pose into the common reference pose.

    sample: ``(frames, joints, 4)`` local rotations of any motion of this body in a Y-up world; used only
    where the rest pose cannot tell how bones are twisted.
    A skeleton without hips, legs or anything above them keeps its rest pose.
    Raises SkeletonError when the sample does not fit the skeleton.
    """
    if sample is not None and (sample.ndim != 3 or sample.shape[1:] != (len(skeleton), 4)):
        raise SkeletonError(
            f"a sample of motion must be (frames, {len(skeleton)}, 4) local rotations, got {sample.shape}"
        )
    body = PosedBody(skeleton, roles)
    if body.frame is None:
        return rotation.identity(len(skeleton))
    if not body.rests_in_a_pose:
        at_rest = rotation.identity(1, len(skeleton))
        return sampled.reference_pose(body, at_rest if sample is None or not len(sample) else sample)
    pose = rotation.identity(len(skeleton))
    body.set_global(pose, body.hips, body.frame)
    if not body.quadruped:
        for side in SIDES:
            _straighten(body, pose, f"{side}_up_leg", f"{side}_leg", f"{side}_foot", DOWN)
            _straighten(body, pose, f"{side}_arm", f"{side}_forearm", f"{side}_hand", body.sideways(side))
    return pose


def _straighten(
    body: PosedBody, pose: np.ndarray, top: str, middle: str, end: str, wanted: np.ndarray
) -> None:
    """Swing the two bones of a limb to ``wanted``, unless it rests there already."""
    joints = body.joints(top, middle, end)
    if len(joints) < 3:
        return
    places = body.places(pose)
    a, b, c = (places[joint] for joint in joints)
    whole = _angle(c - a, wanted)
    if whole <= LIMB_TOLERANCE and max(_angle(b - a, wanted), _angle(c - b, wanted)) <= BONE_TOLERANCE:
        return
    body.swing(pose, joints[0], joints[1], wanted)
    body.swing(pose, joints[1], joints[2], wanted)


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    """Radians between two vectors."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
