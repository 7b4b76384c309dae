"""Both bodies and a motion as arrays over the 22 roles of ``body22``; see ``motion/body22.py``."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.motion import contact, facing, rotation, transfer
from retarget_bench.motion.body22 import Body22
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.planting.ease import smooth, smoothstep
from retarget_bench.motion.planting.palms import Reach, shared_bones
from retarget_bench.motion.planting.two_bone import rig_of
from retarget_bench.motion.roles import SIDES
from retarget_bench.motion.structures import BODY22

FPS = 30.0
FEET = tuple(BODY22.index(f"{side}_{part}") for side in ("left", "right") for part in ("foot", "toe"))
HANDS = tuple(BODY22.index(f"{side}_hand") for side in ("left", "right"))
_OTHER = {"left": "right", "right": "left"}
MIRRORED = tuple(
    BODY22.index("_".join(_OTHER.get(word, word) for word in role.split("_"))) for role in BODY22
)
"""The joint on the other side."""
SMOOTHING = 3.0
"""Frames: standard deviation of the Gaussian over which the facing direction is averaged."""

TOUCH, CLEAR = 0.06, 0.12
"""Heights from a palm to the middle of what it may touch: near up to the first, clear of it from the
second."""
LOW, HIGH = 0.1, 0.2
"""Heights of a palm above the floor: likewise."""
_SETTLE = 1 / 6
"""Seconds over which the nearness of hands is averaged."""


@dataclass(frozen=True, eq=False)
class RoleBody:
    """A body over the 22 roles. Raises SkeletonError where it lacks hips, head, arms or legs."""

    character: Character

    @cached_property
    def body(self) -> Body22:
        return Body22.of(self.character)

    @cached_property
    def offsets(self) -> np.ndarray:
        """``(22, 3)`` metres: bones in the T-pose; zeros for the hips and for what the body lacks."""
        return self.body.offsets.astype(np.float32)

    @property
    def lengths(self) -> np.ndarray:
        """``(2,)`` metres: height of the body, and of its hips."""
        measures = self.character.measures
        return np.array([measures.height, measures.hip_height], np.float32)

    def see(self, motion: Motion) -> dict[str, np.ndarray]:
        """A motion at 30 fps as arrays ``(frames, ...)`` float32.

        rotations: ``(22, 4)`` in aligned form. hips: ``(3,)`` metres. turn: ``(2,)`` where it faces, the
        parts of a unit complex number. planted: ``(4,)`` 1 where ankles and toes rest, by speed.
        near: ``(2,)`` see ``near``.
        """
        rotations, hips = self.body.see(motion)
        places = motion.positions
        turn = facing.facing(places, self.character, SMOOTHING)
        planted = np.zeros((motion.frames, len(FEET)))
        for column, role in enumerate(FEET):
            if not self.body.lacks[role]:
                joint = self.body.joints[role]
                rests = contact.planted(places[:, [joint]], self.character.height, motion.fps)[:, 0]
                planted[:, column] = contact.tidy(rests, 2, 2)
        arrays = {
            "rotations": rotations,
            "hips": hips,
            "turn": facing.parts(turn),
            "planted": planted,
            "near": near(motion),
        }
        return {name: array.astype(np.float32) for name, array in arrays.items()}

    def turned(self, motion: Motion, turned: np.ndarray) -> np.ndarray:
        """``(frames, joints, 4)`` local rotations of the whole body when joints of the 22 roles are turned
        by ``turned`` ``(frames, 22, 4)`` from the reference pose, and others as in ``motion`` from their
        parents."""
        relative = transfer.relative(motion)
        orientations = np.array(relative)
        rank_of = dict(zip(self.body.present.joints, self.body.ranks, strict=True))
        for joint, parent in enumerate(self.character.skeleton.parents.tolist()):
            if joint in rank_of:
                orientations[:, joint] = turned[:, rank_of[joint]]
            elif parent >= 0:
                step = rotation.multiply(rotation.conjugate(relative[:, parent]), relative[:, joint])
                orientations[:, joint] = rotation.multiply(orientations[:, parent], step)
        return transfer.from_relative(self.character, orientations)


def near(motion: Motion) -> np.ndarray:
    """``(frames, 2)`` 1 where the left and the right palm may touch the own body, the other palm or the
    floor, 0 where they are clear of all, eased in between."""
    body, height = motion.character, motion.character.height
    rig = rig_of(body)
    (bones,), allowed = shared_bones(rig)
    arms = [rig.limbs[side, "arm"] for side in SIDES]

    def closeness(places: np.ndarray, turned: np.ndarray) -> np.ndarray:
        reach = Reach.of(rig, arms, bones, places, turned)
        apart = np.linalg.norm(reach.palms[:, 1] - reach.palms[:, 0], axis=-1)
        out = []
        for hand in (0, 1):
            away = np.linalg.norm(reach.to_bones(hand)[1], axis=-1)
            gap = np.where(allowed[hand] > 0, away, np.inf).min(axis=1, initial=np.inf)
            touching = smoothstep((CLEAR - np.minimum(gap, apart) / height) / (CLEAR - TOUCH))
            leaning = smoothstep((HIGH - reach.palms[:, hand, 1] / height) / (HIGH - LOW))
            out.append(np.maximum(touching, leaning))
        return np.stack(out, axis=1)

    return smooth(
        rotation.in_blocks(closeness, motion.positions, motion.global_rotations), motion.fps, _SETTLE
    )
