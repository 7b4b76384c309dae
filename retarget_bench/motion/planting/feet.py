"""Planted feet: one position per stretch in which the source's foot is planted, hips in reach of all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import contact, rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.ease import smooth, smoothstep, spread
from retarget_bench.motion.planting.two_bone import LEG, Limb, Pose, Rig, reach, rig_of

_GAP, _SHORTEST = 2 / 30, 2 / 30
"""Seconds: breaks in a contact that are closed, contacts that are too short to count."""
_ON_FLOOR, _IN_AIR = 0.06, 0.15
"""Body heights above its rest height: up to where a joint belongs to the floor, from where to the body."""
_EVEN = 0.03
"""Body heights by which the places of planted feet may differ in height on one floor."""

_SHARE = 0.5
"""Of what the planted feet ask for together, how much the hips take; knees and hips share it equally."""
_ROUNDS = 8
_NEAR = 1e-4
"""Metres: nearer than this to where every foot is in reach there is no need to go on."""


Pair = tuple[np.ndarray, np.ndarray]
"""Of ankle and toe."""


@dataclass(frozen=True)
class Exchange:
    """A motion on its way from one body to another: the source's, and its copy in progress.

    ratios: ``(3,)`` what the source's path is scaled by (``root_rules.ratios``).
    """

    source: Motion
    source_rig: Rig
    target_rig: Rig
    pose: Pose
    ratios: np.ndarray

    @property
    def four_legged(self) -> bool:
        """True where all four feet of both bodies stand."""
        return self.source_rig.character.four_legged and self.target_rig.character.four_legged


@dataclass(frozen=True)
class Plan:
    """The task of one limb.

    goal: ``(frames, 3)`` where its end goes. orientation: ``(frames, 4)`` of the end in the world.
    firm: ``(frames,)`` bool, the frames in which it is planted and has to be reached.
    """

    goal: np.ndarray
    orientation: np.ndarray
    firm: np.ndarray


def plan(exchange: Exchange, source_limb: Limb, target_limb: Limb) -> Plan:
    """Goals for a foot that hold ankle and toe wherever the source holds them.

    Its height is told by the toe, which touches the floor; an ankle's depends on how the foot is turned.
    """
    fps = exchange.source.fps
    still = planted(exchange.source, source_limb.end)
    orientation = exchange.pose.turned[:, target_limb.end]
    path = walked(exchange, source_limb.end, target_limb.end)
    if target_limb.tip < 0 or source_limb.tip < 0:
        return Plan(path + spread(held(path, still) - path, still, fps), orientation, still)
    sole = exchange.pose.places[:, target_limb.tip] - exchange.pose.places[:, target_limb.end]
    path[:, 1] = walked(exchange, source_limb.tip, target_limb.tip)[:, 1] - sole[:, 1]
    return hold(path, path, sole, orientation, (still, planted(exchange.source, source_limb.tip)), fps)


def hold(
    path: np.ndarray, stand: np.ndarray, sole: np.ndarray, orientation: np.ndarray, rests: Pair, fps: float
) -> Plan:
    """A foot's path with ankle and toe at one place wherever they rest.

    path: ``(frames, 3)`` of the ankle; stand: likewise, from which the places are taken. sole: ``(frames,
    3)`` from ankle to toe. rests: ankle and toe, ``(frames,)`` bool each.

    The foot's direction is corrected first (ankle and toe both at rest: the mean direction), then its
    place, from whichever of the two rests. Both corrections are eased over the other frames.
    """
    at_ankle, at_toe = _held_pair((stand, stand + sole), rests)
    both, firm = rests[0] & rests[1], rests[0] | rests[1]
    turn = rotation.between(sole, np.where(both[:, None], at_toe - at_ankle, sole))
    turn = rotation.from_rotation_vector(spread(rotation.to_rotation_vector(turn), both, fps))
    ankle = np.where(rests[1][:, None], at_toe - rotation.rotate(turn, sole), at_ankle)
    return Plan(path + spread(ankle - path, firm, fps), rotation.multiply(turn, orientation), firm)


def walked(exchange: Exchange, source_joint: int, target_joint: int) -> np.ndarray:
    """``(frames, 3)`` where a foot or hand goes that belongs to the floor, not to the body above it.

    Near the floor it is the source's own path, scaled like the root path, so that what stands still keeps
    standing still; to it comes what the two bodies differ by at rest (narrower hips, thicker soles), turned
    with the hips. Well above the floor (kicks, hanging, lying with raised legs) it is the copied path.
    """
    source, copied = exchange.source, exchange.pose.places[:, target_joint]
    places, rest = source.positions[:, source_joint], exchange.source_rig.rest[source_joint]
    differ = exchange.target_rig.rest[target_joint] - exchange.ratios * rest
    level = rotation.rotate(exchange.source_rig.facing(source), differ * [1.0, 0.0, 1.0])
    scaled = exchange.ratios * places + level * [1.0, 0.0, 1.0] + differ * [0.0, 1.0, 0.0]
    above = np.abs(places[:, 1] - rest[1]) / source.character.height
    air = smoothstep((above - _ON_FLOOR) / (_IN_AIR - _ON_FLOOR))
    return scaled + air[:, None] * (copied - scaled)


def grounded(source: Motion) -> Motion:
    """The source with its feet on the floor, where they always stand as high above or as deep below it.

    Recordings float by the thickness of markers and shoes; steps and boxes are higher or not always there.
    """
    rig, height = rig_of(source.character), source.character.height
    joints = [
        limb.tip if limb.tip >= 0 else limb.end for (_, kind), limb in rig.limbs.items() if kind == "leg"
    ]
    still = contact.planted(source.positions[:, joints], height, source.fps)
    over = (source.positions[:, joints, 1] - rig.rest[joints, 1])[still]
    if not over.size:
        return source
    low, middle, high = np.quantile(over, (0.05, 0.5, 0.95))
    if high - low > _EVEN * height or abs(middle) > _ON_FLOOR * height:
        return source
    return source.character.motion(source.rotations, source.root - [0.0, middle, 0.0], source.fps)


def planted(source: Motion, joint: int) -> np.ndarray:
    """``(frames,)`` bool: the joint is held still, by its speed; specks of a frame or two do not count."""
    labels = contact.planted(source.positions[:, joint, None], source.character.height, source.fps)[:, 0]
    return contact.tidy(labels, round(_GAP * source.fps), round(_SHORTEST * source.fps))


def held(path: np.ndarray, still: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` one place of a path for every stretch in which the joint is planted, else zeros."""
    out = np.zeros_like(path)
    for first, last in contact.runs(still).tolist():
        out[first:last] = path[first:last].mean(axis=0)
    return out


