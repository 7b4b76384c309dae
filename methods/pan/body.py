"""A character as a trained structure sees it, whether or not it is of that structure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.api.comparison import body_joints
from retarget_bench.motion import alignment, kinematics, rotation
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton

from .layout import Layout


@lru_cache(maxsize=1024)
def own(character: Character) -> Aligned:
    """The joints that position errors count, those at and below the hips. Raises SkeletonError where the
    character has no hips or nothing below them."""
    return Aligned(character, body_joints(character))


@dataclass(frozen=True, eq=False)
class Body:
    """A character's joints in the places of a layout's.

    joints: ``(joints of the layout,)`` the character's, -1 where it has none: there the layout has a bone
            of no length that does not turn (section 6.2.3).
    """

    character: Character
    layout: Layout
    joints: tuple[int, ...]

    @cached_property
    def places(self) -> np.ndarray:
        """``(joints, 3)`` metres, in the reference pose, relative to the hips."""
        skeleton, pose = self.character.skeleton, self.character.reference_pose
        known = kinematics.forward(skeleton, pose, np.zeros(3))[0]
        found = np.zeros((len(self.joints), 3))
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            found[rank] = known[joint] - known[self.joints[0]] if joint >= 0 else found[parent]
        return found

    @cached_property
    def bones(self) -> np.ndarray:
        """``(slots, 3)`` metres: the bone that each slot turns, in the reference pose."""
        return self.places[1:] - self.places[self.layout.turned]

    @cached_property
    def skeleton(self) -> Skeleton:
        """The layout as a tree with these bones."""
        names = tuple(str(rank) for rank in range(len(self.joints)))
        offsets = np.concatenate([np.zeros((1, 3)), self.bones])
        return Skeleton(names, np.array(self.layout.parents), offsets)

    @cached_property
    def chains(self) -> Skeleton:
        """The tree that turns slot by slot, every slot on its own: the hips, then per slot the joint that
        it leaves, then the ends of the slots from whose child no slot leaves.

        Joint 0 does not turn, joint s + 1 is turned by slot s, the ends do not turn."""
        above, ends = self.layout.above, self.layout.ends
        parents = np.concatenate([[-1], above + 1, ends + 1])
        bones = np.concatenate([self.bones, np.zeros((1, 3))])  # row -1: of the hips
        offsets = np.concatenate([np.zeros((1, 3)), bones[above], self.bones[ends]])
        return Skeleton(tuple(str(n) for n in range(len(parents))), parents, offsets)

    def see(self, motion: Motion, turn: np.ndarray | None) -> np.ndarray:
        """``(frames, slots, 4)`` rotations that slots carry, seen from ``turn`` ``(frames, 4)`` (a rotation
        about the vertical axis), signs continuous along time."""
        known = alignment.relative(motion)
        turned = np.empty((len(known), len(self.joints), 4))
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            turned[:, rank] = known[:, joint] if joint >= 0 else turned[:, parent]
        if turn is not None:
            turned = rotation.multiply(rotation.conjugate(turn)[:, None], turned)
        local = rotation.normalise(kinematics.local_from_global(self.skeleton, turned))
        local = rotation.continuous(local)[:, self.layout.turned]
        return local * np.where(local[:1, :, :1] < 0.0, -1.0, 1.0)

    def motion(
        self,
        slots: np.ndarray,
        turn: np.ndarray | None,
        hips: np.ndarray,
        fps: float,
        ends: np.ndarray | None = None,
    ) -> Motion:
        """The whole body's motion: the inverse of ``see``.

        A joint that several slots leave is turned by their mean; what hangs below keeps its orientation.
        slots: ``(frames, slots, 4)``. hips: ``(frames, 3)`` metres.
        ends:  ``(frames, joints, 4)`` local rotations of joints that no slot leaves; None: at rest.
        """
        turned = self._orientations(rotation.normalise(slots), ends)
        if turn is not None:
            turned = rotation.multiply(turn[:, None], turned)
        ranks = [rank for rank, joint in enumerate(self.joints) if joint >= 0]
        aligned = Aligned(self.character, tuple(self.joints[rank] for rank in ranks))
        local = kinematics.local_from_global(aligned.skeleton, turned[:, ranks])
        return aligned.motion(rotation.normalise(local), hips, fps)

    def _orientations(self, slots: np.ndarray, ends: np.ndarray | None) -> np.ndarray:
        """``(frames, joints, 4)`` of the layout's joints, relative to the reference pose."""
        frames, layout = len(slots), self.layout
        still = np.zeros((frames, 1, 4))
        still[..., 0] = 1.0
        rest = np.repeat(still, len(layout.ends), axis=1)
        local = np.concatenate([still, slots, rest], axis=1)
        chain = kinematics.forward(self.chains, local, np.zeros((frames, 3)))[1][:, 1 : layout.slots + 1]
        found = np.zeros((frames, len(self.joints), 4))
        for rank in range(len(self.joints)):
            leaving = np.flatnonzero(layout.turned == rank)
            if len(leaving) == 0:
                found[:, rank] = chain[:, rank - 1]
                if ends is not None:
                    found[:, rank] = rotation.multiply(found[:, rank], ends[:, rank])
            else:
                found[:, rank] = _mean(chain[:, leaving])
        return found

    def ends_of(self, motion: Motion) -> np.ndarray:
        """``(frames, joints, 4)`` local rotations of all joints of the layout, the identity where there is
        no such joint: what ``motion`` takes as ``ends``."""
        known = alignment.relative(motion)
        found = np.zeros((len(known), len(self.joints), 4))
        found[..., 0] = 1.0
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            if joint >= 0 and rank and self.joints[parent] >= 0:
                above = rotation.conjugate(known[:, self.joints[parent]])
                found[:, rank] = rotation.multiply(above, known[:, joint])
        return found


