"""Starts that do not belong to the motion: a T-pose, a rest pose, or a body that is elsewhere at once."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, Self

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion import facing, rotation
from retarget_bench.motion.character import Motion, Prediction, Surface
from retarget_bench.motion.editing.rigid import moved
from retarget_bench.motion.planting.cuts import takes
from retarget_bench.motion.planting.ease import smoothstep
from retarget_bench.motion.roles import LIMB_ROLES

Starts = Literal["keep", "cut", "ease"]

T_POSE, REST = "T-pose", "rest pose"
"""Poses that motions do not begin in."""
_BRIEF = 1.0
"""Seconds: what lasts no longer before a cut is a start, whatever it is."""
_T_POSE = np.radians(15.0)
"""Each bone of arms and legs of a body in T-pose is this near to it, ..."""
_HELD_POSE, _STILL, _HELD, _FEW = np.radians(40.0), np.radians(8.0), 0.5, 3
"""... or this near while all stay within ``_STILL`` for ``_HELD`` seconds and ``_FEW`` frames: actors hold
their arms lower and forward, and stand with legs apart."""
_AT_REST, _DOWN = np.radians(3.0), np.radians(65.0)
"""A body is in its rest pose while all joints are this near to it. Where arms are this far from the T-pose
they hang, and the pose is as good as any other to begin with."""
_LEAVING, _AGAIN = 2.0, 0.1
"""Seconds that leaving a T-pose takes at most, and within which the body moves on from it."""
_BLEND = 0.5
"""Seconds over which ``eased`` blends."""


@dataclass(frozen=True)
class Start:
    """A start that does not belong to the motion.

    frames: how many. cuts: the frames at which the body is elsewhere at once, up to ``frames``.
    jump:   metres that joints move on average at the greatest of these; 0 without one.
    t_pose: the motion begins in a T-pose, which is left by a cut or smoothly.
    held:   "", or the pose that is held in front of the motion, after the last cut, and left smoothly: a
            ``T-pose`` or the ``rest pose``.
    """

    frames: int
    cuts: tuple[int, ...]
    jump: float
    t_pose: bool
    held: str = ""

    def __str__(self) -> str:
        parts, cut = [], self.cuts[-1] if self.cuts else 0
        if cut:
            pose = f"{'is' if cut == 1 else 'are'} {'in a T-pose' if self.t_pose else 'elsewhere'}"
            parts = [
                f"the first {_frames(cut)} {pose}, and joints are {self.jump:.2f} m away a frame later"
            ]
        if self.held:
            verbs = ("holds", "leaves") if self.frames - cut == 1 else ("hold", "leave")
            which = f"the {'next' if cut else 'first'} {_frames(self.frames - cut)}"
            parts.append(f"{which} {verbs[0]} a {self.held} and {verbs[1]} it")
        return "; ".join(parts)

    @property
    def options(self) -> tuple[str, ...]:
        """The options for another start: a pose that is left smoothly can only be cut off."""
        return ("start=cut", "start=ease") if self.cuts else ("start=cut",)


def _frames(count: int) -> str:
    return "frame" if count == 1 else f"{count} frames"


def find(source: Prediction) -> Start | None:
    """The start of a motion that does not belong to it; None where there is none.

    A cut (``planting.cuts``) ends a start that lasts no longer than a second, or that is a T-pose. A T-pose
    or rest pose that is left smoothly lasts until the body no longer moves away from it. A motion that is
    in such a pose throughout has no such start.
    """
    if isinstance(source, Surface) or source.frames < 3:
        return None
    poses = _Poses.of(source)
    cuts: list[int] = []
    for piece in takes(source)[:-1]:
        if piece.stop > _BRIEF * source.fps and poses.held(piece.start)[0] < piece.stop:
            break
        cuts.append(piece.stop)
    first = cuts[-1] if cuts else 0
    left, held = poses.left(first)
    while left < source.frames and (later := poses.left(left)[0]) > left:
        left = later
    if left == source.frames:
        left, held = first, ""
    if not left:
        return None
    steps = [
        np.linalg.norm(source.positions[cut] - source.positions[cut - 1], axis=-1).mean() for cut in cuts
    ]
    t_pose = poses.held(0)[1] == T_POSE
    return Start(left, tuple(cuts), float(max(steps, default=0.0)), t_pose, held)


@dataclass(frozen=True, eq=False)
class _Poses:
    """Distances of a motion from the T-pose and from its rest pose.

    bones:   ``(frames, bones, 3)`` unit, of arms and legs, as seen from where the body faces.
    away:    ``(frames,)`` radians, as of ``from_t_pose``.
    resting: ``(frames,)`` bool: all joints are at rest, in a pose that nobody stands in.
    """

    bones: np.ndarray
    away: np.ndarray
    resting: np.ndarray
    fps: float

    @classmethod
    def of(cls, source: Prediction) -> Self:
        bones, reference = limb_directions(source)
        away = _from(bones, reference)
        return cls(bones, away, _resting(source, away), source.fps)

    def held(self, first: int) -> tuple[int, str]:
        """The frame before which the pose at frame ``first`` ends that does not belong to the motion, and
        which one it is; ``first`` itself and "" where it is none."""
        away, enough = self.away[first:], max(_HELD * self.fps, _FEW)
        still = _from(self.bones[first:], self.bones[first]) <= _STILL
        held, resting = _run(still & (away <= _HELD_POSE)), _run(self.resting[first:])
        lasts = {
            T_POSE: max(_run(away <= _T_POSE), held if held >= enough else 0),
            REST: resting if resting >= enough else 0,
        }
        name = max(lasts, key=lasts.__getitem__)
        return first + lasts[name], name if lasts[name] else ""

    def left(self, first: int) -> tuple[int, str]:
        """Likewise the frame in which the body no longer moves away from that pose, or all frames."""
        at, name = self.held(first)
        later = max(1, round(_AGAIN * self.fps))
        if at == first or at == len(self.away):
            return at, name
        away = self.away if name == T_POSE else _from(self.bones, self.bones[at - 1])
        for frame in range(at, min(at + round(_LEAVING * self.fps), len(away) - later)):
            if away[frame : frame + later + 1].max() <= away[frame]:
                return frame, name
        return at, name


def from_t_pose(source: Prediction) -> np.ndarray:
    """``(frames,)`` radians: how far the bone of arms and legs that is farthest from the T-pose is from it.

    Infinite for bodies that do not have both arms and legs of two bones, or that stand on four legs.
    """
    return _from(*limb_directions(source))


def limb_directions(source: Prediction) -> tuple[np.ndarray, np.ndarray]:
    """``(frames, bones, 3)`` unit vectors along the bones of arms and legs, as seen from the body's facing,
    and ``(bones, 3)`` those of the T-pose; no bones of bodies that have no T-pose (``from_t_pose``)."""
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
        return np.zeros((source.frames, 0, 3)), np.zeros((0, 3))
    upper, lower = np.array(bones).T
    turn = facing.rotation(facing.facing(source.positions, body).conj())[:, None]
    directions = rotation.rotate(turn, source.positions[:, lower] - source.positions[:, upper])
    return rotation.unit(directions), rotation.unit(
        body.reference_places[lower] - body.reference_places[upper]
    )


def _from(bones: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """``(frames,)`` radians between the bones ``(frames, bones, 3)`` and ``(bones, 3)`` that differ most;
    infinite without bones."""
    across = np.linalg.norm(np.cross(bones, reference), axis=-1)
    angles = np.arctan2(across, (bones * reference).sum(axis=-1))
    return np.asarray(angles.max(axis=1)) if bones.shape[1] else np.full(len(bones), np.inf)


def _resting(source: Prediction, away: np.ndarray) -> np.ndarray:
    """``(frames,)`` bool: all joints are as at rest, with arms that do not hang."""
    if not isinstance(source, Motion):
        return np.zeros(source.frames, dtype=bool)
    least = np.abs(source.rotations[:, 1:, 0]).min(axis=1, initial=1.0)  # cosine of half the angle
    return np.asarray((least >= np.cos(_AT_REST / 2)) & (away <= _DOWN))


def _run(flags: np.ndarray) -> int:
    """The number of flags before the first that is not set."""
    return len(flags) if flags.all() else int(np.argmin(flags))


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