def _held_pair(paths: Pair, planted: Pair) -> Pair:
    """``(frames, 3)`` each: where ankle and toe are held; meaningless where they are not planted.

    Stretches are settled from the longest to the shortest. One that overlaps a settled stretch of the
    other joint stands at the foot's mean direction from it; any other stands at its own mean place.
    """
    sole = paths[1] - paths[0]
    length = np.linalg.norm(sole[0])
    places = (np.zeros_like(sole), np.zeros_like(sole))
    settled = np.zeros((2, len(sole)), dtype=bool)
    stretches = [(first, last, k) for k in (0, 1) for first, last in contact.runs(planted[k]).tolist()]
    for first, last, k in sorted(stretches, key=lambda each: each[0] - each[1]):
        other = places[1 - k]
        shared = first + np.flatnonzero(settled[1 - k, first:last])
        if len(shared):
            shared = shared[(other[shared] == other[shared[0]]).all(axis=1)]
            mean = sole[shared].mean(axis=0)
            mean *= length / max(float(np.linalg.norm(mean)), 1e-9)
            place = other[shared[0]] + (mean if k == 1 else -mean)
        else:
            place = paths[k][first:last].mean(axis=0)
        places[k][first:last] = place
        settled[k, first:last] = True
    return places


# -------------------------------------------------------------------------------------------- the hips
def settle(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by, up or down, so that copied legs stand on the floor.

    Legs of other proportions, or bent at rest, stand higher or lower in the same pose. The hips take what
    the planted feet have in common; the rest is left to the knees.
    """
    firm = np.stack([plan.firm for plan in plans], axis=1)
    lift = np.stack(
        [plan.goal[:, 1] - pose.places[:, limb.end, 1] for limb, plan in zip(limbs, plans, strict=True)],
        axis=1,
    )
    count = firm.sum(axis=1)
    mean = (lift * firm).sum(axis=1) / np.maximum(count, 1)
    offset = np.zeros((len(mean), 3))
    if count.any():
        offset[:, 1:2] = _SHARE * smooth(spread(mean[:, None], count > 0, fps), fps)
    return offset


def give(pose: Pose, limbs: Sequence[Limb], plans: Sequence[Plan], fps: float) -> np.ndarray:
    """``(frames, 3)`` metres to move the body by so that planted feet are in reach; zero where all are.

    Each planted leg allows the hips a ball around its foot. The nearest point of all balls is sought by
    projecting on one after the other; the way there is smoothed in time, and what that leaves is added,
    a few times over.
    """
    offset = np.zeros((len(pose.root), 3))
    legs = []
    for limb, plan in zip(limbs, plans, strict=True):
        hip = pose.places[:, limb.upper]
        copied = np.linalg.norm(pose.places[:, limb.end] - hip, axis=1)  # may stay as straight
        legs.append((plan.goal - hip, np.maximum(LEG[2] * reach(pose, limb), copied), plan.firm))
    for _ in range(_ROUNDS):
        shifted = offset
        for to_goal, length, firm in legs * 2:
            left = to_goal - shifted
            far = np.linalg.norm(left, axis=1)
            short = np.where(firm, np.maximum(far - length, 0.0), 0.0)
            shifted = shifted + (short / np.maximum(far, 1e-9))[:, None] * left
        step = shifted - offset
        if np.abs(step).max() < _NEAR:
            break
        offset = offset + smooth(step, fps)
    return offset
