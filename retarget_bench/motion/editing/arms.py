"""Arms that are turned at the shoulder where hands or forearms would go into trunk or legs.

An arm that is copied to a thicker body, or to one of narrower shoulders, goes into its thighs as it swings.
Artists give such bodies "arm space". Here the whole arm is turned, by as little as brings it out, where the
source's hand is free: a hand that touches in the source (``touches``) stays as it is.
"""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.editing.girths import PosedParts, arm_points, parts
from retarget_bench.motion.editing.touches import touching
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.planting.ease import FADE, smooth
from retarget_bench.motion.roles import SIDES

Arms = Literal["clear", "keep"]

_RATE = 15.0
"""Frames a second that are looked at; what is found is eased over longer times."""
_MARGIN = 0.005
"""Body heights that stay between arm and body."""
_SOFT, _MOST = np.radians(30.0), np.radians(40.0)
"""Turns that are larger than the first are eased towards the other: more would be another pose."""
_ROUNDS, _STEPS = 2, 4
"""How often what is left is mended; steps that find how far an arm has to turn."""
_PASS, _FADES = 0.2, (0.1, 0.5)
"""Body heights that a hand moves against its shoulder while a turn comes or goes, so that one that grazes
the body in a fast swing is left before and after; seconds that it takes at least and at most."""
_LEVER = 0.1
"""Arm lengths: no lever of a turn counts as shorter."""
_NEAR, _SEEN = 1e-6, np.radians(0.5)
"""Radians that make no difference in a frame; that a motion is left for if no turn in it is larger."""


def cleared(answer: Motion, source: Prediction, loop: bool = False) -> tuple[Motion, str]:
    """The answer with arms outside of trunk and legs, and a sentence on it; "" where nothing was done, and
    the answer is returned as it is. Frames and joints that need no change keep their rotations.

    source: as many frames, by which hands that touch are known. loop: its last frame is its first.
    The answer's body needs a mesh, which says how thick it is.
    """
    body = answer.character
    if not _arms(body) or not parts(body) or not answer.frames:
        return answer, ""
    pieces = takes(answer)
    loop = loop and len(pieces) == 1
    turns = np.concatenate([_turns(answer.at(piece), source.at(piece), loop) for piece in pieces])
    angles = rotation.angle(turns, rotation.identity(1))
    turned = angles > _NEAR
    if angles.max() < _SEEN:
        return answer, ""
    rotations = np.array(answer.rotations)
    for number, (_, joint, _) in enumerate(_arms(body)):
        at = turned[:, number]
        local = rotation.multiply(turns[at, number], rotations[at, joint])
        rotations[at, joint] = rotation.normalise(local)
    frames = int(turned.any(axis=1).sum())
    note = (
        f"the arms of {body.name} are turned away from its body in {frames} frame{'s'[: frames > 1]}, by "
        f"up to {np.degrees(angles.max()):.0f} degrees; arms=keep leaves them"
    )
    return body.motion(rotations, answer.root, answer.fps), note


def _arms(body: Character) -> list[tuple[str, int, int]]:
    """The side, upper joint and hand of each whole arm that hangs from something."""
    lines = {side: body.joints([f"{side}_{part}" for part in ("arm", "forearm", "hand")]) for side in SIDES}
    parents = body.skeleton.parents
    return [
        (side, line[0], line[2]) for side, line in lines.items() if len(line) == 3 and parents[line[0]] >= 0
    ]


def _turns(answer: Motion, source: Prediction, loop: bool) -> np.ndarray:
    """``(frames, arms, 4)`` by which each arm is turned, in the frame of what it hangs from; the identity
    where nothing is in the way."""
    step = max(1, round(answer.fps / _RATE))
    time = _Time(np.arange(0, answer.frames, step), answer.frames, answer.fps, loop)
    few, played = answer.at(time.at), replace(source.at(time.at), fps=answer.fps / step)
    obstacles = PosedParts.of(few)
    own = PosedParts.of(played) if isinstance(played, Motion) else None
    return np.stack(
        [
            _arm_turns(_Arm.of(few, obstacles, each, _margin(played, own, each[0])), played, own, time)
            for each in _arms(answer.character)
        ],
        axis=1,
    )


@dataclass(frozen=True)
class _Time:
    """The frames ``at`` of a motion that are looked at, and all its frames."""

    at: np.ndarray
    frames: int
    fps: float
    loop: bool

    def between(self, values: np.ndarray) -> np.ndarray:
        """``(frames, n)`` values of the frames ``at``, with lines between them."""
        return np.stack([np.interp(np.arange(self.frames), self.at, each) for each in values.T], axis=1)

    def smooth(self, curves: np.ndarray, seconds: float) -> np.ndarray:
        """``(frames, n)`` a Hann average over so many seconds, over the ends of loops."""
        half = max(1, round(seconds * self.fps / 2))
        return smooth(self._padded(curves, half), self.fps, seconds)[half:-half]

    def over(self, values: np.ndarray, seconds: float = FADE) -> np.ndarray:
        """``(frames, 1)`` a smooth curve that is nowhere lower than values ``(len(at),)``, and comes and
        goes in so many seconds."""
        half = max(1, round(seconds * self.fps / 2))
        padded = self._padded(self.between(values[:, None]), half)
        around = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
        return self.smooth(around.max(axis=-1), seconds)

    def _padded(self, curves: np.ndarray, more: int) -> np.ndarray:
        """So many frames more on either side: those of a loop, else the ends."""
        if not self.loop:
            return np.pad(curves, ((more, more), (0, 0)), mode="edge")
        return np.pad(curves[:-1], ((more, more + 1), (0, 0)), mode="wrap")


