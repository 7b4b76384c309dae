"""A body for augmentation: its joints in aligned form, its limbs, its chains, its mirror image.

In aligned form (``motion/aligned.py``) all joint frames are parallel to the world in the reference pose, so
that a local rotation means the same on every body. Here all joints of a body have it, those above the hips
and those without a role too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.roles import SIDES, ancestors, body_part, is_finger, is_tip

LOPSIDED = 0.02
"""Body heights: a body is no mirror image of itself where a bone is so far from the other side's."""


@dataclass(frozen=True, eq=False)
class AugmentedBody:
    """A character for augmentation. Arrays with a row per joint are in the order of its skeleton."""

    character: Character

    def see(self, motion: Motion) -> np.ndarray:
        """``(frames, joints, 4)`` local rotations of a motion of this body, in aligned form, signs
        continuous along time."""
        turned = rotation.multiply(self.above, motion.rotations)
        return rotation.continuous(rotation.multiply(turned, rotation.conjugate(self.own)))

    @property
    def own(self) -> np.ndarray:
        """``(joints, 4)`` world orientations in the reference pose."""
        return self.character.reference_globals

    @cached_property
    def above(self) -> np.ndarray:
        """``(joints, 4)`` those of the parents; the identity for the root."""
        orientations = self.own[self.parents]
        orientations[0] = rotation.identity()
        return orientations

    @property
    def parents(self) -> np.ndarray:
        return self.character.skeleton.parents

    @cached_property
    def offsets(self) -> np.ndarray:
        """``(joints, 3)`` metres: bones in the reference pose; zero for the root."""
        places = self.character.reference_places
        offsets = places - places[self.parents]
        offsets[0] = 0.0
        return offsets

    # ------------------------------------------------------------------------------------ what turns
    @cached_property
    def chains(self) -> np.ndarray:
        """``(joints,)`` the number of the chain that a joint turns with, -1 for those that do not turn.

        A spine, a neck, a tail and each finger are chains, all other joints with a role are alone. Tips,
        whose turns nobody sees, and joints without a role do not turn.
        """
        numbers: dict[str, int] = {}
        chains = np.full(len(self.parents), -1)
        for joint, role in enumerate(self.character.roles):
            if role is not None and not is_tip(role):
                chains[joint] = numbers.setdefault(_chain(role), len(numbers))
        return chains

    @cached_property
    def links(self) -> np.ndarray:
        """``(chains,)`` how many joints each chain has."""
        return np.bincount(self.chains[self.chains >= 0])

    @cached_property
    def limbs(self) -> Mapping[str, tuple[tuple[str, ...], np.ndarray]]:
        """Body part -> the roles of its joints, sorted, and these joints; the hips are of none."""
        limbs: dict[str, dict[str, int]] = {}
        for role, joint in sorted(self.character.joint_of.items()):
            if role != "hips":
                limbs.setdefault(body_part(role), {})[role] = joint
        return {part: (tuple(joints), np.array([*joints.values()])) for part, joints in limbs.items()}

    # ------------------------------------------------------------------------------- the mirror image
    @cached_property
    def mirror(self) -> np.ndarray | None:
        """``(joints,)`` the joint that each is the mirror image of; None where the sides differ.

        Sides are told by roles; joints without a role belong together by what they carry and where they
        are. Joints without a role that carry none (props) may be on one side only, and stay there.
        """
        image = {0: 0}
        for joint, parent in enumerate(self.parents.tolist()):
            if parent < 0:
                continue
            used = image.values()
            there = self.character.skeleton.children[image[parent]]
            fitting = [each for each in there if each not in used and self._alike(joint, each)]
            if fitting:
                image[joint] = min(fitting, key=lambda each: self._apart(joint, each))
            elif self._below[joint]:
                return None
            else:
                image[joint] = joint
        order = np.array([image[joint] for joint in range(len(self.parents))])
        counts = [joint for joint, below in enumerate(self._below) if joint and below]
        apart = max((self._apart(joint, image[joint]) for joint in counts), default=0.0)
        lopsided = apart > LOPSIDED * self.character.height
        return None if lopsided or (order[order] != np.arange(len(order))).any() else order

    def _alike(self, joint: int, other: int) -> bool:
        """True where one carries the roles that the other does, of the other side."""
        return {_other_side(role) for role in self._below[joint]} == self._below[other]

    def _apart(self, joint: int, other: int) -> float:
        """Metres from the end of the mirror image of one's bone to that of the other's."""
        return float(np.linalg.norm(self.offsets[joint] * (-1.0, 1.0, 1.0) - self.offsets[other]))

    @cached_property
    def _below(self) -> Sequence[frozenset[str]]:
        """Per joint the roles at and below it."""
        roles_below: list[set[str]] = [set() for _ in self.parents]
        for role, joint in self.character.joint_of.items():
            for each in (joint, *ancestors(self.character.skeleton, joint)):
                roles_below[each].add(role)
        return [frozenset(each) for each in roles_below]


def _chain(role: str) -> str:
    numbered = is_finger(role) or role.startswith(("spine_", "neck_", "tail_"))
    return role.rsplit("_", 1)[0] if numbered else role


def _other_side(role: str) -> str:
    side, _, part = role.partition("_")
    return f"{SIDES[side == SIDES[0]]}_{part}" if side in SIDES else role
