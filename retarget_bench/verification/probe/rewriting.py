"""The same body or motion, written differently: other names, order, axes, rest pose, bones, size, side.

Every function gives a new Motion (or Character) in which each original joint is where it was, or where the
function says. None of them looks at what a joint is called.
"""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import Measures
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import chain
from retarget_bench.motion.skeleton import EndSite, Skeleton

MIRROR = np.array([-1.0, 1.0, 1.0])
"""Left and right change places: left is +X."""
_MIRRORED_TURN = np.array([1.0, 1.0, -1.0, -1.0])


# --------------------------------------------------------------------------------------- names and order
def renamed(character: Character) -> Character:
    """The same body with names that say nothing (``j00``, ``j01``, ...); roles are kept."""
    width = len(str(len(character.skeleton)))
    names = tuple(f"j{joint:0{width}d}" for joint in range(len(character.skeleton)))
    return replace(character, skeleton=replace(character.skeleton, names=names), skin=None)


def other_order(character: Character) -> np.ndarray:
    """``(joints,)`` the joints in another order that still puts parents before children: branches last
    to first."""
    order: list[int] = []

    def visit(joint: int) -> None:
        order.append(joint)
        for child in reversed(character.skeleton.children[joint]):
            visit(child)

    visit(0)
    return np.array(order)


def reordered(character: Character, order: np.ndarray) -> Character:
    """The same body with its joints listed in this order."""
    return _selected(character, order, np.argsort(order))


def _selected(character: Character, kept: np.ndarray, place: np.ndarray) -> Character:
    """The body with some of its joints in another order; ``place``: old joint -> new joint."""
    skeleton = character.skeleton
    parents = skeleton.parents[kept]
    return replace(
        character,
        skeleton=Skeleton(
            tuple(skeleton.names[joint] for joint in kept),
            np.where(parents >= 0, place[parents], -1),
            skeleton.offsets[kept],
            _end_sites((place[site.parent], site.offset) for site in skeleton.end_sites),
        ),
        roles=tuple(character.roles[joint] for joint in kept),
        reference_pose=character.reference_pose[kept],
        skin=None,
    )


def _end_sites(sites: Iterable[tuple[int, Sequence[float] | np.ndarray]]) -> tuple[EndSite, ...]:
    """Tips, from joints and offsets."""
    return tuple(EndSite(int(joint), tuple(np.array(offset).tolist())) for joint, offset in sites)


# --------------------------------------------------------------------------------------- frames of joints
def reframed(character: Character, turns: np.ndarray) -> Character:
    """The same body with the axes of each joint turned by ``turns`` ``(joints, 4)``: another rest pose.

    A joint that was oriented G is now oriented G * turn.
    """
    skeleton, back = character.skeleton, rotation.conjugate(turns)
    offsets = np.array(skeleton.offsets)
    offsets[1:] = rotation.rotate(back[skeleton.parents[1:]], skeleton.offsets[1:])
    tips = _end_sites(
        (site.parent, rotation.rotate(back[site.parent], np.array(site.offset)))
        for site in skeleton.end_sites
    )
    return replace(
        character,
        skeleton=replace(skeleton, offsets=offsets, end_sites=tips),
        reference_pose=_reframed(skeleton, character.reference_pose, turns),
        skin=None,
    )


def reframed_motion(motion: Motion, turns: np.ndarray) -> Motion:
    """The same motion on the reframed body: every joint where it was."""
    rotations = _reframed(motion.skeleton, motion.rotations, turns)
    return Motion(reframed(motion.character, turns), rotations, motion.root, motion.fps)


