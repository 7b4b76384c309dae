"""Arms that are turned at the shoulder where hands or forearms would go into trunk or legs.

An arm that is copied to a body of more flesh, or of narrower shoulders, goes into its thighs as it swings.
Artists give such bodies "arm space". Here the whole arm is turned, by as little as brings it out, where the
source's hand is free: what touches in the source (``touches``) stays as it is.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion, Prediction
from retarget_bench.motion.editing.girths import Flesh, arm_points, parts
from retarget_bench.motion.editing.touches import touching
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.planting.ease import FADE, smooth
from retarget_bench.motion.roles import SIDES

Arms = Literal["clear", "keep"]

_RATE = 15.0
"""Frames a second that are looked at; what is found is eased over longer times."""
_MARGIN = 0.005
"""Body heights that stay between arm and body."""
_REACH = 0.1
"""Body heights: parts of the body that an arm is never so near to are not asked."""
_MOST = np.radians(40.0)
"""An arm is turned no farther: that would be another pose, and verdicts tell of it."""
_ROUNDS, _STEPS = 2, 4
"""How often what is left is mended; steps that find how far an arm has to turn."""
_AXES = 1.0
"""Seconds over which the axes of turns are averaged: as far as one turn reaches, and more."""
_NEAR = 1e-6
"""Radians that make no difference."""


def cleared(answer: Motion, source: Prediction, loop: bool = False) -> tuple[Motion, str]:
    """The answer with arms outside of trunk and legs, and a sentence on it; "" where nothing was done, and
    the answer is returned as it is. Frames and joints that need no change keep their rotations.

    source: as many frames, by which hands that touch are known. loop: its last frame is its first.
    The answer's body needs a mesh, which says how thick it is.
    """
    body = answer.character
    if not parts(body) or not answer.frames:
        return answer, ""
    pieces = takes(answer)
    turns = rotation.identity(answer.frames, len(SIDES))
    for piece in pieces:
        one, other = answer.at(piece), source.at(piece)
        turns[piece] = np.stack(
            [_turns(one, other, side, loop and len(pieces) == 1) for side in SIDES], axis=1
        )
    angles = rotation.angle(turns, rotation.identity(1))
    turned = angles > _NEAR
    if not turned.any():
        return answer, ""
    rotations = np.array(answer.rotations)
    for number in np.flatnonzero(turned.any(axis=0)):
        at, joint = turned[:, number], body.joint_of[f"{SIDES[number]}_arm"]
        rotations[at, joint] = rotation.normalise(
            rotation.multiply(turns[at, number], rotations[at, joint])
        )
    frames = int(turned.any(axis=1).sum())
    note = (
        f"hands are kept out of the body of {body.name} in {frames} frame{'s'[: frames > 1]}, by up to "
        f"{np.degrees(angles.max()):.0f} degrees at the shoulder; arms=keep leaves them"
    )
    return body.motion(rotations, answer.root, answer.fps), note


def _turns(answer: Motion, source: Prediction, side: str, loop: bool) -> np.ndarray:
    """``(frames, 4)`` by which one arm is turned, in the frame of what it hangs from; the identity where
    nothing is in the way."""
    body, fps, frames = answer.character, answer.fps, answer.frames
    turns = rotation.identity(frames)
    shoulder, hand = (body.joint_of.get(f"{side}_{part}", -1) for part in ("arm", "hand"))
    if min(shoulder, hand) < 0:
        return turns
    step = max(1, round(fps / _RATE))
    at = np.arange(0, frames, step)
    few, played = answer.at(at), replace(source.at(at), fps=fps / step)
    margin = body.height * _margin(played, side)
    points = arm_points(few, side)
    flesh = Flesh.of(few).near(points, _REACH * body.height)
    pivot, above = few.positions[:, [shoulder]], few.global_rotations[:, body.skeleton.parents[shoulder]]
    arm = np.concatenate([points, few.positions[:, [hand]]], axis=1) - pivot
    if not (flesh.deepest(points, margin)[0] > 0.0).any():
        return turns
    touches = touching(played, side)
    free = 1.0 - _over(_between(at, 1.0 * touches[:, None], frames), fps, loop)
    for _ in range(_ROUNDS):
        world = rotation.multiply(rotation.multiply(above, turns[at]), rotation.conjugate(above))
        turned = rotation.rotate(world[:, None], arm)
        depth, way = flesh.deepest(pivot + turned[:, :-1], margin)
        axis = rotation.rotate(rotation.conjugate(above), rotation.unit(np.cross(turned[:, -1], way)))
        wanted = _between(at, depth.clip(0.0)[:, None] * axis, frames)
        axis = rotation.unit(_smooth(wanted, _AXES, fps, loop))
        most = (_MOST - rotation.angle(turns[at], rotation.identity(1))).clip(0.0)
        angle = _needed(flesh, pivot, turned, rotation.rotate(above, axis[at]), margin).clip(0.0, most)
        angle = free * _over(_between(at, np.where(touches, 0.0, angle)[:, None], frames), fps, loop)
        turns = rotation.multiply(rotation.about(axis, angle[:, 0]), turns)
    return turns


def _margin(source: Prediction, side: str) -> np.ndarray:
    """``(frames, 1)`` body heights that stay between the arm and its body: ``_MARGIN``, or what stays in
    the source where its skin shows less; negative where its arm is inside."""
    if not isinstance(source, Motion) or not parts(source.character):
        return np.full((source.frames, 1), _MARGIN)
    depth = Flesh.of(source).deepest(arm_points(source, side))[0] / source.character.height
    return np.asarray(np.minimum(-depth, _MARGIN)[:, None])


def _needed(
    flesh: Flesh, pivot: np.ndarray, arm: np.ndarray, axis: np.ndarray, margin: np.ndarray
) -> np.ndarray:
    """``(frames,)`` radians by which an arm has to be turned about an axis ``(frames, 3)`` to be outside of
    the body, or nearly so.

    pivot: ``(frames, 1, 3)`` metres. arm: ``(frames, n, 3)`` metres from it, the hand last.
    margin: ``(frames, 1)`` metres.
    """
    angles, left = np.zeros(len(arm)), np.arange(len(arm))
    for _ in range(_STEPS):
        turned = rotation.rotate(rotation.about(axis[left], angles[left])[:, None], arm[left])
        depth = flesh.at(left).deepest(pivot[left] + turned[:, :-1], margin[left])[0]
        left, turned, depth = (each[depth > 0.0] for each in (left, turned, depth))
        lever = np.linalg.norm(np.cross(axis[left], turned[:, -1]), axis=1)
        angles[left] += depth / np.maximum(lever, 1e-3)
    return angles


def _between(at: np.ndarray, values: np.ndarray, frames: int) -> np.ndarray:
    """``(frames, n)`` values ``(len(at), n)`` of some frames, with lines between them."""
    return np.stack([np.interp(np.arange(frames), at, each) for each in values.T], axis=1)


def _over(curves: np.ndarray, fps: float, loop: bool) -> np.ndarray:
    """``(frames, n)`` curves that are nowhere lower than the given ones, smooth in time."""
    half = max(1, round(FADE * fps / 2))
    padded = _padded(curves, half, loop)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1, axis=0)
    return _smooth(around.max(axis=-1), FADE, fps, loop)


def _smooth(curves: np.ndarray, seconds: float, fps: float, loop: bool) -> np.ndarray:
    """``(frames, n)`` a Hann average over so many seconds, over the ends of loops."""
    half = max(1, round(seconds * fps / 2))
    return smooth(_padded(curves, half, loop), fps, seconds)[half:-half]


def _padded(curves: np.ndarray, more: int, loop: bool) -> np.ndarray:
    """Curves ``(frames, n)`` with so many frames more on either side: those of a loop, else the ends."""
    if not loop:
        return np.pad(curves, ((more, more), (0, 0)), mode="edge")
    return np.pad(curves[:-1], ((more, more + 1), (0, 0)), mode="wrap")
