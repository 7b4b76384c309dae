"""Heads and hands that are kept above the floor, on bodies that a motion was not made for.

A person's stoop pushes the head of a dog into the ground, and a dog's gait the hands of a person: the back
is raised and the arms are bent (``above``). Who has a larger head or longer arms than the source goes
deeper into the floor in a roll or on all fours: the whole body is raised (``no_deeper``). Nothing is moved
that is clear of the floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from retarget_bench.motion import ground, rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.contact import CONTACT_ROLES, planted
from retarget_bench.motion.planting.ease import FADE, smooth
from retarget_bench.motion.planting.two_bone import ARM, LEG, Limb, Pose, bend, ease_reach, rig_of
from retarget_bench.motion.roles import HANDS, SIDES, ancestors, chain

_ROUNDS, _SMOOTH = 6, 2
"""How often corrections are made at most, and how many of the first ones are smoothed in time."""
_NEAR = 1e-4
"""Metres that make no difference."""
_LOWER = 0.05
"""Share of the heights of standing feet that are below the floor."""
_ELSEWHERE = 0.06
"""Body heights below y = 0 from where feet stand on another floor."""
_DEEP = 0.01
"""Of the height: how much deeper than in its source a head or hand may go; verdicts tell of the double."""


def above(answer: Motion, source: Prediction) -> Motion:
    """The answer with its head and hands, to the tips, at y = 0 or higher, or above the floor that its feet
    are on while those of its source are on another one below.

    The greatest correction that is needed within a third of a second is taken, smoothed; what that leaves
    below the floor is mended frame by frame.
    """
    body, (own, floor) = answer.character, _floors(replace(source), replace(answer))
    floor = np.where(own < -_ELSEWHERE * source.character.height, np.minimum(floor, 0.0), 0.0)
    answer = _raised(answer, _back(body), below(body, "head"), floor)
    for side in SIDES:
        joints, limb = below(body, f"{side}_hand"), rig_of(body).limbs.get((side, "arm"))
        if limb is not None:
            answer = _raised(_lifted(answer, limb, joints, floor), limb.upper, joints, floor)
    return answer


def no_deeper(answer: Motion, source: Prediction) -> Motion:
    """The answer with its head and hands, in every frame, no deeper below the floor that its feet stand on
    than those of its source are below theirs, in shares of the bodies' heights, and ``_DEEP``. One that
    keeps to this is returned as it is.

    For the head the body is raised, where a foot stands no farther than its leg reaches. For hands the body
    is raised while no foot stands, and else the arms are bent.
    """
    if not answer.frames:
        return answer
    copy, source = replace(answer), replace(source)  # copies, so that their places are let go
    allowed = _allowed(source, answer.character, _floors(source, copy))
    raised = _no_deeper(copy, allowed)
    return answer if raised is copy else raised


def _no_deeper(answer: Motion, allowed: Mapping[str, np.ndarray]) -> Motion:
    body = answer.character
    hands = [
        (limb, _ends(body, f"{side}_hand"), allowed[f"{side}_hand"])
        for (side, kind), limb in rig_of(body).limbs.items()
        if kind == "arm"
    ]
    head = _ends(body, "head"), allowed["head"]
    standing = [_stands(answer, limb) for (_, kind), limb in rig_of(body).limbs.items() if kind == "leg"]
    free = 1.0 - np.max(standing, axis=0, initial=0.0)
    lifts = [_needed(answer, *head), *(free * _needed(answer, ends, lowest) for _, ends, lowest in hands)]
    if (lift := np.max(lifts, axis=0)).any():
        answer = _carried(answer, _eased(lift, answer.fps))
    for limb, ends, lowest in hands:
        answer = _lifted(answer, limb, ends, lowest)
    return answer


def _floors(source: Prediction, answer: Motion) -> tuple[np.ndarray, np.ndarray]:
    """``(frames,)`` metres each: the floor that the feet of the source and of its answer stand on, the
    lowest of steps, or that those of the source come down to; 0 where none stands."""
    (level, soles), (own_level, own_soles) = _lowest(source), _lowest(answer)
    elsewhere = ground.lower(level, soles, source.character.height)
    return ground.shown(level, soles, elsewhere), ground.shown(own_level, own_soles, elsewhere)


def _lowest(motion: Prediction) -> tuple[float, np.ndarray]:
    """Metres: the lowest floor that the feet of a motion stand on, 0 where none stands; and ``(frames,)``
    the height of the lower one."""
    body = motion.character
    joints = body.joints(CONTACT_ROLES)
    places = motion.positions[:, joints]
    over = places[..., 1] - body.standing_places[joints, 1]
    stood = over[planted(places, body.height, motion.fps)]
    level = float(np.quantile(stood, _LOWER)) if stood.size else 0.0
    return level, over.min(axis=1, initial=np.inf)


def _allowed(source: Prediction, body: Character, floors: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Head and hands -> ``(frames,)`` metres: the height below which a body's joint, and its ends, are too
    deep. floors: of the source and of its answer."""
    heights = {}
    for role in ("head", *HANDS):
        depth = np.zeros(source.frames)
        if ends := _ends(source.character, role):
            points = tips(source, ends) if isinstance(source, Motion) else source.positions[:, ends]
            depth = (floors[0] - points[..., 1].min(axis=1)).clip(0.0) / source.character.height
        heights[role] = floors[1] - (depth + _DEEP) * body.height
    return heights


