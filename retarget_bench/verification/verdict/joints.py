"""Defects of joints and feet in a result beside its source.

Knees and elbows that snap, or are straight where the source bends them; joints that move too fast; feet
below the floor that the source stands on, and feet that slide while the source's stand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.motion import contact, ground, root_rules, rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.hinges import FOLDED
from retarget_bench.motion.planting.feet import planted
from retarget_bench.motion.roles import HANDS, SIDES, bones, is_finger, is_tip
from retarget_bench.verification.verdict.defects import Defect, defect, stretches

NEAR = 0.1
"""Seconds: how far before or after a frame the source may do what the result does in it."""
_BRIEF = 1 / 30
"""Seconds in which changes are measured, so that limits mean the same at any rate."""
FASTER = 1.5
"""Times the source's fastest turn or speed nearby, at the size of this body, that still passes."""
JUMP = 12.0
"""Degrees in 1/30 s beyond ``FASTER`` times the source's, which still pass."""
STRAIGHT, BENT = 4.0, 25.0
"""Degrees: a limb bent less is straight; one bent more is clearly bent."""
LASTING = 0.1
"""Seconds that a limb has to be straight for, and a foot in the floor."""
SLACK = 1.0
"""Leg lengths per second beyond ``FASTER`` times the source's, which still pass."""
DEEP = 0.02
"""Body heights that a foot may be deeper than the source's at this size."""
SLID = 0.025
"""Body heights that a foot may slide beyond ``FARTHER`` times what the source's does at this size."""
FARTHER = 1.5
_STEP = 0.06
"""Body heights above the lowest floor from where a standing foot is on a step."""
_EDGE = 1 / 30
"""Seconds at either end of a stand, in which a foot may already or still move."""
_JOINTS = {
    "shoulder": "collar bone",
    "arm": "shoulder",
    "forearm": "elbow",
    "up_leg": "hip",
    "leg": "knee",
    "foot": "ankle",
}


@dataclass(frozen=True, eq=False)
class Pair:
    """Two motions with as many frames at one rate. Only positions are used."""

    source: Prediction
    result: Prediction

    @property
    def fps(self) -> float:
        return float(self.result.fps)

    @property
    def bodies(self) -> tuple[Character, Character]:
        return self.source.character, self.result.character

    @cached_property
    def step(self) -> int:
        """Frames in ``_BRIEF``, one at least."""
        return max(1, round(_BRIEF * self.fps))

    @cached_property
    def near(self) -> int:
        """Frames in ``NEAR``, and at least the two around."""
        return max(2, round(NEAR * self.fps))

    @cached_property
    def brief(self) -> str:
        """The time of a ``step``, for people."""
        return "a frame" if self.step == 1 else f"{self.step} frames"

    @cached_property
    def ratio(self) -> float:
        """Size of the result's body over the source's, by the legs, else by height."""
        source, result = (body.measures for body in self.bodies)
        if source.leg_length > 0 and result.leg_length > 0:
            return result.leg_length / source.leg_length
        return result.height / source.height

    def reach_ratio(self, role: str) -> float:
        """Likewise by the bones from the hips to the joint of a role, but not less than by the legs: hands
        of long arms move faster."""
        source, result = (
            bones(b.skeleton, b.joint_of[role], b.joint_of.get("hips", 0)) for b in self.bodies
        )
        return max(self.ratio, result / source) if source > 0 else self.ratio

    def has(self, *roles: str) -> bool:
        """True where both bodies have joints of all these roles."""
        return all(role in body.joint_of for body in self.bodies for role in roles)

    def paths(self, role: str) -> tuple[np.ndarray, np.ndarray]:
        """``(frames, 3)`` metres each: the joint of a role in source and result."""
        source, result = (body.joint_of[role] for body in self.bodies)
        return self.source.positions[:, source], self.result.positions[:, result]


def maximum_around(values: np.ndarray, radius: int) -> np.ndarray:
    """``(frames,)`` the largest value within so many frames before and after each."""
    from scipy.ndimage import maximum_filter1d  # type: ignore[import-untyped]

    return np.asarray(maximum_filter1d(values, 2 * radius + 1, mode="nearest"))


def joint_name(role: str) -> str:
    """The joint of a role in the words of people: ``left knee`` for ``left_leg``, where its bone begins."""
    side, _, part = role.partition("_")
    if side not in SIDES:
        return role.replace("_", " ")
    return f"{side} {_JOINTS.get(part, part.replace('_', ' '))}"


# ---------------------------------------------------------------------------------- limbs and speeds
def bends(pair: Pair) -> Iterator[Defect]:
    """Defects of the knees and elbows that both bodies have."""
    for top, (middle, end) in FOLDED.items():
        if not pair.has(top, middle, end):
            continue
        paths = [pair.paths(role) for role in (top, middle, end)]
        source, result = (angle_between(b - a, c - b) for a, b, c in zip(*paths, strict=True))
        name = joint_name(middle)
        yield from _snaps(pair, name, source, result)
        yield from _straight(pair, name, source, result)


