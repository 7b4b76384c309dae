"""Hands that touch something in the source: the other hand, the own body, or the floor."""

from collections.abc import Sequence

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.planting.ease import smooth, smoothstep, spread
from retarget_bench.motion.planting.feet import Exchange, held, planted, walked
from retarget_bench.motion.planting.palms import Reach, shared_bones
from retarget_bench.motion.planting.two_bone import Limb

_TOUCH, _CLEAR = 0.06, 0.21
"""Arm lengths from palm to bone (2 and 7 % of a body height): a touch up to here, none from there."""
_FAR, _TOO_FAR = 0.4, 0.6
"""Arm lengths that a hand is moved in full; from where a touch is given up, as it asks for another pose."""
_SETTLE, _SETTLE_FAR = 1 / 6, 1.0
"""Seconds over which hand corrections are averaged (longer would wash out clapping), and their size."""
_LOW = 0.08
"""Body heights above the floor up to which a resting hand leans on it."""


def touches(exchange: Exchange, arms: Sequence[tuple[Limb, Limb]]) -> list[np.ndarray]:
    """By how much the left and the right hand have to move, ``(frames, 3)`` metres each.

    A palm near a bone of its own body keeps its place along that bone and its distance from it, in arm
    lengths; two palms near each other keep their distance. The closer the touch, the more it counts.
    arms: the left and the right one, on the source and on the target.
    """
    source, pose, arm = exchange.source, exchange.pose, exchange.source.character.measures.arm_length
    scale = exchange.target_rig.character.measures.arm_length / arm
    (source_bones, target_bones), allowed = shared_bones(exchange.source_rig, exchange.target_rig)
    source_arms, target_arms = zip(*arms, strict=True)

    def moves_of(*points: np.ndarray) -> np.ndarray:
        """``(frames, 2, 3)`` the moves that the hands need in each frame on its own."""
        before = Reach.of(exchange.source_rig, source_arms, source_bones, *points[:2])
        after = Reach.of(exchange.target_rig, target_arms, target_bones, *points[2:])
        moves = np.stack([_to_body(before, after, hand, allowed, arm, scale) for hand in (0, 1)], axis=1)
        apart = before.palms[:, 1] - before.palms[:, 0]
        moved = after.palms + moves
        error = scale * apart - (moved[:, 1] - moved[:, 0])
        pull = 0.5 * _closeness(apart / arm)[:, None] * error
        return np.stack([moves[:, 0] - pull, moves[:, 1] + pull], axis=1)

    moves = rotation.in_blocks(
        moves_of, source.positions, source.global_rotations, pose.places, pose.turned
    )
    out = []
    for move in moves.transpose(1, 0, 2):
        far = smooth(np.linalg.norm(move, axis=1, keepdims=True) / (scale * arm), source.fps, _SETTLE_FAR)
        share = smoothstep((_TOO_FAR - far) / (_TOO_FAR - _FAR))
        out.append(smooth(share * move, source.fps, _SETTLE))
    return out


def lean(exchange: Exchange, source_arm: Limb, target_arm: Limb, move: np.ndarray) -> np.ndarray:
    """``move`` ``(frames, 3)``, overruled where the source's hand rests on the floor: there it is held."""
    source = exchange.source
    low = source.positions[:, source_arm.end, 1] < _LOW * source.character.height
    leaning = planted(source, source_arm.end) & low
    if not leaning.any():
        return move
    shift = (
        held(walked(exchange, source_arm.end, target_arm.end), leaning)
        - exchange.pose.places[:, target_arm.end]
    )
    eased = spread(np.hstack([shift, np.ones((len(low), 1))]), leaning, source.fps)
    return eased[:, :3] + (1.0 - np.minimum(eased[:, 3:], 1.0)) * move


def _to_body(
    before: Reach, after: Reach, hand: int, allowed: np.ndarray, arm: float, scale: float
) -> np.ndarray:
    """``(frames, 3)`` what brings one palm to where the source's touches its body."""
    along, away = before.to_bones(hand)
    weight = _closeness(away / arm) * allowed[hand]
    goals = after.starts + along * (after.ends - after.starts) + scale * away
    mean = (weight[..., None] * goals).sum(1) / np.maximum(weight.sum(1), 1e-9)[:, None]
    return weight.max(axis=1, initial=0.0)[:, None] * (mean - after.palms[:, hand])


def _closeness(away: np.ndarray) -> np.ndarray:
    """1 for a touch, 0 when clear of it; ``away`` ``(..., 3)`` in arm lengths."""
    return smoothstep((_CLEAR - np.linalg.norm(away, axis=-1)) / (_CLEAR - _TOUCH))
