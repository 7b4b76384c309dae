"""Bodies over the 22 roles of ``body22``, whatever joints they have.

A body that lacks a spine joint, the neck, a collar bone or a toe has a joint of no length in its place,
which does not turn, so that all bodies share one tree and networks that know one joint set answer for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import facing, root_rules, rotation
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.rotation import Array
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.structures import BODY22, Reduction, reduce

JOINTS = len(BODY22)
PARENTS = (-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 3, 18, 19, 20)
"""Parents of the 22 joints, as NKN's published code has them."""
SKELETON = Skeleton(BODY22, np.array(PARENTS), np.zeros((JOINTS, 3)))


def unfit(character: Character, method: str) -> str:
    """Reason why a method that sees bodies over the 22 roles, in hip heights and from where they face,
    cannot take this one, as a sentence; "" where it can."""
    body = Body22.of(character)
    try:
        above = body.present.skeleton.parents.tolist()
    except SkeletonError as error:
        return str(error)
    if character.four_legged:
        return f"{character.name} stands on four legs, and {method} knows bodies with two"
    for rank, parent in zip(body.ranks, above, strict=True):
        if (body.ranks[parent] if parent >= 0 else -1) != body.present_parent(rank):
            return f"the joints of {character.name} hang together in another way than {method} knows"
    return facing.unknown(character) or root_rules.reason("hip_height", character, character) or ""


@dataclass(frozen=True, eq=False)
class Body22:
    """A body over the 22 roles, in the aligned form (see ``aligned.py``).

    Its properties raise SkeletonError where it lacks hips, head, arms or legs.
    """

    character: Character

    @classmethod
    @lru_cache(maxsize=1024)
    def of(cls, character: Character) -> Self:
        """The body of a character, the same every time."""
        return cls(character)

    @cached_property
    def present(self) -> Aligned:
        """Those of its joints that have one of the roles, in the order of the 22."""
        return Aligned(self.character, self._reduction.joints)

    @cached_property
    def ranks(self) -> tuple[int, ...]:
        """Place among the 22 of each of these joints."""
        return tuple(BODY22.index(str(role)) for role in self._reduction.character.roles)

    @cached_property
    def _reduction(self) -> Reduction:
        return reduce(self.character, "body22")

    @cached_property
    def lacks(self) -> np.ndarray:
        """``(22,)`` bool: True where the body has a joint of no length instead."""
        return np.asarray(~np.isin(np.arange(JOINTS), self.ranks))

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """``(22,)`` the character's joint where each of the 22 is."""
        own = dict(zip(self.ranks, self.present.joints, strict=True))
        return tuple(own.get(rank, own.get(self.present_parent(rank), -1)) for rank in range(JOINTS))

    def present_parent(self, rank: int) -> int:
        """The nearest of the 22 above that the body has; -1 for the hips."""
        parent = PARENTS[rank]
        while parent >= 0 and parent not in self.ranks:
            parent = PARENTS[parent]
        return parent

    @cached_property
    def skeleton(self) -> Skeleton:
        """The 22 joints with the bones of the reference pose, of no length where the body lacks a joint."""
        offsets = np.zeros((JOINTS, 3))
        offsets[list(self.ranks)] = self.present.offsets
        return Skeleton(BODY22, np.array(PARENTS), offsets)

    @property
    def offsets(self) -> np.ndarray:
        """``(22, 3)`` metres: bones in the reference pose; zeros for the hips and for what it lacks."""
        return self.skeleton.offsets

    def see(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Local rotations ``(frames, 22, 4)``, the identity where the body lacks a joint, and places of the
        hips ``(frames, 3)`` metres; see ``Aligned.see``."""
        local, hips = self.present.see(motion)
        rotations = rotation.identity(motion.frames, JOINTS)
        rotations[:, list(self.ranks)] = local
        return rotations, hips

    def motion(self, rotations: np.ndarray, hips: np.ndarray, fps: float) -> Motion:
        """The whole body's motion from rotations ``(frames, 22, 4)``, folded; see ``Aligned.motion``."""
        return self.present.motion(folded(rotations, self.lacks)[:, list(self.ranks)], hips, fps)


def folded(rotations: Array, lacks: Array, lacking: Sequence[int] | None = None) -> Array:
    """Rotations in which joints of no length do not turn and all others are oriented as before: what hangs
    from a joint of no length turns by both. Without such joints they are returned as they are.

    rotations: ``(..., 22, 4)`` unit. lacks: ``(..., 22)`` bool, broadcast: which joints are of no length.
    lacking: ranks that any row lacks, increasing; None: they are looked for, which waits for a GPU.
    """
    if lacking is None:
        anywhere: Any = lacks.reshape(-1, JOINTS).any(0)
        lacking = [rank for rank, missing in enumerate(anywhere.tolist()) if missing]
    if not lacking:
        return rotations
    parts = [rotations[..., rank, :] for rank in range(JOINTS)]
    for rank in lacking:  # parents first, so that what is handed on is handed on again
        missing, turn = lacks[..., rank], parts[rank]
        for child in (child for child, parent in enumerate(PARENTS) if parent == rank):
            both = rotation.multiply(turn, parts[child])
            parts[child] = rotation.where(missing, both, parts[child])
        parts[rank] = rotation.where(
            missing, rotation.normalise(0 * turn), turn
        )  # zero becomes the identity
    return rotation.stacked(parts)
