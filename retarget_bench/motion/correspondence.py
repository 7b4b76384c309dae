"""Correspondence of the joints of two bodies, and of their orientations.

Joints answer to each other by role. Spines and necks of different counts are shared out along the chain
(equal counts one to one, the last always to the last, because it carries the arms or the head). A target
joint without an answer *follows its parent*: it keeps its place in the reference pose relative to it. That
holds for ``*_split``, ``Pelvis`` and ``LHipJoint`` joints, props and hair, and for fingers that the source
does not have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.motion.roles import chain

if TYPE_CHECKING:
    from retarget_bench.motion.character import Character

FOLLOW = -1
"""Answer for a target joint that follows its parent."""

CHAINS = ("spine", "neck", "tail")


def correspondence(source: Character, target: Character) -> np.ndarray:
    """``(target joints,)`` the source joint for every target joint, or -1: it follows its parent.

    Bodies with the same joint names and parents answer joint by joint, props included.
    """
    if source.skeleton.names == target.skeleton.names and np.array_equal(
        source.skeleton.parents, target.skeleton.parents
    ):
        return np.arange(len(target.skeleton))
    answer = np.full(len(target.skeleton), FOLLOW)
    for role, joint in target.joint_of.items():
        answer[joint] = source.joint_of.get(role, FOLLOW)
    for stem in CHAINS:
        ours, theirs = chain(target.roles, stem), chain(source.roles, stem)
        for rank, share in enumerate(shares(len(ours), len(theirs))):
            answer[ours[rank]] = theirs[share] if share >= 0 else FOLLOW
    return answer


def shares(wanted: int, given: int) -> list[int]:
    """For each of ``wanted`` links, the one of ``given`` that corresponds; -1 where there is none.

    Link k of n ends at the share k/n of the chain and takes the link that ends nearest to it.
    """
    return [
        int((2 * k * given + wanted) // (2 * wanted)) - 1 if given else FOLLOW for k in range(1, wanted + 1)
    ]


def carry(orientations: np.ndarray, source: Character, target: Character) -> np.ndarray:
    """Orientations relative to the reference pose, source joints to target joints.

    orientations: ``(frames, source joints, 4)``, from ``alignment.relative``.
    Returns ``(frames, target joints, 4)`` for ``alignment.from_relative``; joints that follow their parent
    get their parent's.
    """
    answer = correspondence(source, target)
    carried = np.zeros((orientations.shape[0], len(answer), 4))
    for joint, (from_, parent) in enumerate(zip(answer, target.skeleton.parents.tolist(), strict=True)):
        if from_ >= 0:
            carried[:, joint] = orientations[:, from_]
        elif parent >= 0:
            carried[:, joint] = carried[:, parent]
        else:
            carried[:, joint, 0] = 1.0
    return carried