def _stands(answer: Motion, leg: Limb) -> np.ndarray:
    """``(frames,)`` from 0 to 1, smooth: whether a foot stands."""
    still = planted(answer.positions[:, [leg.end]], answer.character.height, answer.fps)
    return smooth(1.0 * still, answer.fps)[:, 0]


def _ends(body: Character, role: str) -> list[int]:
    """A joint and those that it ends in, without chains that hang from it, such as hair."""
    joint, children = body.joint_of.get(role), body.skeleton.children
    return [] if joint is None else [joint, *(each for each in children[joint] if not children[each])]


def _carried(answer: Motion, lift: np.ndarray) -> Motion:
    """The body raised by ``(frames,)`` metres, or as far as the legs reach; feet stay where they stand."""
    body = answer.character
    legs = [limb for (_, kind), limb in rig_of(body).limbs.items() if kind == "leg"]
    for limb in legs:
        stands = _stands(answer, limb)
        lift = lift - stands * (lift - _room(answer, limb)).clip(0.0)
    pose = Pose(np.array(answer.rotations), answer.root, answer.positions, answer.global_rotations)
    pose.shift(lift[:, None] * UP)
    for limb in legs:
        if (down := _stands(answer, limb) * lift).max() > _NEAR:
            goal = ease_reach(pose, limb, pose.places[:, limb.end] - down[:, None] * UP, LEG)
            bend(body, pose, limb, goal, pose.turned[:, limb.end], answer.fps)
    return body.motion(rotation.continuous(pose.rotations), pose.root, answer.fps)


def _room(answer: Motion, leg: Limb) -> np.ndarray:
    """``(frames,)`` metres that the hips can rise until a leg, whose foot stays, is nearly straight."""
    hip, knee, foot = (answer.positions[:, joint] for joint in (leg.upper, leg.lower, leg.end))
    reach = LEG[2] * float(np.linalg.norm(knee[0] - hip[0]) + np.linalg.norm(foot[0] - knee[0]))
    away, up = np.linalg.norm((hip - foot)[:, [0, 2]], axis=1), (hip - foot)[:, 1]
    return np.asarray((np.sqrt((reach**2 - away**2).clip(0.0)) - up).clip(0.0))


def below(body: Character, role: str) -> list[int]:
    """The joint of a role and all that hang below it; none without the role."""
    top = body.joint_of.get(role)
    if top is None:
        return []
    return [j for j in range(len(body.skeleton)) if top in ancestors(body.skeleton, j, itself=True)]


