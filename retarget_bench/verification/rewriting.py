"""Questions written differently: bodies by names, order, axes, rest pose, bones, size and side, and cases.

Most functions give a body as ``Rewritten``, which also rewrites its motions, or a sentence that says why it
cannot be written so. None of them looks at what a joint is called.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from retarget_bench.api import Case, Source
from retarget_bench.motion import rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import Measures
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.roles import chain
from retarget_bench.motion.skeleton import EndSite, Skeleton

MIRROR = np.array([-1.0, 1.0, 1.0])
"""Left and right change places: left is +X."""
_MIRRORED_TURN = np.array([1.0, 1.0, -1.0, -1.0])


def _as_they_are(rotations: np.ndarray) -> np.ndarray:
    return rotations


@dataclass(frozen=True)
class Rewritten:
    """A body written differently.

    rotations: local rotations ``(frames, joints, 4)`` of a motion of the old body -> those of the new one.
    place:  ``(joints,)`` for every old joint the new one that is where it was; None: they are listed alike.
    factor: of all lengths, or of each axis ``(3,)``.
    """

    body: Character
    rotations: Callable[[np.ndarray], np.ndarray] = _as_they_are
    place: np.ndarray | None = None
    factor: float | np.ndarray = 1.0

    def motion(self, motion: Motion) -> Motion:
        """A motion of the old body, done by the new one."""
        return Motion(self.body, self.rotations(motion.rotations), motion.root * self.factor, motion.fps)

    def positions(self, new: np.ndarray) -> np.ndarray:
        """``(frames, joints, 3)`` positions of the new body's joints -> of the old joints, as they were."""
        return (new if self.place is None else new[:, self.place]) / self.factor


# --------------------------------------------------------------------------------------- names and order
def renamed(character: Character) -> Rewritten:
    """Names that say nothing (``j00``, ``j01``, ...); roles are kept."""
    width = len(str(len(character.skeleton)))
    names = tuple(f"j{joint:0{width}d}" for joint in range(len(character.skeleton)))
    return Rewritten(replace(character, skeleton=replace(character.skeleton, names=names), skin=None))


def reordered(character: Character) -> Rewritten:
    """The joints in another order that still puts parents before children: branches last to first."""
    order: list[int] = []

    def visit(joint: int) -> None:
        order.append(joint)
        for child in reversed(character.skeleton.children[joint]):
            visit(child)

    visit(0)
    kept, place = np.array(order), np.argsort(order)
    return Rewritten(_selected(character, kept, place), lambda rotations: rotations[:, kept], place)


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
def reframed(character: Character, turns: np.ndarray) -> Rewritten:
    """The axes of each joint turned by ``turns`` ``(joints, 4)``: another rest pose.

    A joint that was oriented G is now oriented G * turn.
    """
    skeleton, back = character.skeleton, rotation.conjugate(turns)
    offsets = np.array(skeleton.offsets)
    offsets[1:] = rotation.rotate(back[skeleton.parents[1:]], skeleton.offsets[1:])
    tips = _end_sites(
        (site.parent, rotation.rotate(back[site.parent], np.array(site.offset)))
        for site in skeleton.end_sites
    )

    def turned(rotations: np.ndarray) -> np.ndarray:
        new = rotation.multiply(rotations, turns)
        new[..., 1:, :] = rotation.multiply(back[skeleton.parents[1:]], new[..., 1:, :])
        return new

    body = replace(
        character,
        skeleton=replace(skeleton, offsets=offsets, end_sites=tips),
        reference_pose=turned(character.reference_pose),
        skin=None,
    )
    return Rewritten(body, turned)


def one_axis(character: Character) -> Rewritten:
    """Every bone with one continuation rests along +X."""
    skeleton, turns = character.skeleton, rotation.identity(len(character.skeleton))
    for joint, children in enumerate(skeleton.children):
        if children and np.linalg.norm(bone := skeleton.offsets[children[0]]) > 1e-9:
            turns[joint] = rotation.between(np.array([1.0, 0.0, 0.0]), bone / np.linalg.norm(bone))
        elif joint:
            turns[joint] = turns[skeleton.parents[joint]]
    return reframed(character, turns)


def z_up(character: Character) -> Rewritten:
    """Authored with Z up: a quarter turn about X of every joint."""
    quarter = rotation.about(np.array([1.0, 0.0, 0.0]), np.pi / 2)
    return reframed(character, np.tile(quarter, (len(character.skeleton), 1)))


# --------------------------------------------------------------------------------------- bones
SPLIT = ("left_hand", "right_hand", "left_foot", "right_foot", "spine_1")
"""Lower ends of bones that files split: forearm, shin and the first spine bone."""


def split(character: Character) -> Rewritten | str:
    """A joint without a role in the middle of each bone that ends in one of ``SPLIT``; it does not turn."""
    skeleton, joints = character.skeleton, np.arange(len(character.skeleton))
    if not (ends := character.joints(SPLIT)):
        return "the {side} has no bone that files split"
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

    def halved(rotations: np.ndarray) -> np.ndarray:
        new = rotation.identity(len(rotations), len(body.skeleton))
        new[:, place] = rotations
        return new

    return Rewritten(body, halved, place)


