"""A body as SAME sees it: a graph of its joints, and a tip behind each last one."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.api.comparison import body_joints
from retarget_bench.motion import rotation
from retarget_bench.motion.aligned import Aligned
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import is_tip
from retarget_bench.motion.skeleton import Skeleton

CM = 100.0
"""The networks see centimetres, as the authors' do, so that contacts and weights mean the same."""
RATIO = "hip_height"
"""Root rule by which the source's path leads the target's."""


@dataclass(frozen=True, eq=False)
class SameBody:
    """The joints that position errors count, at and below the hips, then their tips: the nodes of a graph.

    A last joint that is a tip itself (the top of the head, the end of a toe) has no other behind it. With
    one, the released weights give hips below the floor: they have never seen two tips in a row.

    Raises SkeletonError where the character has no hips or nothing below them.
    """

    character: Character

    @cached_property
    def aligned(self) -> Aligned:
        return Aligned(self.character, body_joints(self.character))

    @cached_property
    def skeleton(self) -> Skeleton:
        """All nodes at rest in the reference pose, the hips at the origin; metres."""
        skeleton, roles = self.aligned.skeleton, self.aligned.roles
        ends = set(range(len(skeleton))) - set(skeleton.parents.tolist())
        last = np.array(sorted(node for node in ends if not is_tip(roles[node])), dtype=np.int64)
        tips = np.array([self._tip(self.aligned.joints[node]) for node in last]).reshape(-1, 3)
        names = (*skeleton.names, *(f"{skeleton.names[node]} tip" for node in last))
        return Skeleton(
            names, np.concatenate([skeleton.parents, last]), np.concatenate([skeleton.offsets, tips])
        )

    @cached_property
    def turning(self) -> np.ndarray:
        """``(nodes,)`` bool: what hangs from the node shows how it turns."""
        mask = np.zeros(len(self.skeleton), dtype=bool)
        mask[self.skeleton.parents[1:]] = True
        return mask

    @cached_property
    def shape(self) -> np.ndarray:
        """``(nodes, 6)`` float32 cm: the bone to each node, and where it is in the T-pose, standing."""
        hips = self.character.standing_places[self.aligned.joints[0]]
        bones = np.array(self.skeleton.offsets)
        bones[0] = hips
        return (CM * np.concatenate([bones, self.skeleton.rest_positions + hips], 1)).astype(np.float32)

    def _tip(self, joint: int) -> np.ndarray:
        """``(3,)`` metres: from a last joint to the mean of the end sites and of the joints below it, which
        are not seen (fingers); zeros where there are none."""
        skeleton, places = self.character.skeleton, self.character.reference_places
        ends = [
            rotation.rotate(self.character.reference_globals[joint], np.array(site.offset))
            for site in skeleton.end_sites
            if site.parent == joint
        ]
        ends += [places[below] - places[joint] for below in np.flatnonzero(skeleton.parents == joint)]
        return np.mean(ends, axis=0) if ends else np.zeros(3)


@lru_cache(maxsize=1024)
def body(character: Character) -> SameBody:
    return SameBody(character)
