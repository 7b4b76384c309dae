"""Clips that can be played in a loop: first and last frame agree but for a step of the body as a whole.

That step, a turn about the vertical axis and a shift on the floor, is what one period travels.
"""

import math
from dataclasses import dataclass

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body import UP
from retarget_bench.motion.character import Motion
from retarget_bench.motion.editing.rigid import heading, moved
from retarget_bench.motion.planting.ease import FADE, smoothstep

ANGLE, HEIGHT = np.radians(2.0), 0.01
"""A loop's ends differ by less: radians of every joint, body heights of the root."""
_REACH = 1.0
"""Seconds over which methods smooth, and over which a loop is continued for them on either side."""
_SLACK = 1e-6
"""Radians, and metres, that make no difference."""


@dataclass(frozen=True)
class Gap:
    """The difference of the last frame from the first, without the body's step.

    joints: ``(joints, 3)`` rotation vectors of local rotations, ``last = first * exp(.)``; the root's is
            its tilt in the world, ``last = step * exp(.) * first``.
    height: metres of the root. step: radians about the vertical axis, left turns are positive.
    """

    joints: np.ndarray
    height: float
    step: float

    @property
    def angle(self) -> float:
        """Radians of the joint that differs most."""
        return float(np.linalg.norm(self.joints, axis=-1).max())


def gap(motion: Motion) -> Gap:
    """The gap between the ends of a motion, which has a frame at least."""
    first, last = motion.rotations[0], motion.rotations[-1]
    joints = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(first), last))
    turn = rotation.multiply(last[0], rotation.conjugate(first[0]))
    step = float(heading(turn))
    joints[0] = rotation.to_rotation_vector(rotation.multiply(rotation.about(UP, -step), turn))
    return Gap(joints, float(motion.root[-1, 1] - motion.root[0, 1]), step)


def is_loop(motion: Motion) -> bool:
    """True where the ends agree within ``ANGLE`` and ``HEIGHT``."""
    if motion.frames < 3:
        return False
    ends = gap(motion)
    return ends.angle < ANGLE and abs(ends.height) < HEIGHT * motion.character.height


def agrees(result: Motion, source: Motion) -> bool:
    """True where the ends of a result agree at least as well as those of its source."""
    result_gap, source_gap = gap(result), gap(source)
    level = abs(source_gap.height) * result.character.height / max(source.character.height, 1e-9)
    return result_gap.angle <= source_gap.angle + _SLACK and abs(result_gap.height) <= level + _SLACK


def resampled(motion: Motion, fps: float) -> Motion:
    """The motion at another rate. A loop stays one: its length is rounded to whole frames, by half a frame
    of the new rate at most. Raises SkeletonError for a rate that is none."""
    if not (is_loop(motion) and np.isfinite(fps) and fps > 0):
        return Motion.resample(motion, fps)
    periods = motion.frames - 1
    steps = max(1, math.ceil(periods * fps / motion.fps - 0.5 - 1e-9))
    at = np.arange(steps + 1) * (periods / steps)
    low = np.minimum(np.floor(at + 1e-9).astype(int), periods)
    return motion.between(low, np.clip(at - low, 0.0, 1.0) * (at - low > 1e-9), fps)


# ---------------------------------------------------------------------------------------- going on
def continued(motion: Motion) -> tuple[Motion, slice]:
    """A loop that goes on for a second or more before and after, and its own frames in it."""
    periods = motion.frames - 1
    more = -(-max(1, round(_REACH * motion.fps)) // periods)
    pieces = [
        *(_period(motion, -number).at(slice(0, periods)) for number in range(more, 0, -1)),
        motion,
        *(_period(motion, number).at(slice(1, None)) for number in range(1, more + 1)),
    ]
    rotations, root = (np.concatenate([getattr(each, name) for each in pieces]) for name in Motion.arrays)
    extended = motion.character.motion(rotation.continuous(rotations), root, motion.fps)
    return extended, slice(more * periods, more * periods + motion.frames)


def _period(motion: Motion, number: int) -> Motion:
    """The loop so many periods later."""
    step, ends = gap(motion).step, motion.root[[0, -1]] * [1.0, 0.0, 1.0]
    turn, way = np.exp(1j * step), complex(*(ends[1] - ends[0])[[2, 0]])
    there = sum((way * turn**k for k in range(number)), 0j)
    if number < 0:
        there = -sum((way * turn**-k for k in range(1, -number + 1)), 0j)
    return moved(motion, number * step, ends[0], np.array([there.imag, 0.0, there.real]))


# ------------------------------------------------------------------------------------------ closing
def closed(motion: Motion) -> Motion:
    """The motion with ends that agree exactly: each is changed by half of the gap, eased over a third of a
    second, or over half of the motion where it is shorter."""
    if motion.frames < 3:
        return motion
    ends, frames = gap(motion), motion.frames
    fade = min(FADE * motion.fps, (frames - 1) / 2)
    at = np.arange(frames)
    early = (0.5 * (1.0 - smoothstep(at / fade)))[:, None]
    late = (0.5 * (1.0 - smoothstep((frames - 1 - at) / fade)))[:, None]
    share = (early - late)[..., None]
    change = rotation.from_rotation_vector(share * ends.joints)
    rotations = rotation.multiply(motion.rotations, change)
    later = rotation.rotate(rotation.about(UP, ends.step), ends.joints[0])
    tilt = rotation.from_rotation_vector(early * ends.joints[0] - late * later)
    rotations[:, 0] = rotation.multiply(tilt, motion.rotations[:, 0])
    root = np.array(motion.root)
    root[:, 1] += (early - late)[:, 0] * ends.height
    return motion.character.motion(rotation.normalise(rotations), root, motion.fps)
