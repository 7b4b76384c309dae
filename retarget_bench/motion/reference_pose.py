"""One pose for all rigs: what rotations are measured from when they go from one body to another.

Rigs differ in their rest poses: a T-pose in world axes, an A-pose, every bone along +X, Z up. The
*reference pose* is the same for all of them: a T-pose, Y up, facing +Z, left is +X (four-legged bodies and
birds stand with their spine along +Z). ``reference_pose`` finds the local rotations that bring a rig into
it. An orientation relative to it then means the same on every body (``transfer.py``).

- A limb that rests within the tolerances below of the T-pose is left exactly as the artist made it, so two
  T-pose rigs exchange plain local rotations.
- Another limb of a body that rests in a pose (A-pose, arms down, legs apart) is swung the shortest way.
- A four-legged body that rests on its legs is left as it is but for the frame of its hips; of one with a
  level trunk on two legs, such as a bird, only the wings are spread.
- A rest pose that no body could take (bones all along one axis) does not show how bones are twisted. There
  the frames of the joints differ by whole quarter turns, and a sample of the body's motion shows *which*:
  elbows and knees bend about one axis only, feet lie flat when they stand still, everything else is
  typically near its place. The turn itself is then exact, so that two clips of one rig give the same pose;
  only the slope of the feet is measured. A rig whose bones lie along no axis takes the estimates.
  Without a sample (one frame at rest) bones are swung, and opposite ones turned about the body's own axes.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.body import DOWN, FORWARD, LEFT, UP, PosedBody, frame, quarter_turns, snapped
from retarget_bench.motion.roles import SIDES, ancestors
from retarget_bench.motion.skeleton import Skeleton

LIMB_TOLERANCE = np.radians(15.0)
"""A limb rests in T-pose when the line from its first joint to its last is this near."""
BONE_TOLERANCE = np.radians(25.0)
"""... and each of its bones this near."""
STAND = {
    "shoulder": 45.0,
    "arm": -40.0,
    "forearm": 20.0,
    "hand": 25.0,
    "up_leg": 35.0,
    "leg": -40.0,
    "foot": 5.0,
}
"""Stance of a four-legged body: degrees of each bone from straight down, forward is positive (the means of
a dog that stands and walks)."""

_FLAT_FOOT = np.radians(25.0)
"""Slope of the line from foot to toe where no sample shows it."""
_ENOUGH_BEND = np.sin(np.radians(4.0))
"""A joint that bends less than this on average does not show its axis."""
_CLEAR_BEND = np.sin(np.radians(20.0))
_FIXED = np.radians(5.0)
"""A joint off the body that is typically this near to a whole number of quarter turns is meant so."""
_STRAIGHT = np.cos(np.radians(25.0))
_UPRIGHT = np.cos(np.radians(35.0))
_BEHIND = np.cos(np.radians(60.0))
_NEAR_AXIS = np.cos(np.radians(40.0))


def reference_pose(
    skeleton: Skeleton, roles: Sequence[str | None], sample: np.ndarray | None = None
) -> np.ndarray:
    """``(joints, 4)`` local rotations that bring the rest pose into the common reference pose.

    sample: ``(frames, joints, 4)`` local rotations of any motion of this body in a Y-up world; used only
    where the rest pose does not show how bones are twisted.
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
        return _from_sample(body, at_rest if sample is None or not len(sample) else sample)
    pose = rotation.identity(len(skeleton))
    body.set_global(pose, body.hips, body.frame)
    for side in () if body.quadruped else SIDES:
        if not body.level:
            _straighten(body, pose, f"{side}_up_leg", f"{side}_leg", f"{side}_foot", DOWN)
        _straighten(body, pose, f"{side}_arm", f"{side}_forearm", f"{side}_hand", body.sideways(side))
    return pose