def mergeable(character: Character) -> int | None:
    """The spine joint in the middle that can be left out, or None where the spine has fewer than three."""
    spine = chain(character.roles, "spine")
    return spine[len(spine) // 2] if len(spine) > 2 else None


def stiffened(motion: Motion, joint: int) -> Motion:
    """The motion with one joint held as it is in the reference pose."""
    rotations = np.array(motion.rotations)
    rotations[:, joint] = motion.character.reference_pose[joint]
    return replace(motion, rotations=rotations)


def merged(character: Character, joint: int) -> Rewritten:
    """The body without one joint, which its motions must hold stiff (``stiffened``); every other joint
    stays where it is. Spine roles are counted anew."""
    skeleton, stiff = character.skeleton, character.reference_pose[joint]
    above, children = int(skeleton.parents[joint]), list(skeleton.children[joint])
    kept = np.delete(np.arange(len(skeleton)), joint)
    place = np.searchsorted(kept, np.arange(len(skeleton)))

    def carried(offset: np.ndarray) -> np.ndarray:
        return skeleton.offsets[joint] + rotation.rotate(stiff, offset)

    def without(rotations: np.ndarray) -> np.ndarray:
        turned = np.array(rotations)
        turned[..., children, :] = rotation.multiply(stiff, turned[..., children, :])
        return turned[..., kept, :]

    parents, offsets = np.array(skeleton.parents), np.array(skeleton.offsets)
    parents[children], offsets[children] = above, carried(offsets[children])
    tips = _end_sites(
        (above, carried(np.array(site.offset))) if site.parent == joint else (site.parent, site.offset)
        for site in skeleton.end_sites
    )
    roles = list(character.roles)
    for rank, each in enumerate(j for j in chain(character.roles, "spine") if j != joint):
        roles[each] = f"spine_{rank + 1}"
    body = replace(
        character,
        skeleton=Skeleton(skeleton.names, parents, offsets, tips),
        structure=f"{character.structure} merged",
        roles=tuple(None if j == joint else role for j, role in enumerate(roles)),
    )
    body = _selected(body, kept, place)
    return Rewritten(replace(body, reference_pose=without(character.reference_pose)), without, place)


# --------------------------------------------------------------------------------------- size and side
def scaled(character: Character, factor: float) -> Rewritten:
    """Another size."""
    body = replace(
        character,
        skeleton=character.skeleton.scaled(factor),
        measures=Measures(**{name: factor * size for name, size in asdict(character.measures).items()}),
        skin=None,
    )
    return Rewritten(body, factor=factor)


def mirrored(character: Character) -> Rewritten | str:
    """The mirror image, its joints in the same order with the same names and roles: each does what its
    partner did, seen in the mirror."""
    partner, skeleton = partners(character), character.skeleton
    if partner is None:
        return "the joints of the {side} are not the same on both sides"
    # a tip goes to the other side: its joint's partner carries the image
    tips = _end_sites((partner[site.parent], MIRROR * np.array(site.offset)) for site in skeleton.end_sites)
    body = replace(
        character,
        skeleton=replace(skeleton, offsets=skeleton.offsets[partner] * MIRROR, end_sites=tips),
        reference_pose=character.reference_pose[partner] * _MIRRORED_TURN,
        skin=None,
    )
    return Rewritten(body, lambda rotations: rotations[:, partner] * _MIRRORED_TURN, partner, MIRROR)


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
        return character.joint_of.get(_other_side(role), -1)
    free, own = (
        [each for each in skeleton.children[parent] if character.roles[each] is None] if parent >= 0 else []
        for parent in (above, skeleton.parents[joint])
    )
    return free[own.index(joint)] if len(free) == len(own) else -1


def _other_side(role: str) -> str:
    """``left_hand`` -> ``right_hand`` and back; what has no side stays."""
    side, _, rest = role.partition("_")
    other = {"left": "right", "right": "left"}.get(side)
    return f"{other}_{rest}" if other else role


# --------------------------------------------------------------------------------------- cases
def resized(case: Case, frames: int) -> Case:
    """The first frames of a case; where it is shorter, it goes back and forth."""
    there_and_back = np.arange(max(2 * case.source.frames - 2, 1))
    turning = np.minimum(there_and_back, len(there_and_back) - there_and_back)
    part = np.resize(turning, frames)
    contacts = case.contacts
    if contacts is not None:
        pivoting = None if contacts.pivoting is None else contacts.pivoting[part]
        contacts = replace(contacts, planted=contacts.planted[part], pivoting=pivoting)
    touches = case.touches and tuple(replace(touch, rests=touch.rests[part]) for touch in case.touches)
    return replace(_changed(case, lambda motion: motion.at(part)), contacts=contacts, touches=touches)


def played(case: Case, fps: float) -> Case:
    """The same frames at another rate."""
    return _changed(case, lambda motion: replace(motion, fps=fps))


def _changed(case: Case, change: Callable[[Source], Source]) -> Case:
    """The case with all of its motions changed alike."""
    motions = {
        name: getattr(case, name) for name in ("source", "reference", "alternative", "source_motion")
    }
    changed: dict[str, Any] = {name: change(each) for name, each in motions.items() if each is not None}
    return replace(case, **changed)