def _reframed(skeleton: Skeleton, rotations: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Local rotations ``(..., joints, 4)`` in the turned frames."""
    turned = rotation.multiply(rotations, turns)
    above = rotation.conjugate(turns[skeleton.parents[1:]])
    turned[..., 1:, :] = rotation.multiply(above, turned[..., 1:, :])
    return turned


def one_axis(character: Character) -> np.ndarray:
    """``(joints, 4)`` turns after which every bone with one continuation rests along +X."""
    skeleton, turns = character.skeleton, rotation.identity(len(character.skeleton))
    for joint, children in enumerate(skeleton.children):
        if children and np.linalg.norm(bone := skeleton.offsets[children[0]]) > 1e-9:
            turns[joint] = rotation.between(np.array([1.0, 0.0, 0.0]), bone / np.linalg.norm(bone))
        elif joint:
            turns[joint] = turns[skeleton.parents[joint]]
    return turns


def z_up(character: Character) -> np.ndarray:
    """``(joints, 4)`` turns of a body authored with Z up: a quarter turn about X of every joint."""
    quarter = rotation.about(np.array([1.0, 0.0, 0.0]), np.pi / 2)
    return np.tile(quarter, (len(character.skeleton), 1))


# --------------------------------------------------------------------------------------- bones
def splittable(character: Character) -> list[int]:
    """Lower ends of bones that files split: forearm, shin and the first spine bone, where they are."""
    wanted = [f"{side}_{end}" for side in ("left", "right") for end in ("hand", "foot")]
    return sorted(character.joints([*wanted, "spine_1"]))


def split(character: Character, ends: Sequence[int]) -> tuple[Character, np.ndarray]:
    """Put a joint without a role in the middle of each bone that ends in one of ``ends``.

    Also gives the new indices ``(joints,)`` of the old joints.
    """
    skeleton, joints = character.skeleton, np.arange(len(character.skeleton))
    copies = 1 + np.isin(joints, ends)
    old = np.repeat(joints, copies)  # of every new joint, the old one; the half comes before the joint
    place = np.cumsum(copies) - 1
    half = place[old] != np.arange(len(old))
    parents = np.where(skeleton.parents[old] < 0, -1, place[skeleton.parents[old]])
    parents[1:][half[:-1]] = np.flatnonzero(half)
    pose = character.reference_pose[old]
    pose[half] = rotation.identity()
    new = list(zip(old.tolist(), half.tolist(), strict=True))
    tips = _end_sites((place[site.parent], site.offset) for site in skeleton.end_sites)
    body = replace(
        character,
        skeleton=Skeleton(
            tuple(skeleton.names[joint] + at_half * "_half" for joint, at_half in new),
            parents,
            skeleton.offsets[old] / copies[old, None],
            tips,
        ),
        structure=f"{character.structure} split",
        roles=tuple(None if at_half else character.roles[joint] for joint, at_half in new),
        reference_pose=pose,
        skin=None,
    )
    return body, place


def split_motion(motion: Motion, ends: Sequence[int]) -> Motion:
    """The same motion on the split body; the new joints do not turn."""
    body, place = split(motion.character, ends)
    rotations = rotation.identity(motion.frames, len(body.skeleton))
    rotations[:, place] = motion.rotations
    return Motion(body, rotations, motion.root, motion.fps)


def mergeable(character: Character) -> int | None:
    """The spine joint in the middle that can be left out, or None where the spine has fewer than three."""
    spine = chain(character.roles, "spine")
    return spine[len(spine) // 2] if len(spine) > 2 else None


def stiffened(motion: Motion, joint: int) -> Motion:
    """The motion with one joint held as it is in the reference pose."""
    rotations = np.array(motion.rotations)
    rotations[:, joint] = motion.character.reference_pose[joint]
    return replace(motion, rotations=rotations)


def merged(motion: Motion, joint: int) -> Motion:
    """A stiffened motion without the stiff joint; every other joint is where it was. Spine roles are
    counted anew."""
    character, skeleton = motion.character, motion.skeleton
    stiff, parent = character.reference_pose[joint], int(skeleton.parents[joint])
    parents, offsets, pose, rotations = map(
        np.array, (skeleton.parents, skeleton.offsets, character.reference_pose, motion.rotations)
    )
    # first its children and tips are hung from its parent
    for child in skeleton.children[joint]:
        parents[child] = parent
        offsets[child] = skeleton.offsets[joint] + rotation.rotate(stiff, skeleton.offsets[child])
        pose[child] = rotation.multiply(stiff, pose[child])
        rotations[:, child] = rotation.multiply(stiff, rotations[:, child])
    tips = _end_sites(
        (parent, skeleton.offsets[joint] + rotation.rotate(stiff, np.array(site.offset)))
        if site.parent == joint
        else (site.parent, site.offset)
        for site in skeleton.end_sites
    )
    roles = list(character.roles)
    roles[joint] = None
    for rank, each in enumerate(j for j in chain(character.roles, "spine") if j != joint):
        roles[each] = f"spine_{rank + 1}"
    body = replace(
        character,
        skeleton=Skeleton(skeleton.names, parents, offsets, tips),
        structure=f"{character.structure} merged",
        roles=tuple(roles),
        reference_pose=pose,
    )
    kept = np.array([j for j in range(len(skeleton)) if j != joint])
    place = np.arange(len(skeleton)) - (np.arange(len(skeleton)) > joint)
    return Motion(_selected(body, kept, place), rotations[:, kept], motion.root, motion.fps)


# --------------------------------------------------------------------------------------- size and side
def scaled(character: Character, factor: float) -> Character:
    """The same body in another size."""
    skeleton = character.skeleton
    tips = _end_sites((site.parent, factor * np.array(site.offset)) for site in skeleton.end_sites)
    return replace(
        character,
        skeleton=replace(skeleton, offsets=skeleton.offsets * factor, end_sites=tips),
        measures=Measures(**{name: factor * size for name, size in asdict(character.measures).items()}),
        skin=None,
    )


def scaled_motion(motion: Motion, factor: float) -> Motion:
    """The same motion in another size."""
    body = scaled(motion.character, factor)
    return replace(motion, character=body, root=motion.root * factor)


def partners(character: Character) -> np.ndarray | None:
    """``(joints,)`` for every joint the one on the other side (itself in the middle); None where the tree
    is not the same on both sides."""
    skeleton = character.skeleton
    partner = np.full(len(skeleton), -1)
    partner[0] = 0
    for joint in range(1, len(skeleton)):
        partner[joint] = _partner(character, joint, int(partner[skeleton.parents[joint]]))
    back = (partner >= 0).all() and (partner[partner] == np.arange(len(partner))).all()
    return partner if back else None


def _partner(character: Character, joint: int, above: int) -> int:
    """The partner of a joint whose parent's partner is ``above``; -1 where there is none."""
    role, skeleton = character.roles[joint], character.skeleton
    if role is not None:
        return character.joint_of.get(other_side(role), -1)
    free, mine = (
        [each for each in skeleton.children[parent] if character.roles[each] is None] if parent >= 0 else []
        for parent in (above, skeleton.parents[joint])
    )
    return free[mine.index(joint)] if len(free) == len(mine) else -1


def other_side(role: str) -> str:
    """``left_hand`` -> ``right_hand`` and back; what has no side stays."""
    side, _, rest = role.partition("_")
    other = {"left": "right", "right": "left"}.get(side)
    return f"{other}_{rest}" if other else role


def mirrored(character: Character, partner: np.ndarray) -> Character:
    """The mirror image of a body, its joints in the same order with the same names and roles."""
    skeleton = character.skeleton
    # a tip goes to the other side: its joint's partner carries the image
    tips = _end_sites((partner[site.parent], MIRROR * np.array(site.offset)) for site in skeleton.end_sites)
    return replace(
        character,
        skeleton=replace(skeleton, offsets=skeleton.offsets[partner] * MIRROR, end_sites=tips),
        reference_pose=character.reference_pose[partner] * _MIRRORED_TURN,
        skin=None,
    )


def mirrored_motion(motion: Motion, partner: np.ndarray) -> Motion:
    """The mirror image of a motion: joint k does what its partner did, seen in the mirror."""
    body = mirrored(motion.character, partner)
    rotations = motion.rotations[:, partner] * _MIRRORED_TURN
    return Motion(body, rotations, motion.root * MIRROR, motion.fps)


def turned_motion(motion: Motion, angle: float) -> Motion:
    """The whole motion turned about the vertical through the origin, radians."""
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), angle)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = rotation.multiply(turn, rotations[:, 0])
    return replace(motion, rotations=rotations, root=rotation.rotate(turn, motion.root))
