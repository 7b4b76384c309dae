"""Both bodies and a motion as arrays over the 22 roles of ``body22``.

A body that lacks a spine joint, the neck, a collar bone or a toe has a joint of no length in its place,
which never turns, so that all bodies share one tree.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import contact, facing, rotation, transfer
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.structures import BODY22, reduce

FPS = 30.0
JOINTS = len(BODY22)
PARENTS = (-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 3, 18, 19, 20)
SKELETON = Skeleton(BODY22, np.array(PARENTS), np.zeros((JOINTS, 3)))
FEET = tuple(BODY22.index(f"{side}_{part}") for side in ("left", "right") for part in ("foot", "toe"))
HANDS = tuple(BODY22.index(f"{side}_hand") for side in ("left", "right"))
_OTHER = {"left": "right", "right": "left"}
MIRRORED = tuple(
    BODY22.index("_".join(_OTHER.get(word, word) for word in role.split("_"))) for role in BODY22
)
"""The joint on the other side."""
SMOOTHING = 3.0
"""Frames: standard deviation of the Gaussian over which the facing direction is averaged."""


def unfit(character: Character) -> str:
    """Reason why a body cannot be seen over the 22 roles, as a sentence; "" where it can."""
    try:
        found = RoleBody(character)
        parents = found.parents
    except SkeletonError as error:
        return str(error)
    if character.four_legged:
        return f"{character.name} stands on four legs, and paired knows bodies with two"
    if any(parents[rank] != _present_parent(rank, found.ranks) for rank in found.ranks):
        return f"the joints of {character.name} hang together in another way than paired knows"
    return facing.unknown(character)


def _present_parent(rank: int, present: tuple[int, ...]) -> int:
    parent = PARENTS[rank]
    while parent >= 0 and parent not in present:
        parent = PARENTS[parent]
    return parent


@dataclass(frozen=True, eq=False)
class RoleBody:
    """A body over the 22 roles. Raises SkeletonError where it lacks hips, head, arms or legs."""

    character: Character

    @cached_property
    def aligned(self) -> Aligned:
        """Those of its joints that have one of the roles."""
        return Aligned(self.character, reduce(self.character, "body22").joints)

    @cached_property
    def ranks(self) -> tuple[int, ...]:
        """Which of the 22 each of these joints is."""
        reduced = reduce(self.character, "body22").character
        return tuple(BODY22.index(str(role)) for role in reduced.roles)

    @property
    def parents(self) -> Mapping[int, int]:
        """Role -> role that it hangs from, by their numbers; -1 for the hips."""
        above = self.aligned.skeleton.parents.tolist()
        return {
            rank: self.ranks[parent] if parent >= 0 else -1
            for rank, parent in zip(self.ranks, above, strict=True)
        }

    @cached_property
    def offsets(self) -> np.ndarray:
        """``(22, 3)`` metres: bones in the T-pose; zeros for the hips and for what the body lacks."""
        found = np.zeros((JOINTS, 3), np.float32)
        found[list(self.ranks)] = self.aligned.offsets
        return found

    @property
    def lengths(self) -> np.ndarray:
        """``(2,)`` metres: height of the body, and of its hips."""
        measures = self.character.measures
        return np.array([measures.height, measures.hip_height], np.float32)

    def see(self, motion: Motion) -> dict[str, np.ndarray]:
        """A motion at 30 fps as arrays ``(frames, ...)`` float32.

        rotations: ``(22, 4)`` in aligned form. hips: ``(3,)`` metres. turn: ``(2,)`` where it faces, the
        parts of a unit complex number. planted: ``(4,)`` 1 where ankles and toes rest, by speed.
        """
        local, hips = self.aligned.see(motion)
        rotations = rotation.identity(motion.frames, JOINTS)
        rotations[:, list(self.ranks)] = local
        places = motion.positions
        turn = facing.facing(places, self.character, SMOOTHING)
        planted = np.zeros((motion.frames, len(FEET)))
        for column, role in enumerate(FEET):
            if role in self.ranks:
                joint = self.aligned.joints[self.ranks.index(role)]
                rests = contact.planted(places[:, [joint]], self.character.height, motion.fps)[:, 0]
                planted[:, column] = contact.tidy(rests, 2, 2)
        arrays = {
            "rotations": rotations,
            "hips": hips,
            "turn": np.stack([turn.real, turn.imag], -1),
            "planted": planted,
        }
        return {name: array.astype(np.float32) for name, array in arrays.items()}

    def turned(self, motion: Motion, turned: np.ndarray) -> np.ndarray:
        """``(frames, joints, 4)`` local rotations of the whole body when joints of the 22 roles are turned
        by ``turned`` ``(frames, 22, 4)`` from the reference pose, and others as in ``motion`` from their
        parents."""
        relative = transfer.relative(motion)
        found = np.array(relative)
        rank_of = dict(zip(self.aligned.joints, self.ranks, strict=True))
        for joint, parent in enumerate(self.character.skeleton.parents.tolist()):
            if joint in rank_of:
                found[:, joint] = turned[:, rank_of[joint]]
            elif parent >= 0:
                step = rotation.multiply(rotation.conjugate(relative[:, parent]), relative[:, joint])
                found[:, joint] = rotation.multiply(found[:, parent], step)
        return transfer.from_relative(self.character, found)