def angle_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """``(...)`` degrees between vectors ``(..., 3)``."""
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.degrees(np.arctan2(across, np.einsum("...c,...c->...", one, other)))


def _snaps(pair: Pair, name: str, source: np.ndarray, result: np.ndarray) -> Iterator[Defect]:
    before, turned = (np.abs(each[pair.step :] - each[: -pair.step]) for each in (source, result))
    usual = maximum_around(before, pair.near)
    limit = FASTER * usual + JUMP
    share = turned / limit
    for part in stretches(share > 1.0, pair.fps):
        worst = part.start + int(np.argmax(share[part]))
        frames = slice(part.start, part.stop + pair.step)
        numbers = turned[worst], usual[worst], share[worst]
        yield defect("snap", name, frames, worst + pair.step, *numbers, pair.brief)


def _straight(pair: Pair, name: str, source: np.ndarray, result: np.ndarray) -> Iterator[Defect]:
    for part in stretches((result < STRAIGHT) & (source > BENT), pair.fps):
        if part.stop - part.start >= LASTING * pair.fps:
            worst = part.start + int(np.argmax((source - result)[part]))
            severity = (source[worst] - result[worst]) / (BENT - STRAIGHT)
            yield defect("straight", name, part, worst, result[worst], source[worst], severity)


def speeds(pair: Pair) -> Iterator[Defect]:
    """Stretches in which any joint is too fast, each with the joint that is the worst."""
    roles = [
        role
        for role in pair.result.character.joint_of
        if pair.has(role) and not is_finger(role) and not is_tip(role)
    ]
    if not roles or pair.result.frames <= pair.step:
        return
    result, usual = (
        np.stack(each, axis=1) for each in zip(*(_speeds(pair, role) for role in roles), strict=True)
    )
    limit = FASTER * usual + SLACK * max(pair.result.character.measures.leg_length, 1e-3)
    share = result / limit
    for part in stretches(np.any(share > 1.0, axis=1), pair.fps):
        frame, joint = np.unravel_index(int(np.argmax(share[part])), share[part].shape)
        worst = part.start + int(frame), int(joint)
        others = int((share[part] > 1.0).any(axis=0).sum()) - 1
        also = f", and {others} more joint{'s' * (others > 1)}" if others else ""
        frames = slice(part.start, part.stop + pair.step)
        numbers = result[worst], usual[worst], share[worst]
        yield defect("speed", joint_name(roles[joint]), frames, worst[0] + pair.step, *numbers, also)


def _speeds(pair: Pair, role: str) -> tuple[np.ndarray, np.ndarray]:
    """``(frames - step,)`` metres per second: a joint's, and the most that the source has nearby, at the
    size of the result's body."""
    source, result = (
        np.linalg.norm(path[pair.step :] - path[: -pair.step], axis=1) * pair.fps / pair.step
        for path in pair.paths(role)
    )
    return result, pair.reach_ratio(role) * maximum_around(source, pair.near)


# ---------------------------------------------------------------------------------------------- feet
@dataclass(frozen=True, eq=False)
class _Foot:
    """A foot of both bodies, and the floor that the source's shows; all but the role ``(frames,)``.

    role:   of the joint by which it stands.
    stands: bool, where the source's does. source, result: metres, their lowest.
    level:  metres, the lowest floor that the source's stands on, or comes down to.
    floor:  likewise, at y = 0 at most, but of the step where it stands on one.
    """

    role: str
    stands: np.ndarray
    source: np.ndarray
    result: np.ndarray
    level: np.ndarray
    floor: np.ndarray


def feet(pair: Pair) -> Iterator[Defect]:
    """Defects of the feet that both bodies have, and of hands and heads below the floor of these."""
    both = {side: _foot(pair, side, role) for side in SIDES if (role := _stands_by(pair, side))}
    if not both:
        return
    scaled = _scaled(pair, [*both.values()])
    for side, foot in both.items():
        depth = foot.level - foot.source
        yield from _deeper(pair, f"{side} foot", scaled(foot.floor), depth, foot.result)
        yield from _slides(pair, side, foot)
    for role in (*HANDS, "head"):
        if pair.has(role):
            source, result = (path[:, 1] for path in pair.paths(role))
            floor = np.minimum(0.0, np.min([foot.level for foot in both.values()], axis=0))
            yield from _deeper(pair, joint_name(role), scaled(floor), floor - source, result)


def _stands_by(pair: Pair, side: str) -> str | None:
    return next((role for part in ("toe", "foot") if pair.has(role := f"{side}_{part}")), None)


