"""Starts that do not belong to the motion: a T-pose, or a body that is elsewhere a frame later."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.character import Motion, Prediction, Surface
from retarget_bench.motion.editing.rigid import moved
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.planting.ease import smoothstep
from retarget_bench.motion.roles import LIMB_ROLES

Starts = Literal["keep", "cut", "ease"]

_BRIEF = 1.0
"""Seconds: what lasts no longer before a cut is a start, whatever it is."""
_T_POSE = np.radians(15.0)
"""Each bone of arms and legs of a body in T-pose is this near to it."""
_LEAVING, _AGAIN = 2.0, 0.1
"""Seconds that leaving a T-pose takes at most, and within which the body moves on from it."""
_BLEND = 0.5
"""Seconds over which ``eased`` blends."""


@dataclass(frozen=True)
class Start:
    """What a motion begins with that does not belong to it.

    frames: how many. cuts: the frames at which the body is elsewhere at once, up to ``frames``.
    jump:   metres that joints move on average at the greatest of these; 0 without one.
    t_pose: the motion begins in a T-pose, which is left by a cut or smoothly.
    """

    frames: int
    cuts: tuple[int, ...]
    jump: float
    t_pose: bool

    def __str__(self) -> str:
        first = "frame" if self.frames == 1 else f"{self.frames} frames"
        verb = "is" if self.frames == 1 else "are"
        pose = f"the first {first} {verb} " + ("in a T-pose" if self.t_pose else "elsewhere")
        if not self.cuts:
            return f"{pose}, which the body then leaves"
        return f"{pose}, and joints are {self.jump:.2f} m away a frame later"


def find(source: Prediction) -> Start | None:
    """The start of a motion that does not belong to it; None where there is none.

    A cut (``planting.cuts``) ends a start that lasts no longer than a second, or that is a T-pose. A T-pose
    that is left smoothly lasts until the body no longer moves away from it. A motion that is in T-pose
    throughout has no such start.
    """
    if isinstance(source, Surface) or source.frames < 3:
        return None
    away = from_t_pose(source)
    posed = away <= _T_POSE
    cuts: list[int] = []
    for piece in takes(source)[:-1]:
        if piece.stop > _BRIEF * source.fps and not posed[piece].all():
            break
        cuts.append(piece.stop)
    first = cuts[-1] if cuts else 0
    left = first + _left(away[first:], source.fps)
    if left == source.frames:
        left = first
    if not left:
        return None
    steps = [
        np.linalg.norm(source.positions[cut] - source.positions[cut - 1], axis=-1).mean() for cut in cuts
    ]
    return Start(left, tuple(cuts), float(max(steps, default=0.0)), bool(posed[0]))


def from_t_pose(source: Prediction) -> np.ndarray:
    """``(frames,)`` radians: how far the bone of arms and legs that is farthest from the T-pose is from it.

    Infinite for bodies that do not have both arms and legs of two bones, or that stand on four legs.
    """
    body = source.character
    bones = [
        (body.joint_of[high], body.joint_of[low])
        for limb in LIMB_ROLES.values()
        for high, low in pairwise(
            role for role in limb if not role.endswith(("shoulder", "toe", "toe_end"))
        )
        if high in body.joint_of and low in body.joint_of
    ]
    if len(bones) < 8 or body.four_legged:
        return np.full(source.frames, np.inf)
    upper, lower = np.array(bones).T
    seen = source.positions[:, lower] - source.positions[:, upper]
    wanted = body.reference_places[lower] - body.reference_places[upper]
    turn = facing.rotation(facing.facing(source.positions, body))
    wanted = rotation.rotate(turn[:, None], np.broadcast_to(wanted, seen.shape))
    across = np.linalg.norm(np.cross(seen, wanted), axis=-1)
    return np.asarray(np.arctan2(across, (seen * wanted).sum(axis=-1)).max(axis=1))


def _left(away: np.ndarray, fps: float) -> int:
    """The frame in which a T-pose at the start is left: 0 without one, all frames where it never is."""
    outside = np.flatnonzero(away > _T_POSE)
    if not outside.size:
        return len(away)
    at, later = int(outside[0]), max(1, round(_AGAIN * fps))
    if at == 0:
        return 0
    for frame in range(at, min(at + round(_LEAVING * fps), len(away) - later)):
        if away[frame : frame + later + 1].max() <= away[frame]:
            return frame
    return at


def cut(source: Prediction, start: Start) -> Prediction:
    """The motion without its start."""
    return source.at(slice(start.frames, None))


def eased(source: Prediction, start: Start) -> Motion:
    """The motion with a start that leads into it: as many frames, and no jump.

    What comes before a cut is brought to where the motion goes on, turned the same way, its feet as high.
    From there half a second of the motion is blended in. A T-pose that is left smoothly stays.
    Raises NotSupported for a motion without rotations.
    """
    if not isinstance(source, Motion):
        raise NotSupported("a start can be eased where the motion has rotations; cut it instead")
    for at in reversed(start.cuts):
        source = _joined(source, at)
    return source


def _joined(motion: Motion, at: int) -> Motion:
    """The motion without the jump before frame ``at``."""
    body, last = motion.character, at - 1
    ends = facing.facing(motion.positions[[last, at]], body)
    angle = float(np.angle(ends[1] / ends[0]))
    feet = [joint for role, joint in body.joint_of.items() if role.endswith(("_foot", "_toe", "_toe_end"))]
    low = motion.positions[[last, at]][:, feet or [0], 1].min(axis=1)
    shift = motion.root[at] - motion.root[last]
    shift[1] = low[1] - low[0]
    before = moved(motion.at(slice(0, at)), angle, motion.root[last], shift)
    fade = min(round(_BLEND * motion.fps), motion.frames - at)
    share = smoothstep(np.arange(1, fade + 1) / (fade + 1))
    blend = slice(at, at + fade)
    root, rotations = np.array(motion.root), np.array(motion.rotations)
    root[:at], rotations[:at] = before.root, before.rotations
    root[blend] = before.root[-1] + share[:, None] * (root[blend] - before.root[-1])
    held = np.broadcast_to(before.rotations[-1], rotations[blend].shape)
    rotations[blend] = rotation.slerp(held, rotations[blend], share[:, None])
    return body.motion(rotation.continuous(rotations), root, motion.fps)
