"""The bodies of a Mixamo folder: which structure a rig has, and what it is reduced to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from retarget_bench.files import digest
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import is_body
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.motion.structures import Reduction, reduce

STRUCTURE_A = "mixamo-A"
"""Aj, BigVegas, Kaya, SportyGranny: a ``Pelvis`` under ``Hips``, no joints at toe and head ends."""
STRUCTURE_B = "mixamo-B"
"""The characters with the suffix ``_m``: a spine joint and both shoulders split in two, ends as joints."""
PAPER = {STRUCTURE_A: "S23", STRUCTURE_B: "S28"}
"""What SAN and PAN reduce these to."""
_SPLITS = {"Spine1_split", "LeftShoulder_split", "RightShoulder_split"}


@dataclass(frozen=True, eq=False)
class Rig:
    """One body of one character: as its files have it, and as cases use it.

    native:    every joint of the file; ``native.structure`` decides the splits.
    reduction: to fewer joints, or None where all are kept.
    """

    native: Character
    reduction: Reduction | None

    @property
    def character(self) -> Character:
        return self.native if self.reduction is None else self.reduction.character

    def motion(self, rotations: np.ndarray, root: np.ndarray, fps: float, wanted: float) -> Motion:
        """A recording of this body at the wanted rate, on the joints that cases use."""
        motion = self.native.motion(rotations, root, fps).resample(wanted)
        return motion if self.reduction is None else self.reduction.apply(motion)


def rig(name: str, skeleton: Skeleton, structure: str) -> Rig:
    """The rig of a character; ``structure`` is ``native``, ``full`` or a name of ``structures.py``.

    Raises SkeletonError where the skeleton cannot be reduced to it.
    """
    body = Character.of(name, skeleton)
    topology = structure_of(skeleton, body.roles)
    body = replace(body, structure=topology)
    if structure == "full":
        return Rig(body, None)
    return Rig(body, reduce(body, PAPER.get(topology, "body22") if structure == "native" else structure))


def structure_of(skeleton: Skeleton, roles: Sequence[str | None]) -> str:
    """``mixamo-A``, ``mixamo-B``, or for other rigs ``mixamo-`` and a hash of their tree of body joints."""
    bare = {name.rpartition(":")[2] for name in skeleton.names}
    if bare >= _SPLITS:
        return STRUCTURE_B
    if "Pelvis" in bare and "LeftToe_End" not in bare:
        return STRUCTURE_A
    parents = skeleton.parents.tolist()
    lines = []
    for joint, role in enumerate(roles):
        if role is None or not is_body(role):
            continue
        above = parents[joint]
        while above >= 0 and ((found := roles[above]) is None or not is_body(found)):
            above = parents[above]
        lines.append(f"{role} {roles[above] if above >= 0 else '-'}")
    return f"mixamo-{digest(chr(10).join(sorted(lines)), 6)}"
