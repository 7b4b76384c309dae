"""Carrying a pose from one body to another: orientations relative to the common reference pose, by role.

Relative to the reference pose, an orientation ``G * G_ref^-1`` means the same on every body. Joints
correspond by role. Spines and necks of different counts are shared out along the chain (equal counts one to
one, the last always to the last, because it carries the arms or the head). A target joint without a
counterpart *follows its parent*: it keeps its place in the reference pose relative to it. That holds for
``*_split``, ``Pelvis`` and ``LHipJoint`` joints, props and hair, and for fingers that the source does not
have.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion import kinematics, root_rules, rotation
from retarget_bench.motion.character import Character, Motion, Prediction
from retarget_bench.motion.roles import chain

FOLLOW = -1
"""Answer for a target joint that follows its parent."""
CHAINS = ("spine", "neck", "tail")
"""Stems of the roles of which bodies have different counts."""


def reason(source: Character, target: Character) -> str | None:
    """None, or why no pose can be carried between these bodies, as a sentence."""
    for body in (source, target):
        if "hips" not in body.joint_of:
            return f"no joint of {body.name} is known as hips; name it in a roles file"
        if not body.height > 0.0:
            return f"{body.name} has no height: no bone from its hips to its feet and head has a length"
    if len(source.joint_of.keys() & target.joint_of.keys()) < 2:
        return f"{source.name} and {target.name} share no roles but the hips"
    return None


def another_skeleton(does: str, source: Character, target: Character) -> str | None:
    """None for source and target of one skeleton, or why a method that ``does`` this needs that."""
    if source.skeleton.same_as(target.skeleton):
        return None
    return f"{does}, and {target.name} has another skeleton than {source.name}"


# --------------------------------------------------------------------------------------- orientations
def relative(motion: Motion) -> np.ndarray:
    """``(frames, joints, 4)`` world orientations relative to the reference pose: G * G_ref^-1."""
    back = rotation.conjugate(motion.character.reference_globals)[None]
    return rotation.in_blocks(lambda some: rotation.multiply(some, back), motion.global_rotations)


def from_relative(character: Character, orientations: np.ndarray) -> np.ndarray:
    """``(frames, joints, 4)`` local rotations of a body whose joints are turned by ``orientations`` (same
    shape) from its reference pose: the inverse of ``relative``, signs continuous along time."""
    return rotation.continuous(rotation.in_blocks(partial(_local, character), orientations))


def _local(character: Character, orientations: np.ndarray) -> np.ndarray:
    turned = rotation.multiply(orientations, character.reference_globals[None])
    return rotation.normalise(kinematics.local_from_global(character.skeleton, turned))


def correspondence(source: Character, target: Character) -> np.ndarray:
    """``(target joints,)`` the source joint for every target joint, or -1: it follows its parent.

    Bodies with the same joint names and parents correspond joint by joint, props included.
    """
    if source.skeleton.names == target.skeleton.names and np.array_equal(
        source.skeleton.parents, target.skeleton.parents
    ):
        return np.arange(len(target.skeleton))
    answer = np.full(len(target.skeleton), FOLLOW)
    for role, joint in target.joint_of.items():
        answer[joint] = source.joint_of.get(role, FOLLOW)
    for stem in CHAINS:
        target_chain, source_chain = chain(target.roles, stem), chain(source.roles, stem)
        for rank, share in enumerate(shares(len(target_chain), len(source_chain))):
            answer[target_chain[rank]] = source_chain[share] if share >= 0 else FOLLOW
    return answer


def shares(target_count: int, source_count: int) -> list[int]:
    """For each of ``target_count`` links the one of ``source_count`` that corresponds; -1 where none does.

    Link k of n ends at the share k/n of the chain and takes the link that ends nearest to it.
    """
    ranks = range(1, target_count + 1)
    return [
        (2 * k * source_count + target_count) // (2 * target_count) - 1 if source_count else FOLLOW
        for k in ranks
    ]


def orientations(source: Motion, target: Character) -> np.ndarray:
    """``(frames, joints of target, 4)`` world orientations relative to the common reference pose.

    A joint takes that of its counterpart; one without counterpart stays fixed to its parent.
    """
    return rotation.in_blocks(_carrying(source.character, target), source.global_rotations)


def _carrying(source: Character, target: Character) -> Callable[[np.ndarray], np.ndarray]:
    """``orientations`` of world orientations ``(frames, joints of source, 4)``."""
    answer = correspondence(source, target)
    back = rotation.conjugate(source.reference_globals)[None]
    upright = np.array([1.0, 0.0, 0.0, 0.0])

    def carried(some: np.ndarray) -> np.ndarray:
        return shared_out(rotation.multiply(some, back), answer, target, upright)

    return carried


def shared_out(values: np.ndarray, answer: np.ndarray, target: Character, other: np.ndarray) -> np.ndarray:
    """``(frames, joints of target, n)``: values ``(frames, joints of source, n)`` of each joint's
    counterpart, else its parent's, else ``other`` ``(n,)``. answer: what ``correspondence`` gives."""
    out = np.empty((len(values), len(answer), values.shape[-1]))
    for joint, (from_, parent) in enumerate(zip(answer, target.skeleton.parents.tolist(), strict=True)):
        if from_ >= 0:
            out[:, joint] = values[:, from_]
        else:
            out[:, joint] = out[:, parent] if parent >= 0 else other
    return out


# ----------------------------------------------------------------------------------------- root paths
def hips(source: Prediction) -> np.ndarray:
    """``(frames, 3)`` metres: the joint with the role ``hips``, which need not be the root."""
    joint = source.character.joint_of["hips"]
    return source.root if joint == 0 else source.positions[:, joint]


def root_from_hips(target: Character, rotations: np.ndarray, place: np.ndarray) -> np.ndarray:
    """``(frames, 3)`` root that brings the hips to ``place`` ``(frames, 3)`` in these rotations."""
    joint = target.joint_of["hips"]
    if joint == 0:
        return place
    places, _ = kinematics.forward(target.skeleton, rotations, np.zeros_like(place))
    return place - places[:, joint]


def scaled_root(
    source: Prediction, target: Character, rotations: np.ndarray, rule: str, reference: Prediction | None
) -> np.ndarray:
    """``(frames, 3)`` metres: the target's root path under a root rule (``root_rules.ROOT_RULES``).

    rotations: ``(frames, joints, 4)`` the target's, needed where the hips are not the root.
    reference: whose path the rule ``reference`` takes. Raises NotSupported where that is missing.
    """
    if rule == "reference":
        if reference is None:
            raise NotSupported("root rule reference needs a reference motion, and this case has none")
        return reference.root
    ratios = root_rules.ratios(rule, source.character, target)
    return root_from_hips(target, rotations, hips(source) * ratios)


def carry(source: Motion, target: Character, rule: str, reference: Prediction | None = None) -> Motion:
    """The source's pose on the target: orientations copied relative to the reference pose, root by rule."""
    carried = _carrying(source.character, target)
    local = rotation.continuous(  # from_relative of orientations, which are never there all at once
        rotation.in_blocks(lambda some: _local(target, carried(some)), source.global_rotations)
    )
    root = scaled_root(source, target, local, rule, reference)
    return target.motion(local, root, source.fps)