def tips(motion: Motion, joints: list[int]) -> np.ndarray:
    """``(frames, points, 3)`` metres: joints, and the ends of their last bones."""
    sites = [site for site in motion.skeleton.end_sites if site.parent in joints]
    parents = [site.parent for site in sites]
    offsets = np.array([site.offset for site in sites]).reshape(1, -1, 3)
    ends = motion.positions[:, parents] + rotation.rotate(motion.global_rotations[:, parents], offsets)
    return np.concatenate([motion.positions[:, joints], ends], axis=1)


def _eased(needed: np.ndarray, fps: float) -> np.ndarray:
    """``(frames,)`` at least nearly what is needed everywhere, smooth in time."""
    half = max(1, round(FADE * fps / 2))
    around = np.lib.stride_tricks.sliding_window_view(np.pad(needed, half, mode="edge"), 2 * half + 1)
    return smooth(around.max(axis=1)[:, None], fps)[:, 0]


def _back(body: Character) -> int:
    """The first joint of the spine; without one the first above the hips on the way to the head, or it."""
    head = body.joint_of.get("head", 0)
    line = [j for j in reversed(ancestors(body.skeleton, head)) if body.roles[j] not in (None, "hips")]
    return [*chain(body.roles, "spine"), *line, head][0]


def _raised(answer: Motion, pivot: int, joints: list[int], floor: np.ndarray) -> Motion:
    """The joints below a pivot turned up about it until some of its joints, and their tips, are clear of
    the floor ``(frames,)`` metres."""
    for number in range(_ROUNDS if joints else 0):
        points, start = tips(answer, joints), answer.positions[:, pivot, None]
        if (points[..., 1] > floor[:, None] - _NEAR).all():
            break
        reach = np.maximum(np.linalg.norm(points - start, axis=-1), 1e-9)
        sines, clear = (points - start)[..., 1] / reach, (floor[:, None] - start[..., 1]) / reach
        angle = np.arcsin(np.clip(clear, -1.0, 1.0)) - np.arcsin(np.clip(sines, -1.0, 1.0))
        needed = angle.max(axis=1).clip(0.0)
        turn = _eased(needed, answer.fps) if number < _SMOOTH else needed
        lowest = np.take_along_axis(points, points[..., 1].argmin(axis=1)[:, None, None], axis=1)[:, 0]
        answer = _turned(answer, pivot, rotation.about(np.cross(lowest - start[:, 0], UP), turn))
    return answer


def _turned(answer: Motion, joint: int, world: np.ndarray) -> Motion:
    """One joint turned in the world by ``world`` ``(frames, 4)``, and all below it."""
    parent = int(answer.skeleton.parents[joint])
    above = answer.global_rotations[:, parent] if parent >= 0 else rotation.identity(1)
    turned = rotation.multiply(world, answer.global_rotations[:, joint])
    rotations = np.array(answer.rotations)
    rotations[:, joint] = rotation.normalise(rotation.multiply(rotation.conjugate(above), turned))
    return answer.character.motion(rotation.continuous(rotations), answer.root, answer.fps)


def _needed(answer: Motion, joints: list[int], floor: np.ndarray) -> np.ndarray:
    """``(frames,)`` metres that joints, and their tips, are below a floor ``(frames,)``."""
    if not joints:
        return np.zeros(answer.frames)
    return np.asarray((floor - tips(answer, joints)[..., 1].min(axis=1)).clip(0.0))


def _lifted(answer: Motion, limb: Limb, joints: list[int], floor: np.ndarray) -> Motion:
    """An arm bent until the hand is above the floor ``(frames,)`` metres, as far as it is not too fast; the
    hand keeps its orientation."""
    body = answer.character
    for _ in range(_SMOOTH):
        needed = _needed(answer, joints, floor)
        if needed.max(initial=0.0) < _NEAR:
            break
        pose = Pose(np.array(answer.rotations), answer.root, answer.positions, answer.global_rotations)
        goal = answer.positions[:, limb.end] + _eased(needed, answer.fps)[:, None] * UP
        goal = ease_reach(pose, limb, goal, ARM)
        bend(body, pose, limb, goal, pose.turned[:, limb.end], answer.fps)
        answer = body.motion(rotation.continuous(pose.rotations), answer.root, answer.fps)
    return answer