def _foot(pair: Pair, side: str, role: str) -> _Foot:
    body = pair.source.character
    stands = planted(pair.source, body.joint_of[role])  # type: ignore[arg-type]
    source, result = (_lowest(motion, side) for motion in (pair.source, pair.result))
    lowest = float(np.quantile(source[stands], 0.05)) if stands.any() else 0.0
    level = ground.shown(lowest, source, ground.lower(lowest, source, body.height))
    on_step = stands & (source > level + _STEP * body.height)
    floor = np.where(on_step, source, np.minimum(level, 0.0))
    return _Foot(role, stands, source, result, level, floor)


def _scaled(pair: Pair, both: Sequence[_Foot]) -> Callable[[np.ndarray], np.ndarray]:
    """What takes floors of the source, ``(frames,)`` metres, to the size of the result's body.

    The floor at y = 0 goes by the legs. Where another one is (a ledge, steps, the floor below) depends on
    how the root path is scaled, and right ones differ: it may be as low as the result's feet are while the
    source's are on it, as far as one of the ``root_rules`` has it there.
    """
    bodies = pair.bodies
    rules = [rule for rule in root_rules.SCALING_RULES if not root_rules.reason(rule, *bodies)]
    ratios = [root_rules.ratios(rule, *bodies)[1] for rule in rules]
    floors, source, result = (
        np.concatenate([getattr(foot, name) for foot in both]) for name in ("floor", "source", "result")
    )
    apart, near = _STEP * bodies[0].height, DEEP * bodies[0].height
    on = (np.abs(floors) > apart) & (source < floors + near)
    fitted = float(floors[on] @ result[on] / (floors[on] @ floors[on])) if on.any() else pair.ratio
    fitted = float(np.clip(fitted, min(ratios), max(ratios)))

    def scaled(floor: np.ndarray) -> np.ndarray:
        lower = np.where(floor > 0.0, min(fitted, pair.ratio), max(fitted, pair.ratio))
        return np.where(np.abs(floor) > apart, lower, pair.ratio) * floor

    return scaled


def _deeper(
    pair: Pair, name: str, floor: np.ndarray, depth: np.ndarray, result: np.ndarray
) -> Iterator[Defect]:
    """Stretches in which a part is deeper below a floor than the source's is at this size.

    All ``(frames,)`` metres: the height of the result's floor, the depth of the source's part below its
    own, and the height of the result's part.
    """
    usual = pair.ratio * np.maximum(depth, 0.0)
    deep = floor - result
    limit = usual + DEEP * pair.result.character.height
    for part in stretches(deep > limit, pair.fps):
        if part.stop - part.start >= LASTING * pair.fps:
            worst = part.start + int(np.argmax((deep - usual)[part]))
            numbers = 100 * deep[worst], 100 * usual[worst], deep[worst] / limit[worst]
            yield defect("floor", name, part, worst, *numbers)


def _lowest(motion: Prediction, side: str) -> np.ndarray:
    """``(frames,)`` metres: the lowest of the soles under ankle and toes, and of these joints themselves,
    above the floor y = 0.

    Soles are as far below the joints as in the reference pose, and turn with them: a kneeling foot that
    lies on its instep is not in the floor. Without rotations a sole is taken to be below its joint.
    """
    body = motion.character
    joints = body.joints([f"{side}_{part}" for part in ("foot", "toe", "toe_end")])
    places, thick = motion.positions[:, joints, 1], body.standing_places[joints, 1]
    if not isinstance(motion, Motion):
        return np.asarray((places - thick).min(axis=1))
    back = rotation.conjugate(body.reference_globals[joints])
    down = rotation.multiply(motion.global_rotations[:, joints], back[None])
    soles = places - thick * rotation.rotate(down, UP)[..., 1]
    return np.asarray(np.minimum(places, soles).min(axis=1))


def _slides(pair: Pair, side: str, foot: _Foot) -> Iterator[Defect]:
    edge = round(_EDGE * pair.fps)
    source, result = pair.paths(foot.role)
    for start, past in contact.runs(foot.stands).tolist():
        first, last = start + (edge if start else 0), past - 1 - (edge if past < len(foot.stands) else 0)
        if last - first < 1:
            continue
        path = result[first : last + 1]
        usual, amount = pair.ratio * _extent(source[first : last + 1]), _extent(path)
        limit = FARTHER * usual + SLID * pair.result.character.height
        if amount > limit:
            worst = first + int(np.argmax(np.linalg.norm(path - path.mean(axis=0), axis=1)))
            frames, numbers = slice(first, last + 1), (100 * amount, 100 * usual, amount / limit)
            yield defect("slide", f"{side} foot", frames, worst, *numbers)


def _extent(path: np.ndarray) -> float:
    """Metres along the ground between the farthest places of a path ``(frames, 3)``, by its box."""
    return float(np.linalg.norm(np.ptp(path[:, [0, 2]], axis=0)))