def _straighten(
    body: PosedBody, pose: np.ndarray, top: str, middle: str, end: str, direction: np.ndarray
) -> None:
    """Swing the two bones of a limb to ``direction``, unless it rests there already."""
    joints = body.joints(top, middle, end)
    if len(joints) < 3:
        return
    places = body.places(pose)
    a, b, c = (places[joint] for joint in joints)
    overall = _angle(c - a, direction)
    if (
        overall <= LIMB_TOLERANCE
        and max(_angle(b - a, direction), _angle(c - b, direction)) <= BONE_TOLERANCE
    ):
        return
    body.swing(pose, joints[0], joints[1], direction)
    body.swing(pose, joints[1], joints[2], direction)


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    """Radians between two vectors."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


# --------------------------------------------------------------------------------- from a sample of motion
def _from_sample(body: PosedBody, sample: np.ndarray) -> np.ndarray:
    """``(joints, 4)`` local rotations; sample: ``(frames, joints, 4)`` local rotations, Y-up world."""
    typical = Typical(body, sample)
    pose = rotation.identity(len(body.skeleton))
    body.set_global(pose, body.hips, typical.hips)
    _trunk(body, pose, typical)
    for side in SIDES:
        leg = body.joints(f"{side}_up_leg", f"{side}_leg", f"{side}_foot")
        if len(leg) == 3:
            _limb(body, pose, typical, leg, DOWN, LEFT, [])
        _arm(body, pose, typical, side)
        (_stand if body.quadruped else _foot)(body, pose, typical, side)
    _beside(body, pose, typical)
    return pose


class Typical:
    """The typical motion of a body: its upright frames and its mean rotations in them."""

    def __init__(self, body: PosedBody, sample: np.ndarray) -> None:
        self.body, self.sample = body, sample
        self.places, self.globals = kinematics.forward(body.skeleton, sample, np.zeros((len(sample), 3)))
        self.hips = self._hips()
        self.frames = self._upright()

    def _hips(self) -> np.ndarray:
        """``(4,)`` the hips' turn into the reference pose, by the legs, and by the tail of a level body or
        else by where the trunk typically points."""
        body = self.body
        assert body.frame is not None
        assert body.trunk is not None
        assert body.across is not None
        if body.level and body.tail and (tail := body.line(body.hips, body.tail[0])).any():
            return _exact(body, frame(-tail, body.across, FORWARD, LEFT))
        lines = self.places[:, body.trunk_end] - self.places[:, body.hips]
        typical = rotation.rotate(rotation.conjugate(self.globals[:, body.hips]), lines).mean(axis=0)
        crossed = np.linalg.norm(np.cross(typical, body.across))
        if crossed < 0.3 * np.linalg.norm(body.trunk) * np.linalg.norm(body.across):
            return body.frame  # the trunk has no typical direction
        return _exact(body, frame(typical, body.across, FORWARD if body.level else UP, LEFT))

    def _upright(self) -> np.ndarray:
        """The frames in which the hips stand as in the reference pose; the best tenth if there are few."""
        standing = rotation.multiply(self.globals[:, self.body.hips], rotation.conjugate(self.hips)[None])
        up = rotation.rotate(standing, np.broadcast_to(UP, (len(standing), 3)))[:, 1]
        enough = max(1, len(up) // 10)
        upright = np.flatnonzero(up > _UPRIGHT)
        return upright if len(upright) >= enough else np.argsort(-up, kind="stable")[:enough]

    def local(self, joint: int) -> np.ndarray:
        """``(4,)`` mean local rotation."""
        return mean(self.sample[self.frames, joint])

    @cached_property
    def lowest(self) -> np.ndarray:
        """``(frames,)`` metres: the lowest joint of the feet, the root at the origin."""
        feet = self.body.joints("left_foot", "left_toe", "right_foot", "right_toe")
        return self.places[:, feet, 1].min(axis=1)


def mean(turned: np.ndarray) -> np.ndarray:
    """``(4,)`` the chordal mean of orientations ``(n, 4)``: signs do not matter."""
    return np.asarray(np.linalg.eigh(turned.T @ turned)[1][:, -1])


def _exact(body: PosedBody, turned: np.ndarray) -> np.ndarray:
    """The quarter turn nearest to an estimate in a rig along the axes; elsewhere the estimate."""
    return snapped(turned, np.pi if body.along_axes else np.radians(5.0))


Evidence = tuple[float, np.ndarray]
"""A weight, and ``(4,)`` what a joint's world orientation in the reference pose seems to be."""


def _place(
    body: PosedBody,
    pose: np.ndarray,
    joint: int,
    bone: np.ndarray,
    direction: np.ndarray,
    evidence: list[Evidence],
) -> None:
    """Turn a joint so that ``bone`` points along ``direction``, twisted as the evidence tells."""
    if body.along_axes and float(np.abs(bone).max()) > _NEAR_AXIS:
        along = rotation.rotate(quarter_turns(), np.broadcast_to(bone, (24, 3))) @ direction
        options = quarter_turns()[along > along.max() - 0.05]  # the four twists
        score = sum(weight * np.cos(rotation.angle(options, turned[None])) for weight, turned in evidence)
        body.set_global(pose, joint, options[int(np.argmax(score))])
    else:
        _, turned = max(evidence, key=lambda each: each[0])
        arc = rotation.between(rotation.rotate(turned, bone), direction)
        body.set_global(pose, joint, _exact(body, rotation.multiply(arc, turned)))


