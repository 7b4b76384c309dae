"""A skeleton seen as a body: its joints by role, its frame, and poses changed one joint at a time."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from itertools import permutations, product

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.roles import ancestors, chain, is_quadruped
from retarget_bench.motion.skeleton import Skeleton

LEFT, UP, FORWARD = np.eye(3)
DOWN = -UP
SNAP = np.radians(25.0)
"""An estimated frame this near to a whole number of quarter turns is taken to be meant as that."""


class Body:
    """Joints by role and the frame of the hips.

    A *pose* is ``(joints, 4)`` local rotations; the methods that change one do so in place.
    """

    def __init__(self, skeleton: Skeleton, roles: Sequence[str | None]) -> None:
        self.skeleton = skeleton
        self.roles = tuple(roles)
        self.joint = {role: index for index, role in enumerate(roles) if role is not None}
        self.quadruped = is_quadruped(skeleton, roles)
        self.hips = self.joint.get("hips", 0)
        self.spine, self.neck = chain(roles, "spine"), chain(roles, "neck")

    def joints(self, *roles: str) -> list[int]:
        """The joints that have one of these roles, in the order asked."""
        return [self.joint[role] for role in roles if role in self.joint]

    def sideways(self, side: str) -> np.ndarray:
        """Where an arm points in the reference pose: out for bipeds, down for the fore legs of others."""
        if self.quadruped:
            return DOWN
        return LEFT if side == "left" else -LEFT

    # ------------------------------------------------------------------------------------- geometry
    def across(self, *, upper: bool = False) -> np.ndarray | None:
        """From the right to the left limbs at rest: of the legs, or of the arms with ``upper``."""
        stems = ("shoulder", "arm") if upper else ("up_leg",)
        for stem in stems:
            pair = self.joints(f"left_{stem}", f"right_{stem}")
            if len(pair) == 2:
                apart = self.skeleton.rest_positions[pair[0]] - self.skeleton.rest_positions[pair[1]]
                if np.linalg.norm(apart) > 1e-9:
                    return apart
        return None

    @cached_property
    def trunk(self) -> np.ndarray | None:
        """From the hips to the neck, or what there is of it, at rest."""
        for joint in [*self.neck[:1], *self.joints("head", "left_shoulder", "left_arm"), *self.spine[::-1]]:
            line = self.skeleton.rest_positions[joint] - self.skeleton.rest_positions[self.hips]
            if np.linalg.norm(line) > 1e-9:
                return line
        return None

    @cached_property
    def legs(self) -> np.ndarray | None:
        """From the upper legs to the feet at rest, mean of both."""
        lines = [
            self.skeleton.rest_positions[foot] - self.skeleton.rest_positions[top]
            for top, foot in (
                self.joints(f"{s}_up_leg", f"{s}_foot")
                for s in ("left", "right")
                if len(self.joints(f"{s}_up_leg", f"{s}_foot")) == 2
            )
        ]
        return np.mean(lines, axis=0) if lines else None

    @cached_property
    def rests_in_a_pose(self) -> bool:
        """Whether a living body could rest like this: legs away from the trunk (across it on four legs)."""
        if self.legs is None or self.trunk is None:
            return True
        size = np.linalg.norm(self.legs) * np.linalg.norm(self.trunk)
        longest = max(
            (
                sum(self.skeleton.bone_lengths[j] for j in self.joints(f"{s}_leg", f"{s}_foot"))
                for s in ("left", "right")
            ),
            default=0.0,
        )
        if size < 1e-12 or np.linalg.norm(self.legs) < 0.5 * longest:
            return False
        cosine = float(self.legs @ self.trunk) / size
        return abs(cosine) < 0.6 if self.quadruped else cosine < -0.5

    @cached_property
    def frame(self) -> np.ndarray | None:
        """``(4,)`` what turns the hips from their rest into the reference pose, told from the rest pose.

        Snapped to whole quarter turns where it is near to them. None without legs (or arms) and a trunk.
        """
        across = self.across() if self.across() is not None else self.across(upper=True)
        if across is None or self.trunk is None:
            return None
        forward_trunk = self.quadruped
        return snapped(frame(across, self.trunk, FORWARD if forward_trunk else UP))

    # ---------------------------------------------------------------------------------------- poses
    def places(self, pose: np.ndarray) -> np.ndarray:
        """``(joints, 3)`` metres, the root at the origin."""
        return kinematics.forward(self.skeleton, pose, np.zeros(3))[0]

    def get_global(self, pose: np.ndarray, joint: int) -> np.ndarray:
        """``(4,)`` world orientation of a joint; the identity for -1."""
        turned = rotation.identity()
        for each in reversed(ancestors(self.skeleton, joint, itself=True) if joint >= 0 else []):
            turned = rotation.multiply(turned, pose[each])
        return turned

    def set_global(self, pose: np.ndarray, joint: int, turned: np.ndarray) -> None:
        """Give a joint a world orientation, whatever its parents do."""
        above = self.get_global(pose, int(self.skeleton.parents[joint]))
        pose[joint] = rotation.normalise(rotation.multiply(rotation.conjugate(above), turned))

    def bone(self, joint: int, child: int) -> np.ndarray:
        """Unit vector to ``child`` in the frame of ``joint``, joints between them at rest; 0 if none."""
        line = self.skeleton.rest_positions[child] - self.skeleton.rest_positions[joint]
        length = float(np.linalg.norm(line))
        return line / length if length > 1e-9 else np.zeros(3)

    def swing(self, pose: np.ndarray, joint: int, child: int, wanted: np.ndarray) -> None:
        """Turn a joint the shortest way so that its bone to ``child`` points along ``wanted``."""
        turned = self.get_global(pose, joint)
        arc = rotation.between(rotation.rotate(turned, self.bone(joint, child)), wanted)
        self.set_global(pose, joint, rotation.multiply(arc, turned))


def frame(across: np.ndarray, along: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """``(4,)`` the turn that brings ``along`` onto ``wanted`` (UP or FORWARD or the like) exactly and
    ``across`` as near to LEFT as that allows."""
    first = along / np.linalg.norm(along)
    second = across - (across @ first) * first
    second /= np.linalg.norm(second)
    goal = LEFT - (LEFT @ wanted) * wanted
    goal /= np.linalg.norm(goal)
    ours = np.stack([first, second, np.cross(first, second)], axis=1)
    theirs = np.stack([wanted, goal, np.cross(wanted, goal)], axis=1)
    return rotation.from_matrix(theirs @ ours.T)


def snapped(turned: np.ndarray, within: float = SNAP) -> np.ndarray:
    """The nearest orientation made of quarter turns if it is that near, else ``turned`` itself."""
    apart = rotation.angle(quarter_turns(), turned)
    best = int(np.argmin(apart))
    return quarter_turns()[best] if apart[best] <= within else turned


@lru_cache(maxsize=1)
def quarter_turns() -> np.ndarray:
    """``(24, 4)`` the orientations of a cube."""
    turns = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                turns.append(rotation.from_matrix(matrix))
    return np.array(turns)
