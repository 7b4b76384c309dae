"""Bodies of other proportions, drawn at random: bones are stretched and the flesh around them thickened."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.body22 import JOINTS, PARENTS, Body22
from retarget_bench.training.layers.skinned_body import SkinnedBody, mesh_of


class Part(NamedTuple):
    """Bones that are stretched alike.

    ranks: of the 22 joints that they begin at, left and right together. length, girth: deviations of the
    logarithms of what they are multiplied by; no girth: what lies at an end grows in all directions.
    limb: parts of one limb are mostly long and thick together.
    """

    ranks: tuple[int, ...]
    length: float
    girth: float | None = None
    limb: str = ""


PARTS = (
    Part((0,), 0.15, 0.20, "trunk"),
    Part((1, 2, 3), 0.15, 0.20, "trunk"),
    Part((4,), 0.25, 0.20),
    Part((5,), 0.35),
    Part((6, 10), 0.20, 0.20, "leg"),
    Part((7, 11), 0.20, 0.20, "leg"),
    Part((8, 9, 12, 13), 0.20),
    Part((14, 18), 0.25, 0.20),
    Part((15, 19), 0.20, 0.20, "arm"),
    Part((16, 20), 0.20, 0.20, "arm"),
    Part((17, 21), 0.20),
)
"""The spreads reach as far as drawn figures do beside people, or a little farther."""
SHARED = 0.8
"""Share of the variance that parts of a limb have in common."""
_FORKS = {0: 1, 3: 4}
"""The end of the bone of a joint with several children: the spine's goes on."""
_LEADS_TO = {parent: rank for rank, parent in enumerate(PARENTS) if parent >= 0} | _FORKS
"""The end of the bone that begins at a joint of the 22."""


class StretchedBody:
    """A skinned body whose proportions are changed as it is posed.

    A point keeps its shares of the joints. What follows a joint is stretched along its bone and across it
    before it is turned, and bones that hang from it lie where they are taken.

    character_joints: ``(22,)`` the rig's joint where each of the 22 is.
    """

    def __init__(self, body: SkinnedBody) -> None:
        self.body = body
        self._parents = body.character.skeleton.parents
        self._places = mesh_of(body.character).bound(body.character.skeleton)[0]
        self.character_joints = Body22.of(body.character).joints

    @cached_property
    def _ranks(self) -> np.ndarray:
        """``(joints,)`` which of the 22 a joint of the rig is, or hangs from; above the hips: the hips."""
        # a joint that stands for others which the body lacks comes first among them
        own = {joint: rank for rank, joint in reversed([*enumerate(self.character_joints)])}
        ranks = np.zeros(len(self._parents), int)
        for joint, parent in enumerate(self._parents.tolist()):
            ranks[joint] = own.get(joint, ranks[parent] if parent >= 0 else 0)
        return ranks

    @cached_property
    def _along(self) -> np.ndarray:
        """``(joints, 3, 3)``: the part of a vector along the bone that a joint belongs to."""
        places, projections = (
            self._places[list(self.character_joints)],
            np.zeros((len(self._parents), 3, 3)),
        )
        for joint, rank in enumerate(self._ranks.tolist()):
            end, bone = rank, np.zeros(3)
            while end in _LEADS_TO and not bone.any():  # the next joint that the body does not lack
                end = _LEADS_TO[end]
                bone = places[end] - places[rank]
            if bone.any():
                projections[joint] = np.outer(bone, bone) / (bone @ bone)
        return projections

    @cached_property
    def unchanged(self) -> np.ndarray:
        """``(joints, 3, 3)``: of a body as it is."""
        return np.tile(np.eye(3), (len(self._parents), 1, 1))

    def drawn(self, numbers: np.random.Generator) -> np.ndarray:
        """``(joints, 3, 3)``: what each joint's surroundings are stretched by, in the mesh's own pose."""
        common = {each.limb: numbers.normal(size=2) for each in PARTS if each.limb}
        by_rank = np.ones((JOINTS, 2))
        for part in PARTS:
            own = numbers.normal(size=2)
            if part.limb:
                own = SHARED**0.5 * common[part.limb] + (1.0 - SHARED) ** 0.5 * own
            length, girth = part.length * own[0], part.length * own[0]
            if part.girth is not None:
                girth = part.girth * own[1]
            by_rank[list(part.ranks)] = np.exp([length, girth])
        length, girth = by_rank[self._ranks].T[:, :, None, None]
        return np.asarray(girth * np.eye(3) + (length - girth) * self._along)

    def posed(
        self, stretch: np.ndarray, turns: np.ndarray, shifts: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """``(V, 3)`` vertices and ``(22, 3)`` joints in metres, in one frame of ``moves``.

        stretch: ``(joints, 3, 3)``, of ``drawn``.
        """
        linear = rotation.to_matrix(turns) @ stretch
        joints = np.empty_like(self._places)
        joints[0] = rotation.rotate(turns[0], self._places[0]) + shifts[0]
        for joint, parent in enumerate(self._parents.tolist()):
            if parent >= 0:
                bone = self._places[joint] - self._places[parent]
                joints[joint] = joints[parent] + linear[parent] @ bone
        moved = joints - (linear @ self._places[..., None])[..., 0]
        vertices = self.body.blended(np.concatenate([linear, moved[..., None]], axis=-1))
        return vertices, joints[list(self.character_joints)]
