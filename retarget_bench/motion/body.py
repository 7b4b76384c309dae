"""A skeleton seen as a body: its joints by role, its frame, and poses changed one joint at a time."""

from collections.abc import Sequence
from functools import cached_property, lru_cache
from itertools import pairwise, permutations, product

import numpy as np

from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.roles import LIMB_ROLES, SIDES, ancestors, chain, has_level_trunk, is_quadruped
from retarget_bench.motion.skeleton import Skeleton

LEFT, UP, FORWARD = np.eye(3)
DOWN = -UP
SNAP = np.radians(25.0)
"""An estimated frame this near to a whole number of quarter turns is taken to be meant as that."""
_NOTHING = 1e-9
_ALONG = np.cos(np.radians(8.0))
_OPPOSITE = np.cos(np.radians(135.0))


class PosedBody:
    """Joints by role and the frame of the hips.

    A *pose* is ``(joints, 4)`` local rotations; the methods that change one do so in place.
    level: whether the trunk lies along the floor, on four legs (``quadruped``) or on two, as a bird's.
    """

    def __init__(self, skeleton: Skeleton, roles: Sequence[str | None]) -> None:
        self.skeleton = skeleton
        self.roles = tuple(roles)
        self.joint = {role: index for index, role in enumerate(roles) if role is not None}
        self.quadruped = is_quadruped(skeleton, roles)
        self.level = self.quadruped or has_level_trunk(skeleton, roles)
        self.hips = self.joint.get("hips", 0)
        self.spine, self.neck, self.tail = (chain(roles, stem) for stem in ("spine", "neck", "tail"))

    def joints(self, *roles: str) -> list[int]:
        """The joints that have one of these roles, in their order."""
        return [self.joint[role] for role in roles if role in self.joint]

    def sideways(self, side: str) -> np.ndarray:
        """Direction of an arm in the reference pose: out for bipeds, down for the fore legs of others."""
        if self.quadruped:
            return DOWN
        return LEFT if side == "left" else -LEFT

    # ------------------------------------------------------------------------------- the rest pose
    def line(self, start: int, end: int) -> np.ndarray:
        """``(3,)`` metres from one joint to another at rest."""
        return np.asarray(self.skeleton.rest_positions[end] - self.skeleton.rest_positions[start])

    @cached_property
    def across(self) -> np.ndarray | None:
        """From the right to the left leg (or arm) at rest; None if they are not apart."""
        for stem in ("up_leg", "arm", "shoulder"):
            pair = self.joints(f"right_{stem}", f"left_{stem}")
            if len(pair) == 2 and np.linalg.norm(apart := self.line(*pair)) > _NOTHING:
                return apart
        return None

    @cached_property
    def trunk_end(self) -> int:
        """The joint that the trunk leads to: the first of neck, head, shoulders, last spine away from the
        hips."""
        ends = [*self.neck[:1], *self.joints("head", "left_shoulder", "left_arm"), *self.spine[::-1]]
        return next((j for j in ends if np.linalg.norm(self.line(self.hips, j)) > _NOTHING), self.hips)

    @cached_property
    def trunk(self) -> np.ndarray | None:
        """From the hips to the end of the trunk at rest."""
        return self.line(self.hips, self.trunk_end) if self.trunk_end != self.hips else None

    @cached_property
    def rests_in_a_pose(self) -> bool:
        """True where a living body can rest like this: legs away from the trunk, or across a level one."""
        pairs = [pair for side in SIDES if len(pair := self.joints(*_leg(side))) == 2]
        if not pairs or self.trunk is None:
            return True
        legs = np.mean([self.line(*pair) for pair in pairs], axis=0)
        reach = np.mean([self.skeleton.bone_lengths[foot] for _, foot in pairs])
        size = float(np.linalg.norm(legs) * np.linalg.norm(self.trunk))
        if size == 0 or np.linalg.norm(legs) < reach:  # mirrored sides cancel
            return False
        cosine = float(legs @ self.trunk) / size
        return -0.75 < cosine < 0.6 if self.level else cosine < -0.5

    @cached_property
    def along_axes(self) -> bool:
        """True where nearly all bones of the limbs lie along a coordinate axis of their joint."""
        bones = []
        for limb in LIMB_ROLES.values():
            joints = self.joints(*limb)
            bones += [self.bone(a, b) for a, b in pairwise(joints) if self.bone(a, b).any()]
        near = [float(np.abs(bone).max()) > _ALONG for bone in bones]
        return bool(near) and float(np.mean(near)) > 0.7

    @cached_property
    def frame(self) -> np.ndarray | None:
        """``(4,)`` the turn of the hips from their rest into the reference pose, by the rest pose.

        Snapped to whole quarter turns where it is near to them; a level trunk that slopes more than that
        keeps its slope where its legs stand straight. None without legs (or arms) and a trunk, or if these
        are parallel.
        """
        if self.across is None or self.trunk is None:
            return None
        crossed = np.linalg.norm(np.cross(self.across, self.trunk))
        if crossed < 1e-3 * np.linalg.norm(self.across) * np.linalg.norm(self.trunk):
            return None
        by_trunk = frame(self.trunk, self.across, FORWARD if self.level else UP, LEFT)
        turn = snapped(by_trunk)
        if not self.level or turn is not by_trunk or not self.rests_in_a_pose:
            return turn
        legs = [self.line(*pair) for side in SIDES if len(pair := self.joints(*_leg(side))) == 2]
        upright = frame(np.mean(legs, axis=0), self.across, DOWN, LEFT) if legs else by_trunk
        return by_trunk if (exact := snapped(upright)) is upright else exact

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
        line = self.line(joint, child)
        length = float(np.linalg.norm(line))
        return line / length if length > _NOTHING else np.zeros(3)

    def tip(self, joint: int, child: int | None) -> np.ndarray:
        """The bone to ``child``, or to the joint's end site; 0 if there is none."""
        if child is not None:
            return self.bone(joint, child)
        tips = [np.array(site.offset) for site in self.skeleton.end_sites if site.parent == joint]
        length = float(np.linalg.norm(tips[0])) if tips else 0.0
        return tips[0] / length if length > _NOTHING else np.zeros(3)

    def swing(self, pose: np.ndarray, joint: int, child: int, direction: np.ndarray) -> None:
        """Turn a joint the shortest way so that its bone to ``child`` points along ``direction``."""
        self.swing_bone(pose, joint, self.bone(joint, child), direction)

    def swing_bone(self, pose: np.ndarray, joint: int, bone: np.ndarray, direction: np.ndarray) -> None:
        """Likewise for any vector in the joint's frame. One that points the other way is first turned about
        the axis across the body (upright for sideways ones), so that the way round is definite."""
        turned = self.get_global(pose, joint)
        now = rotation.rotate(turned, bone)
        if now @ direction < _OPPOSITE:
            half = rotation.about(LEFT if abs(direction @ LEFT) < 0.5 else UP, np.pi)
            turned, now = rotation.multiply(half, turned), rotation.rotate(half, now)
        self.set_global(pose, joint, rotation.multiply(rotation.between(now, direction), turned))