def _as_typical(body: PosedBody, pose: np.ndarray, typical: Typical, joint: int) -> np.ndarray:
    """``(4,)`` a joint's world orientation if it is turned from its parent as it typically is."""
    above = body.get_global(pose, int(body.skeleton.parents[joint]))
    return rotation.multiply(above, typical.local(joint))


def _trunk(body: PosedBody, pose: np.ndarray, typical: Typical) -> None:
    """Spine, neck and head along the trunk; a tail that rests behind the body stays as it is."""
    direction = FORWARD if body.level else UP
    line = [*body.spine, *body.neck, *body.joints("head")]
    for joint, after in zip(line, [*line[1:], body.joint.get("head_top")], strict=False):
        bone = body.tip(joint, after)
        observed = _as_typical(body, pose, typical, joint)
        if bone @ bone < 0.5:
            body.set_global(pose, joint, _exact(body, observed))
        else:
            _place(body, pose, joint, bone, direction, [(1.0, observed)])
    for joint in body.tail:
        pose[joint] = _exact(body, typical.local(joint))
    if len(body.tail) > 1:
        behind = rotation.rotate(typical.hips, body.bone(*body.tail[:2])) @ -FORWARD
        if behind > _BEHIND:
            pose[body.tail] = rotation.identity(len(body.tail))


def _arm(body: PosedBody, pose: np.ndarray, typical: Typical, side: str) -> None:
    """Collar bone and arm straight out (fore legs: down), the elbow bending forward."""
    hinge = -LEFT if body.quadruped else UP if side == "right" else DOWN
    direction = body.sideways(side)
    arm = body.joints(f"{side}_arm", f"{side}_forearm", f"{side}_hand")
    collar = body.joints(f"{side}_shoulder")
    evidence: list[Evidence] = []
    if collar and len(arm) == 3:
        bone = body.bone(collar[0], arm[0])
        if body.quadruped:
            pose[collar[0]] = typical.local(collar[0])
            body.swing_bone(pose, collar[0], bone, direction)
            observed = body.get_global(pose, collar[0])
        else:
            observed = _as_typical(body, pose, typical, collar[0])
        _place(body, pose, collar[0], bone, direction, [(1.0, observed)])
        if bone @ body.bone(arm[0], arm[1]) > _STRAIGHT:  # the arm rests in line with the collar bone
            evidence = [(0.5, body.get_global(pose, collar[0]))]
    if len(arm) == 3:
        _limb(body, pose, typical, arm, direction, hinge, evidence)
    for joint in body.joints(f"{side}_hand"):
        if not body.quadruped and not _rests_straight(body, joint, side):
            body.set_global(pose, joint, _exact(body, _as_typical(body, pose, typical, joint)))


def _rests_straight(body: PosedBody, hand: int, side: str) -> bool:
    """True where fingers or tip rest in line with the forearm, in a rig along the axes."""
    if not body.along_axes:
        return False
    finger = next((body.joint[r] for r in (f"{side}_middle_1", f"{side}_index_1") if r in body.joint), None)
    bone = body.tip(hand, finger)
    return not bone.any() or float(bone @ body.bone(body.joint[f"{side}_forearm"], hand)) > _STRAIGHT


def _limb(
    body: PosedBody,
    pose: np.ndarray,
    typical: Typical,
    joints: list[int],
    direction: np.ndarray,
    hinge: np.ndarray,
    evidence: list[Evidence],
) -> None:
    """Set upper and lower limb along ``direction``, the axis that they bend about along ``hinge``.

    evidence: what is known already. A limb that rests straight stays so, twisted as one.
    """
    top, middle, end = joints
    upper, lower = body.bone(top, middle), body.bone(middle, end)
    bent, axis, below = _hinge(typical, top, middle, upper, lower)
    pose[top] = typical.local(top)
    body.swing_bone(pose, top, upper, direction)
    evidence = [*evidence, (0.3, body.get_global(pose, top))]
    if bent > _ENOUGH_BEND:
        evidence.append((min(2.0, bent / _CLEAR_BEND), frame(upper, axis, direction, hinge)))
    _place(body, pose, top, upper, direction, evidence)
    body.swing_bone(pose, top, upper, direction)
    if body.along_axes and upper @ lower > _STRAIGHT:
        pose[middle] = rotation.identity()
    elif bent > _ENOUGH_BEND:
        _place(body, pose, middle, lower, direction, [(1.0, frame(lower, below, direction, hinge))])
    else:
        pose[middle] = typical.local(middle)
    body.swing_bone(pose, middle, lower, direction)