@dataclass(frozen=True, eq=False)
class _Arm:
    """An arm in the frames that are looked at.

    height: metres of the body. obstacles: its trunk and legs.
    margin: ``(frames,)`` metres that have to stay between.
    pivot:  ``(frames, 1, 3)`` metres, the shoulder.
    above:  ``(frames, 4)`` orientation of what it hangs from.
    points: ``(frames, n, 3)`` metres from the pivot, the hand's joint last.
    """

    side: str
    height: float
    obstacles: PosedParts
    margin: np.ndarray
    pivot: np.ndarray
    above: np.ndarray
    points: np.ndarray

    @classmethod
    def of(cls, few: Motion, obstacles: PosedParts, arm: tuple[str, int, int], margin: np.ndarray) -> Self:
        """An arm of ``_arms``. margin: in body heights."""
        (side, upper, hand), above = arm, few.character.skeleton.parents
        pivot = few.positions[:, [upper]]
        points = np.concatenate([arm_points(few, side), few.positions[:, [hand]]], axis=1) - pivot
        height = few.character.height
        return cls(
            side, height, obstacles, height * margin, pivot, few.global_rotations[:, above[upper]], points
        )

    def at(self, frames: np.ndarray) -> Self:
        """The chosen frames."""
        names = ("margin", "pivot", "above", "points")
        return replace(
            self, obstacles=self.obstacles.at(frames), **{n: getattr(self, n)[frames] for n in names}
        )

    def turned(self, world: np.ndarray) -> Self:
        """Turned about the shoulder, in the world ``(frames, 4)``."""
        return replace(self, points=rotation.rotate(world[:, None], self.points))

    def fade(self, chosen: np.ndarray, fps: float) -> float:
        """Seconds over which turns come and go: as fast as the hand is in the chosen frames, bool."""
        hand = self.points[:, -1]
        if len(hand) < 2:
            return _FADES[1]
        speed = float(np.median(np.linalg.norm(np.gradient(hand, 1.0 / fps, axis=0), axis=1)[chosen]))
        return float(np.clip(_PASS * self.height / max(speed, 1e-9), *_FADES))

    def inside(self) -> tuple[np.ndarray, np.ndarray]:
        """``PosedParts.deepest`` of it."""
        return self.obstacles.deepest(self.pivot + self.points[:, :-1], self.margin)


def _arm_turns(arm: _Arm, source: Prediction, own: PosedParts | None, time: _Time) -> np.ndarray:
    """``(frames, 4)`` the turns of one arm. own: the source's trunk and legs.

    Turns are found at the frames that are looked at, and eased: to nothing around touches, and around
    frames in which the arm would be deeper than before, as averaged axes may have it.
    """
    turns = rotation.identity(time.frames)
    before = arm.inside()[0]
    if not before.any():
        return turns
    touches = touching(source, arm.side, own)
    fade = arm.fade(before > 0.0, source.fps)
    free, back = 1.0 - time.over(1.0 * touches), rotation.conjugate(arm.above)
    for _ in range(_ROUNDS):
        now = turns[time.at]
        there = arm.turned(rotation.multiply(arm.above, rotation.multiply(now, back)))
        depth, way = there.inside()
        axis = rotation.rotate(back, rotation.unit(np.cross(there.points[:, -1], way)))
        axis = rotation.unit(time.smooth(time.between(depth[:, None] * axis), 3.0 * fade))
        angle = _needed(there, rotation.rotate(arm.above, axis[time.at]), depth)
        angle = angle.clip(0.0, _MOST)
        angle = free * time.over(np.where(touches, 0.0, angle), fade)
        turns = rotation.multiply(rotation.about(axis, angle[:, 0]), turns)
    there = arm.turned(rotation.multiply(arm.above, rotation.multiply(turns[time.at], back)))
    worse = there.inside()[0] > before + _MARGIN * arm.height
    vectors = (1.0 - time.over(1.0 * worse)) * rotation.to_rotation_vector(turns)
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    eased = np.where(
        angles > _SOFT, _MOST - (_MOST - _SOFT) * np.exp((_SOFT - angles) / (_MOST - _SOFT)), angles
    )
    return rotation.from_rotation_vector(vectors * (eased / np.maximum(angles, 1e-12)))


def _needed(arm: _Arm, axis: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians by which an arm that is inside by ``depth`` ``(frames,)`` metres has to be
    turned about an axis ``(frames, 3)`` to be outside, or nearly so."""
    angles, depth, left = np.zeros(len(depth)), depth.copy(), np.flatnonzero(depth > 0.0)
    least = _LEVER * float(np.linalg.norm(arm.points[:, -1], axis=-1).max(initial=1e-9))
    points = arm.points[left]
    for _ in range(_STEPS):
        lever = np.linalg.norm(np.cross(axis[left], points[:, -1]), axis=1)
        angles[left] += depth[left] / np.maximum(lever, least)
        there = arm.at(left).turned(rotation.about(axis[left], angles[left]))
        depth[left] = there.inside()[0]
        left, points = left[depth[left] > 0.0], there.points[depth[left] > 0.0]
    return angles


def _margin(source: Prediction, own: PosedParts | None, side: str) -> np.ndarray:
    """``(frames,)`` body heights that stay between the arm and its body: ``_MARGIN``, or what stays in the
    source where its skin shows less; negative where its arm is inside.

    own: the source's trunk and legs.
    """
    if own is None or not own.parts:
        return np.full(source.frames, _MARGIN)
    assert isinstance(source, Motion)
    height = source.character.height
    return np.asarray(_MARGIN - own.deepest(arm_points(source, side), _MARGIN * height)[0] / height)