def _mean(turned: np.ndarray) -> np.ndarray:
    """``(frames, 4)`` of ``(frames, n, 4)``, signs made alike first."""
    same = np.sign((turned * turned[:, :1]).sum(-1, keepdims=True))
    total = (turned * np.where(same == 0.0, 1.0, same)).sum(1)
    return np.asarray(rotation.normalise(total))


def cast(character: Character, layout: Layout) -> Body:
    """The character in this layout: joint for joint where it is of that structure, else by roles; joints
    without a role by where they lie between joints with one."""
    mine = own(character)
    if tuple(mine.skeleton.parents.tolist()) == layout.parents and mine.roles == layout.roles:
        return Body(character, layout, mine.joints)
    found = [character.joint_of.get(role, -1) if role else -1 for role in layout.roles]
    kept = [joint if joint in mine.joints else -1 for joint in found]
    for rank in range(len(kept)):
        if kept[rank] >= 0:
            _between(character, layout, rank, kept)
    return Body(character, layout, tuple(kept))


def _between(character: Character, layout: Layout, rank: int, found: list[int]) -> None:
    """Finds the joints without a role above a joint that is found, up to the next that is."""
    ranks, above = [], layout.parents[rank]
    while above > 0 and found[above] < 0:
        ranks.append(above)
        above = layout.parents[above]
    if not ranks or found[above] < 0:
        return
    parents = character.skeleton.parents.tolist()
    joints, joint = [], parents[found[rank]]
    while joint >= 0 and joint != found[above]:
        joints.append(joint)
        joint = parents[joint]
    unnamed = (each for each in joints if character.roles[each] is None and each not in found)
    for free, other in zip((each for each in ranks if layout.roles[each] is None), unnamed, strict=False):
        found[free] = other


def missing(body: Body) -> str:
    """Why a character cannot be seen in a layout: it has a joint of none of its parts; "" where it can."""
    if any(body.joints[slot + 1] >= 0 for part in body.layout.parts for slot in part):
        return ""
    names = ", ".join(name.replace("_", " ") for name in body.layout.names)
    return f"{body.character.name} has no joint of any part that these weights know ({names})"
