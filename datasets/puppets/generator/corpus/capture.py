"""Noise of motion capture on a source: what a recording has beside the motion that was performed.

One leg, drawn for each clip and body, was measured too long when the body was calibrated, and its foot
sinks into the floor while it stands, by bending that leg. All joints jitter from frame to frame.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.contact import planted
from retarget_bench.motion.measures import measure
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.ease import smooth
from retarget_bench.motion.planting.two_bone import Pose, bend, rig_of

from ..conventions import SIDES
from ..randomness import Stream

TOO_LONG = 1.02
"""Times its length: thigh and shank of the leg that was measured wrongly."""
SUNK = 0.01
"""Metres, of its ankle, while that is at rest."""
_EASE = 0.3
"""Seconds over which it sinks and rises."""
_ROOT, _BONES = 0.0006, 0.00036
"""Metres, in each direction: standard deviations of the jitter of the root, and of a bone's end about its
beginning. Along the chains this adds up to 1 to 2 mm of every joint."""


def captured(motion: Motion, stream: Stream) -> Motion:
    """The motion as a recording would have it: on a body with another leg. Rotations are fitted to where
    that foot went; ``motion`` stays as it is."""
    side = stream.choice(SIDES)
    body = _calibrated(motion.character, side)
    leg, fps = rig_of(body).limbs[side, "leg"], motion.fps
    pose = Pose.of(body.motion(motion.rotations.copy(), motion.root.copy(), fps))
    ankle = motion.positions[:, leg.end]
    rests = planted(ankle[:, None], motion.character.height, fps).astype(float)
    goal = ankle - SUNK * smooth(rests, fps, _EASE) * np.array([0.0, 1.0, 0.0])
    bend(body, pose, leg, goal, motion.global_rotations[:, leg.end], fps)
    return _jittered(body.motion(pose.rotations, pose.root, fps), stream)


@lru_cache(maxsize=256)
def _calibrated(body: Character, side: str) -> Character:
    """The body with one leg too long. Its surface stays that of the performer."""
    offsets = body.skeleton.offsets.copy()
    offsets[body.joints([f"{side}_leg", f"{side}_foot"])] *= TOO_LONG
    skeleton = replace(body.skeleton, offsets=offsets)
    return replace(body, skeleton=skeleton, measures=measure(skeleton, body.roles, body.reference_pose))


def _jittered(motion: Motion, stream: Stream) -> Motion:
    """White noise on the root and on how every bone is turned; joints that have no part of their own in the
    motion turn as their parents do."""
    skeleton, body = motion.skeleton, motion.character
    noise = stream.normals(motion.frames, len(skeleton), 3)
    for joint, (parent, lever, role) in enumerate(
        zip(skeleton.parents, _levers(body), body.roles, strict=True)
    ):
        own = role is not None and lever > 0.0
        noise[:, joint] = _BONES / lever * noise[:, joint] if own else noise[:, parent]
    turned = rotation.multiply(rotation.from_rotation_vector(noise), motion.global_rotations)
    local = rotation.normalise(kinematics.local_from_global(skeleton, turned))
    root = motion.root + _ROOT * stream.normals(motion.frames, 3)
    return body.motion(rotation.continuous(local), root, motion.fps)


def _levers(body: Character) -> list[float]:
    """Metres from each joint to the farthest end of a bone that leaves it; 0 where none does."""
    levers = [0.0] * len(body.skeleton)
    ends = [(site.parent, np.linalg.norm(site.offset)) for site in body.skeleton.end_sites]
    bones = zip(body.skeleton.parents.tolist(), body.skeleton.bone_lengths, strict=True)
    for joint, long in [*(bone for bone in bones if bone[0] >= 0), *ends]:
        levers[joint] = max(levers[joint], float(long))
    return levers
