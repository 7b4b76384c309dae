"""A character of which only some joints are known."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from retarget_bench.errors import SkeletonError
from retarget_bench.motion import kinematics, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton


def reduced(character: Character, joints: Sequence[int]) -> Character:
    """The character with these joints alone; itself where that is all of them.

    Each hangs from its nearest ancestor that is left. The first one is the root, and what has no ancestor
    left hangs from it: without hips there is no better tree, and methods that need hips say so. Names,
    roles, structure and the measures of the whole body stay. It rests in the common reference pose, with
    every joint where the whole body has it there.

    Raises SkeletonError for no joint, one that there is not, or one that is named twice.
    """
    kept = sorted(joints)
    total = len(character.skeleton)
    if not kept or len(set(kept)) < len(kept) or not 0 <= kept[0] <= kept[-1] < total:
        raise SkeletonError(
            f"{character.name} has joints 0 to {total - 1}; keep at least one, each once, not {kept}"
        )
    if len(kept) == total:
        return character
    parents = _parents(character.skeleton.parents.tolist(), kept)
    places = kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))[0][kept]
    offsets = places - places[np.maximum(parents, 0)]
    offsets[0] = places[0]
    return replace(
        character,
        name=f"{character.name} ({len(kept)} of {total} joints)",
        skeleton=Skeleton(tuple(character.skeleton.names[j] for j in kept), parents, offsets),
        roles=tuple(character.roles[j] for j in kept),
        reference_pose=rotation.identity(len(kept)),
        skin=None,
        whole=character.whole or character,
    )


def _parents(parents: Sequence[int], kept: Sequence[int]) -> np.ndarray:
    """``(kept,)`` the number among ``kept`` of each one's nearest ancestor there; 0 where there is none."""
    number = {joint: index for index, joint in enumerate(kept)}
    found = [-1]
    for joint in kept[1:]:
        above = parents[joint]
        while above >= 0 and above not in number:
            above = parents[above]
        found.append(number.get(above, 0))
    return np.array(found)
