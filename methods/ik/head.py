"""A head kept above the floor by raising the back."""

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.planting.ease import FADE, smooth
from retarget_bench.motion.planting.feet import Exchange
from retarget_bench.motion.planting.two_bone import slowed
from retarget_bench.motion.roles import chain

_TOP = ("head", "head_top")
_DEEP = 0.05
"""Body heights below the floor from which on it is mended: who lies may well be a little below."""


def lift(exchange: Exchange) -> None:
    """Raise the back at the first joint of the spine where the head would be deep below the floor.

    A person's stoop pushes the head of a body with a level back into the ground. What the source has below
    the floor may stay there. In place; the largest turn needed nearby in time is taken, smoothed.
    """
    pose, body = exchange.pose, exchange.target_rig.character
    spine = (chain(body.roles, "spine") or [0])[0]
    if spine and (local := _raised(exchange, spine)) is not None:
        pose.rotations[:, spine] = slowed(pose.rotations[:, spine], local, exchange.source.fps)
        pose.stand(body)


def _raised(exchange: Exchange, spine: int) -> np.ndarray | None:
    """``(frames, 4)`` local rotations of a joint of the spine that raise the head; None if none need."""
    pose, body, source = exchange.pose, exchange.target_rig.character, exchange.source
    roles = [
        role for role in _TOP if min(exchange.target_rig.joint(role), exchange.source_rig.joint(role)) >= 0
    ]
    tops, source_tops = body.joints(roles), source.character.joints(roles)
    allowed = np.minimum(exchange.ratios[1] * source.positions[:, source_tops, 1], 0.0)
    if not (pose.places[:, tops, 1] < allowed - _DEEP * body.height).any():
        return None
    start = pose.places[:, spine, None]
    line = pose.places[:, tops] - start
    length = np.maximum(np.linalg.norm(line, axis=-1), 1e-9)
    steep, clear = line[..., 1] / length, (allowed - start[..., 1]) / length
    angle = np.arcsin(np.clip(clear, -1.0, 1.0)) - np.arcsin(np.clip(steep, -1.0, 1.0))
    half = max(1, round(FADE * source.fps / 2))
    around = np.pad(angle.max(axis=1).clip(0.0), half, mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1).max(axis=1)
    raised = rotation.about(
        np.cross(line[:, 0], [0.0, 1.0, 0.0]), smooth(around[:, None], source.fps)[:, 0]
    )
    parent = pose.turned[:, body.skeleton.parents[spine]]
    local = rotation.multiply(raised, pose.turned[:, spine])
    return rotation.multiply(rotation.conjugate(parent), local)
