"""The reference pose of a rig whose rest pose tells little, from a sample of its motion.

Trunk: the typical rotation of every spine joint, taken as whole quarter turns where it is near to them.
Elbows and knees: the axis that they bend about tells how upper and lower limb are twisted. Feet: they lie
flat when they stand still. Hands and toes: their typical rotation.
"""

from __future__ import annotations

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body import DOWN, LEFT, UP, Body, snapped
from retarget_bench.motion.roles import SIDES

_ENOUGH_BEND = np.sin(np.radians(4.0))
"""A joint that bends less than this on average does not show its axis."""


def reference_pose(body: Body, sample: np.ndarray) -> np.ndarray:
    """``(joints, 4)`` local rotations; sample: ``(frames, joints, 4)`` local rotations, Y-up world."""
    typical = Typical(body, sample)
    pose = rotation.identity(len(body.skeleton))
    body.set_global(pose, body.hips, typical.hips)
    for joint in [*body.spine, *body.neck, *body.joints("head")]:
        pose[joint] = snapped(typical.local(joint), np.radians(40.0))
    for side in SIDES:
        _limb(body, pose, typical, [f"{side}_{part}" for part in ("up_leg", "leg", "foot")], DOWN, LEFT)
        _foot(body, pose, typical, side)
        _shoulder(body, pose, typical, side)
        hinge = -LEFT if body.quadruped else UP if side == "right" else DOWN
        parts = [f"{side}_{part}" for part in ("arm", "forearm", "hand")]
        _limb(body, pose, typical, parts, body.sideways(side), hinge)
        for joint in body.joints(f"{side}_hand"):
            pose[joint] = typical.local(joint)
            body.set_global(pose, joint, snapped(body.get_global(pose, joint)))
    return pose


class Typical:
    """What a body does most of the time: its upright frames and its mean rotations in them."""

    def __init__(self, body: Body, sample: np.ndarray) -> None:
        self.body, self.sample = body, sample
        _, self.globals = kinematics.forward(body.skeleton, sample, np.zeros((len(sample), 3)))
        assert body.frame is not None
        self.hips = body.frame
        self.frames = self._upright()

    def _upright(self) -> np.ndarray:
        """The frames in which the hips stand as in the reference pose; the best tenth if there are few."""
        standing = rotation.multiply(self.globals[:, self.body.hips], rotation.conjugate(self.hips))
        lean = np.arccos(
            np.clip(rotation.rotate(standing, np.broadcast_to(UP, (len(standing), 3)))[:, 1], -1, 1)
        )
        enough = max(1, len(lean) // 10)
        upright = np.flatnonzero(lean < np.radians(35.0))
        return upright if len(upright) >= enough else np.argsort(lean, kind="stable")[:enough]

    def local(self, joint: int) -> np.ndarray:
        """``(4,)`` mean local rotation."""
        return mean(self.sample[self.frames, joint])


def mean(turned: np.ndarray) -> np.ndarray:
    """``(4,)`` the chordal mean of orientations ``(n, 4)``: signs do not matter."""
    return np.linalg.eigh(turned.T @ turned)[1][:, -1]


def _limb(
    body: Body, pose: np.ndarray, typical: Typical, parts: list[str], wanted: np.ndarray, hinge: np.ndarray
) -> None:
    """Set upper and lower limb along ``wanted``, their common hinge axis along ``hinge``."""
    joints = body.joints(*parts)
    if len(joints) < 3:
        return
    top, middle, end = joints
    upper, lower = body.bone(top, middle), body.bone(middle, end)
    bend = _relative(typical, top, middle)
    axes = np.cross(upper, rotation.rotate(bend, np.broadcast_to(lower, (len(bend), 3))))
    axis = axes.mean(axis=0)
    if np.linalg.norm(axis) > _ENOUGH_BEND:
        below = rotation.rotate(rotation.conjugate(bend), np.broadcast_to(axis, (len(bend), 3))).mean(
            axis=0
        )
        body.set_global(pose, top, snapped(frame_to(upper, axis, wanted, hinge)))
        body.set_global(pose, middle, snapped(frame_to(lower, below, wanted, hinge)))
    else:
        for joint in (top, middle):
            pose[joint] = typical.local(joint)
        body.swing(pose, top, middle, wanted)
        body.swing(pose, middle, end, wanted)


def _relative(typical: Typical, top: int, below: int) -> np.ndarray:
    """``(frames, 4)`` orientation of a joint in the frame of one above it."""
    return rotation.multiply(rotation.conjugate(typical.globals[:, top]), typical.globals[:, below])


def frame_to(bone: np.ndarray, axis: np.ndarray, wanted: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """``(4,)`` the turn that brings ``bone`` onto ``wanted`` exactly and ``axis`` as near to ``hinge`` as
    that allows."""

    def basis(along: np.ndarray, across: np.ndarray) -> np.ndarray:
        first = along / np.linalg.norm(along)
        second = across - (across @ first) * first
        second = second / np.linalg.norm(second)
        return np.stack([first, second, np.cross(first, second)], axis=1)

    return rotation.from_matrix(basis(wanted, hinge) @ basis(bone, axis).T)


def _foot(body: Body, pose: np.ndarray, typical: Typical, side: str) -> None:
    """Foot and toe as they are when the foot stands still, turned to point forward."""
    joints = body.joints(f"{side}_foot", f"{side}_toe")
    if len(joints) < 2:
        for joint in joints:
            pose[joint] = typical.local(joint)
        return
    foot, toe = joints
    turned = typical.globals[typical.frames, foot]
    line = rotation.rotate(turned, np.broadcast_to(body.bone(foot, toe), (len(turned), 3)))
    still = _still(turned)
    heading = rotation.about(UP, -np.arctan2(line[still, 0], line[still, 2]))
    body.set_global(pose, foot, mean(rotation.multiply(heading, turned[still])))
    pose[toe] = mean(typical.sample[typical.frames, toe][still])
    body.set_global(pose, toe, snapped(body.get_global(pose, toe)))


def _still(turned: np.ndarray) -> np.ndarray:
    """The quarter of the frames in which an orientation ``(frames, 4)`` changes least."""
    if len(turned) < 8:
        return np.arange(len(turned))
    speed = rotation.angle(turned[:-1], turned[1:])
    return np.argsort(np.append(speed, speed[-1]), kind="stable")[: len(turned) // 4]


def _shoulder(body: Body, pose: np.ndarray, typical: Typical, side: str) -> None:
    """The collar bone as it typically is; quarter turns where it is near to them."""
    joints = body.joints(f"{side}_shoulder", f"{side}_arm")
    if len(joints) < 2:
        return
    shoulder, arm = joints
    pose[shoulder] = typical.local(shoulder)
    body.set_global(pose, shoulder, snapped(body.get_global(pose, shoulder)))