def _leg(side: str) -> tuple[str, str]:
    return f"{side}_up_leg", f"{side}_foot"


def frame(first: np.ndarray, second: np.ndarray, to_first: np.ndarray, to_second: np.ndarray) -> np.ndarray:
    """``(4,)`` the turn that brings ``first`` onto ``to_first`` exactly and ``second`` as near to
    ``to_second`` as that allows. Of vectors that are parallel any twist is taken."""
    return rotation.from_matrix(_basis(to_first, to_second) @ _basis(first, second).T)


def _basis(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """``(3, 3)`` columns: ``first``, what is across it towards ``second``, and their cross product."""
    along = first / np.linalg.norm(first)
    across = second - (second @ along) * along
    if np.linalg.norm(across) < 1e-6 * np.linalg.norm(second) + _NOTHING:
        across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across = across / np.linalg.norm(across)
    return np.stack([along, across, np.cross(along, across)], axis=1)


def snapped(turned: np.ndarray, within: float = SNAP) -> np.ndarray:
    """``(4,)`` the nearest orientation made of quarter turns if it is that near, else ``turned`` itself."""
    apart = rotation.angle(quarter_turns(), np.asarray(turned)[None])
    nearest = int(np.argmin(apart))
    return np.array(quarter_turns()[nearest]) if apart[nearest] <= within else turned


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
