"""Joint speed excess: how much faster joints turn, and how much more abruptly, than the source's ever do.

A limb that snaps for one frame moves no mean: the mean jerk of all joints over all frames hides it.
"""

from collections.abc import Mapping
from functools import lru_cache, partial
from itertools import compress

import numpy as np

from retarget_bench.api import Metric, MetricCard, Value
from retarget_bench.api.comparison import Comparison, scored_joints
from retarget_bench.motion import rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import ancestors, chain, is_tip

SLOW = 60.0
"""Degrees per second, two degrees a frame at 30 frames per second: a joint may turn that fast whatever the
source does. Of the puppets' right answers, 1.9 % of the joints exceed the source's greatest speed by half
with 10 degrees per second, 0.9 % with 60, and 0.8 % with 90 (``benchmarks/metric_thresholds.py``)."""

SUDDEN = 30.0 * SLOW
"""Degrees per squared second: from rest to ``SLOW`` within a thirtieth of a second."""

FAR = 1.5
"""The ratio from which a frame or a clip counts."""

TOES = ("left_toe", "right_toe")
"""Recorded motions flip them at thousands of degrees per second, invisibly."""

ORDERS = {
    "speed": (
        "angular speed",
        "w(t) * fps with w(t) the rotation vector of R(t)^-1 R(t+1)",
        f"{SLOW:g} degrees/s",
        2,
    ),
    "acceleration": (
        "angular acceleration",
        "(w(t+1) - w(t)) * fps^2 with w(t) the rotation vector of R(t)^-1 R(t+1)",
        f"{SUDDEN:g} degrees/s^2",
        3,
    ),
}
JOINTS = (
    "R: a joint's orientation relative to that of the nearest of these joints above it, the first one's in "
    "the world; joints: those of mpjpe_h.world with an anatomical role that the source has, tips left out; "
    "of a spine, neck or tail that has another number of joints there, the last joint; toes are left out, "
    f"and joints that exceed {FAR:g} in the reference itself"
)


def _values(order: str) -> tuple[Value, ...]:
    """The values of angular speeds or accelerations."""
    name, what, least, frames = ORDERS[order]
    ratio = (
        f"E(joint) = max(1, greatest |a| of the joint / greatest |b| of its counterpart in the source, at "
        f"least {least}), a and b: {what}; {JOINTS}; left out unless both motions are known by rotations, "
        f"and for clips of fewer than {frames} frames"
    )
    id_, label = f"joint_{order}_excess", f"joint {order} excess"
    value = partial(Value, needs=("source", "rotations"), source=SOURCE, tolerance=1e-3)
    excess = partial(value, better="lower", doubt=f"{id_}.reference")
    return (
        excess(
            id_,
            label,
            f"greatest {name} over the source's, worst joint; a right answer has the reference's",
            "1",
            formula=f"largest E(joint) of a case; 1: no excess; in tables the mean over clips; {ratio}",
        ),
        excess(
            f"{id_}.clips",
            f"{label}, clips",
            f"share of clips in which a joint's {name} exceeds {FAR:g} times the source's greatest",
            "% of clips",
            formula=f"100 where the largest E(joint) of a case is above {FAR:g}, else 0; {ratio}",
        ),
        excess(
            f"{id_}.frames",
            f"{label}, frames",
            f"share of frames in which a joint's {name} exceeds {FAR:g} times the source's greatest",
            "% of frames",
            formula=f"100 * share of the frames t with |a(t)| of any joint above {FAR:g} times its "
            f"counterpart's greatest |b|, at least {least}; {ratio}",
        ),
        value(
            f"{id_}.reference",
            f"{label}, references",
            f"share of clips in which the reference's own {name} exceeds {FAR:g} times the source's",
            "% of clips",
            better="none",
            formula=f"100 where the E of any joint of the reference is above {FAR:g}, else 0; {ratio}",
        ),
        excess(
            f"{id_}.joint",
            f"{label} by joint",
            f"greatest {name} of each joint over the source joint's greatest; 1: no excess",
            "1",
            formula=f"E(joint); {ratio}",
            index="joint",
        ),
    )


SOURCE = "this project; retargeting for robots checks joints for velocity limits and jumps in this way"