def _hinge(
    typical: Typical, top: int, middle: int, upper: np.ndarray, lower: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Mean sine of the bend between two bones, and its axis in the frame of either joint."""
    bend = rotation.multiply(rotation.conjugate(typical.globals[:, top]), typical.globals[:, middle])
    axis = np.cross(upper, rotation.rotate(bend, np.broadcast_to(lower, (len(bend), 3)))).mean(axis=0)
    back = rotation.rotate(rotation.conjugate(bend), np.broadcast_to(axis, (len(bend), 3)))
    return float(np.linalg.norm(axis)), axis, back.mean(axis=0)


def _foot(body: PosedBody, pose: np.ndarray, typical: Typical, side: str) -> None:
    """Foot and toe as they are when the foot stands still, turned to point forward."""
    joints = body.joints(f"{side}_foot", f"{side}_toe")
    if len(joints) < 2:
        return
    foot, toe = joints
    still = _standing(typical, foot, toe)
    turned = typical.globals[still, foot]
    line = rotation.rotate(turned, np.broadcast_to(body.bone(foot, toe), (len(turned), 3)))
    across = np.hypot(line[:, 0], line[:, 2])
    if np.median(across) < 0.3:  # points along the leg: nothing was learnt from the sample
        body.swing(pose, foot, toe, rotation.rotate(_pitch(_FLAT_FOOT), FORWARD))
    else:
        slope = float(np.median(np.arctan2(-line[:, 1], across)))
        heading = rotation.about(UP, -np.arctan2(line[:, 0], line[:, 2]))
        level = rotation.multiply(_pitch(-slope), mean(rotation.multiply(heading, turned)))
        body.set_global(pose, foot, rotation.multiply(_pitch(slope), _exact(body, level)))
        pose[toe] = mean(typical.sample[still, toe])
    body.set_global(pose, toe, _exact(body, body.get_global(pose, toe)))


def _standing(typical: Typical, foot: int, toe: int) -> np.ndarray:
    """Upright frames in which this foot carries the body and does not turn: of the quarter in which it is
    nearest to the lowest point, the slower half."""
    frames = typical.frames
    if len(frames) < 16:
        return frames
    lift = (typical.places[frames][:, [foot, toe], 1].min(axis=1)) - typical.lowest[frames]
    low = frames[np.argsort(lift, kind="stable")[: len(frames) // 4]]
    after = np.minimum(low + 1, len(typical.globals) - 1)
    speed = rotation.angle(typical.globals[low, foot], typical.globals[after, foot])
    return low[np.argsort(speed, kind="stable")[: len(low) // 2]]


def _stand(body: PosedBody, pose: np.ndarray, typical: Typical, side: str) -> None:
    """Four legs from straight down into the angles of a standing animal, paws too."""
    for part, child in (("hand", None), ("foot", "toe")):
        for joint in body.joints(f"{side}_{part}"):
            pose[joint] = typical.local(joint)
            bone = body.tip(joint, body.joint.get(f"{side}_{child}"))
            body.swing_bone(pose, joint, bone, DOWN)
            body.set_global(pose, joint, _exact(body, body.get_global(pose, joint)))
    straight = {part: body.joint[f"{side}_{part}"] for part in STAND if f"{side}_{part}" in body.joint}
    turned = {part: body.get_global(pose, joint) for part, joint in straight.items()}
    for part, joint in straight.items():
        body.set_global(pose, joint, rotation.multiply(_pitch(-np.radians(STAND[part])), turned[part]))


def _beside(body: PosedBody, pose: np.ndarray, typical: Typical) -> None:
    """Faces, eyes, hair: a rig that rests along one axis may turn them by quarter turns in all motion."""
    skeleton, with_roles = body.skeleton, body.joint.values()
    carry = {above for joint in with_roles for above in ancestors(skeleton, joint, itself=True)}
    for joint in set(range(len(skeleton))) - carry:
        local = typical.local(joint)
        exact = snapped(local, np.pi)
        if rotation.angle(exact, local) < _FIXED:
            pose[joint] = exact


def _pitch(angle: float) -> np.ndarray:
    """``(4,)`` a turn about LEFT: forward goes down, down goes back."""
    return rotation.about(LEFT, angle)
