"""Characters in the layout of a structure: rotations of its edges from a motion, and back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np

from retarget_bench.api.comparison import body_joints
from retarget_bench.motion import kinematics, rotation, transfer
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.tree import rerooted


@lru_cache(maxsize=1024)
def aligned(character: Character) -> Aligned:
    """The character with the joints at and below the hips, those that position errors count.

    Raises SkeletonError where it has no hips or nothing below them."""
    return Aligned(character, body_joints(character))


@dataclass(frozen=True, eq=False)
class LayoutBody:
    """A character's joints in the order of a layout's.

    joints: ``(joints of the layout,)`` the character's, -1 where it has none: there the layout has a bone
            of no length that does not turn (PAN, section 6.2.3). The first one, the root, is the hips or
            hangs below them (``tree.py``).
    """

    character: Character
    layout: Layout
    joints: tuple[int, ...]

    @cached_property
    def positions(self) -> np.ndarray:
        """``(joints, 3)`` metres, in the reference pose, relative to the root."""
        skeleton, pose = self.character.skeleton, self.character.reference_pose
        world = kinematics.forward(skeleton, pose, np.zeros(3))[0]
        positions = np.zeros((len(self.joints), 3))
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            positions[rank] = world[joint] - world[self.joints[0]] if joint >= 0 else positions[parent]
        return positions

    @cached_property
    def bones(self) -> np.ndarray:
        """``(edges, 3)`` metres: the bone that each edge turns, in the reference pose; of joints the one
        to each, zero for the root."""
        return self.skeleton.offsets[self.layout.leads]

    @property
    def root_bone(self) -> np.ndarray:
        """``(3,)`` metres: the OFFSET of the root, which the authors' code takes for its bone; zero where
        the root is not the hips."""
        height = self.character.measures.root_offset
        is_hips = self.joints[0] == self.character.joint_of["hips"]
        return np.array([0.0, height if is_hips else 0.0, 0.0])

    @cached_property
    def skeleton(self) -> Skeleton:
        """The layout as a tree with these bones."""
        names = tuple(str(rank) for rank in range(len(self.joints)))
        parents = np.array(self.layout.parents)
        offsets = self.positions - self.positions[np.maximum(parents, 0)]
        return Skeleton(names, parents, offsets)

    @cached_property
    def end_sites(self) -> dict[int, np.ndarray]:
        """Joint of the layout -> ``(3,)`` metres from it to the end of its bone, in the reference pose."""
        character, sites = self.character, {}
        for site in reversed(character.skeleton.end_sites):
            if site.parent in self.joints:
                turn = character.reference_globals[site.parent]
                sites[self.joints.index(site.parent)] = rotation.rotate(turn, np.array(site.offset))
        return dict(sorted(sites.items()))

    @cached_property
    def chains(self) -> Skeleton:
        """The tree that turns edge by edge, every edge on its own: the root, then per edge the joint that
        it leaves, then the ends of the edges from whose child no edge leaves. Not of joints.

        Joint 0 does not turn, joint s + 1 is turned by edge s, the ends do not turn."""
        above, ends = self.layout.above, self.layout.ends
        parents = np.concatenate([[-1], above + 1, ends + 1])
        bones = np.concatenate([self.bones, np.zeros((1, 3))])  # row -1: of the hips
        offsets = np.concatenate([np.zeros((1, 3)), bones[above], self.bones[ends]])
        return Skeleton(tuple(str(n) for n in range(len(parents))), parents, offsets)

    def see(self, motion: Motion, turn: np.ndarray | None) -> np.ndarray:
        """``(frames, edges, 4)`` rotations that edges carry, seen from ``turn`` ``(frames, 4)`` (a rotation
        about the vertical axis), signs continuous along time."""
        relative = transfer.relative(motion)
        turned = np.empty((len(relative), len(self.joints), 4))
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            turned[:, rank] = relative[:, joint] if joint >= 0 else turned[:, parent]
        if turn is not None:
            turned = rotation.multiply(rotation.conjugate(turn)[:, None], turned)
        local = rotation.normalise(kinematics.local_from_global(self.skeleton, turned))
        local = rotation.continuous(local)[:, self.layout.turned]
        return local * np.where(local[:1, :, :1] < 0.0, -1.0, 1.0)

    def root(self, motion: Motion) -> np.ndarray:
        """``(frames, 3)`` metres: where the root is."""
        if self.joints[0] == self.character.joint_of["hips"]:
            return transfer.hips(motion)
        return motion.positions[:, self.joints[0]]

    def motion(
        self,
        edges: np.ndarray,
        turn: np.ndarray | None,
        root: np.ndarray,
        fps: float,
        ends: np.ndarray | None = None,
    ) -> Motion:
        """The whole body's motion: the inverse of ``see``.

        A joint that several edges leave is turned by their mean; what hangs below keeps its orientation.
        edges: ``(frames, edges, 4)``. root: ``(frames, 3)`` metres.
        ends:  ``(frames, joints, 4)`` local rotations of joints that no edge leaves; None: at rest.
        """
        turned = self._orientations(rotation.normalise(edges), ends)
        if turn is not None:
            turned = rotation.multiply(turn[:, None], turned)
        ranks, hips = [rank for rank, joint in enumerate(self.joints) if joint >= 0], root
        if self.joints[0] != self.character.joint_of["hips"]:
            ranks.sort(key=lambda rank: self.joints[rank])  # as the file's tree has them
            hips = root + rotation.rotate(turned[:, ranks[0]], self.positions[ranks[0]])
        aligned_body = Aligned(self.character, tuple(self.joints[rank] for rank in ranks))
        local = kinematics.local_from_global(aligned_body.skeleton, turned[:, ranks])
        return aligned_body.motion(rotation.normalise(local), hips, fps)

    def _orientations(self, edges: np.ndarray, ends: np.ndarray | None) -> np.ndarray:
        """``(frames, joints, 4)`` of the layout's joints, relative to the reference pose."""
        frames, layout = len(edges), self.layout
        if layout.slots == "joints":
            return kinematics.forward(self.skeleton, edges, np.zeros((frames, 3)))[1]
        identity = np.zeros((frames, 1, 4))
        identity[..., 0] = 1.0
        rest = np.repeat(identity, len(layout.ends), axis=1)
        local = np.concatenate([identity, edges, rest], axis=1)
        chain = kinematics.forward(self.chains, local, np.zeros((frames, 3)))[1][:, 1 : layout.edges + 1]
        orientations = np.zeros((frames, len(self.joints), 4))
        for rank in range(len(self.joints)):
            leaving = np.flatnonzero(layout.turned == rank)
            if len(leaving) == 0:
                orientations[:, rank] = chain[:, rank - 1]
                if ends is not None:
                    orientations[:, rank] = rotation.multiply(orientations[:, rank], ends[:, rank])
            else:
                orientations[:, rank] = _mean(chain[:, leaving])
        return orientations

    def ends_of(self, motion: Motion) -> np.ndarray:
        """``(frames, joints, 4)`` local rotations of all joints of the layout, the identity where there is
        no such joint: what ``motion`` takes as ``ends``."""
        relative = transfer.relative(motion)
        rotations = np.zeros((len(relative), len(self.joints), 4))
        rotations[..., 0] = 1.0
        for rank, (joint, parent) in enumerate(zip(self.joints, self.layout.parents, strict=True)):
            if joint >= 0 and rank and self.joints[parent] >= 0:
                above = rotation.conjugate(relative[:, self.joints[parent]])
                rotations[:, rank] = rotation.multiply(above, relative[:, joint])
        return rotations


def _mean(turned: np.ndarray) -> np.ndarray:
    """``(frames, 4)`` of ``(frames, n, 4)``, signs made alike first."""
    same = np.sign((turned * turned[:, :1]).sum(-1, keepdims=True))
    total = (turned * np.where(same == 0.0, 1.0, same)).sum(1)
    return np.asarray(rotation.normalise(total))


def tree_of(character: Character, turned: bool) -> tuple[list[int], tuple[int, ...]]:
    """Parents of the joints that position errors count, and the joints; ``turned``: see ``rerooted``."""
    body = aligned(character)
    parents, joints = body.skeleton.parents.tolist(), body.joints
    if turned:
        parents, order = rerooted(parents, body.roles)
        joints = tuple(joints[joint] for joint in order)
    return parents, joints


FOUR: Final = "four_legged"
"""Suffix of the key of a structure on four legs."""


def structure_key(character: Character) -> str:
    """The prefix of a structure's tensors: a name without a dot that torch takes for a module."""
    from torch import nn

    name = character.structure.replace(".", "_")
    if character.four_legged:
        return f"{name}_{FOUR}"
    return f"{name}_" if name.endswith(FOUR) or hasattr(nn.ModuleDict(), name) else name