class JointSpeed(Metric):
    """Greatest angular speeds and accelerations of joints against those of the source's joints.

    To turn less than the source is no fault here: a motion that stands still has 1, as has one without
    any excess. Read it beside the position errors. Another body may have to turn faster than the source's:
    the reference's own number is what a right answer needs, and a number below that is not better.
    """

    card = MetricCard(
        name="joint_speed",
        summary="angular speed and acceleration of joints in excess of the source's",
        version="2",
        values=(*_values("speed"), *_values("acceleration")),
    )

    def compute(self, comparison: Comparison) -> Mapping[str, float | Mapping[str, float]]:
        """Left out unless both are known by rotations, for short clips, and without joints in common."""
        source, prediction, target = comparison.case.source, comparison.prediction, comparison.target
        if not isinstance(source, Motion) or not isinstance(prediction, Motion):
            return {}
        joints, parents, source_joints, their_parents = _pairs(source.character, target)
        if not len(joints):
            return {}
        reference, right = comparison.case.reference, None
        if isinstance(reference, Motion):
            right = velocities(reference, joints, parents)
        own, other = (
            velocities(prediction, joints, parents),
            velocities(source, source_joints, their_parents),
        )
        names = [target.skeleton.names[joint] for joint in joints]
        values = _excess("joint_speed_excess", names, own, other, right, SLOW)
        own, other = (np.diff(each, axis=0) * comparison.fps for each in (own, other))
        right = None if right is None else np.diff(right, axis=0) * comparison.fps
        return values | _excess("joint_acceleration_excess", names, own, other, right, SUDDEN)


def _excess(
    id_: str, names: list[str], own: np.ndarray, other: np.ndarray, right: np.ndarray | None, least: float
) -> dict[str, float | Mapping[str, float]]:
    """The values of vectors ``(frames, joints, 3)`` of the prediction, the source and, if any, the
    reference; empty without frames."""
    if not len(own):
        return {}
    limit = np.maximum(np.linalg.norm(other, axis=-1).max(axis=0), least)
    values: dict[str, float | Mapping[str, float]] = {}
    kept = np.ones(len(names), dtype=bool)
    if right is not None:
        kept = np.linalg.norm(right, axis=-1).max(axis=0) <= FAR * limit
        values[f"{id_}.reference"] = 100.0 * (not kept.all())
    if not kept.any():
        return values
    names = list(compress(names, kept))
    ratio = np.linalg.norm(own[:, kept], axis=-1) / limit[kept]
    by_joint = np.maximum(ratio.max(axis=0), 1.0)
    worst = float(by_joint.max())
    return values | {
        id_: worst,
        f"{id_}.clips": 100.0 * (worst > FAR),
        f"{id_}.frames": 100.0 * float((ratio > FAR).any(axis=1).mean()),
        f"{id_}.joint": dict(zip(names, by_joint.tolist(), strict=True)),
    }


def velocities(motion: Motion, joints: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """``(frames - 1, joints, 3)`` degrees per second: angular velocities in the joints' own frames.

    parents: ``(joints,)`` what each joint turns relative to; -1 is the world. The reference pose, and with
    it the rest pose, cancels: it turns these vectors, and they are only measured and subtracted.
    """
    orientations = motion.global_rotations
    turned, held = orientations[:, joints], parents >= 0
    above = rotation.conjugate(orientations[:, parents[held]])
    turned[:, held] = rotation.multiply(above, turned[:, held])
    steps = rotation.multiply(rotation.conjugate(turned[:-1]), turned[1:])
    return np.degrees(rotation.to_rotation_vector(steps)) * motion.fps


@lru_cache(maxsize=1024)
def _pairs(source: Character, target: Character) -> tuple[np.ndarray, ...]:
    """Joints of the target, the ones above them, and the counterparts of both in the source; -1: none."""
    counterparts, roles = transfer.correspondence(source, target).tolist(), target.roles
    inner: set[int] = set()
    for stem in transfer.CHAINS:
        target_chain = chain(roles, stem)
        # two bodies share a turn out among different counts as they like; the whole chain's is one turn
        inner.update(target_chain[:-1] if len(target_chain) != len(chain(source.roles, stem)) else ())
    joints = [
        joint
        for joint in scored_joints(source, target).tolist()
        if counterparts[joint] >= 0 and (role := roles[joint]) and joint not in inner
        if not is_tip(role) and role not in TOES
    ]
    above = [next((a for a in ancestors(target.skeleton, j) if a in joints), -1) for j in joints]
    both = (joints, above)
    source_sides = ([counterparts[j] if j >= 0 else -1 for j in side] for side in both)
    return tuple(np.array(side, dtype=int) for side in (*both, *source_sides))


plugin = JointSpeed
