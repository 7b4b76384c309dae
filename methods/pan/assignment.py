"""Assignment of characters to a trained structure, also of those whose own structure is not trained."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.training.layers.skeletal.body import FOUR, LayoutBody, aligned, structure_key, tree_of
from retarget_bench.training.layers.skeletal.layout import Layout
from retarget_bench.training.layers.skeletal.tree import where_legs_begin

if TYPE_CHECKING:
    from .structure import Structure


@dataclass(frozen=True, eq=False)
class Assignment:
    """A skeleton assignment: the key of a trained structure, and a character in its layout."""

    structure: str
    body: LayoutBody

    @property
    def note(self) -> str:
        """A sentence on the trained structure that the body goes through; "" where it is its own."""
        character = self.body.character
        unseen, absent = _misfit(self.body)
        if not absent and not unseen and structure_key(character) == self.structure:
            return ""
        more = [f"{absent} joints there that it lacks are bones of no length"] if absent else []
        more += [f"{unseen} of its own are not seen"] if unseen else []
        differs = "; ".join(("", *more))
        trained = self.structure.removesuffix(f"_{FOUR}")
        return f"{character.name} ({character.structure}) goes through the networks of {trained}{differs}"


def assign(character: Character, structures: Mapping[str, Structure]) -> Assignment:
    """Choose the structure on as many legs that has most of the character's joints.

    Of several, the one of whose joints the character lacks fewest, then its own. Raises SkeletonError and
    NotSupported, with a sentence, where there is none, or none of the joints of its parts."""
    aligned(character)
    fitting = [name for name in structures if name.endswith(FOUR) == character.four_legged]
    if not fitting:
        legs = "four legs" if character.four_legged else "two legs"
        raise NotSupported(f"{character.name} stands on {legs}, and these weights know no such body")
    bodies = {name: in_layout(character, structures[name].layout) for name in fitting}
    structure = structure_key(character)
    best = min(fitting, key=lambda name: (*_misfit(bodies[name]), name != structure, name))
    body = bodies[best]
    leads = body.layout.leads
    if not any(body.joints[leads[edge]] >= 0 for part in body.layout.parts for edge in part):
        names = ", ".join(name.replace("_", " ") for name in body.layout.names)
        raise NotSupported(f"{character.name} has no joint of any part that these weights know ({names})")
    return Assignment(best, body)


def _misfit(body: LayoutBody) -> tuple[int, int]:
    """Number of the body's joints that the layout lacks, and of the layout's that the body lacks."""
    matched = {joint for joint in body.joints if joint >= 0}
    return len(set(aligned(body.character).joints) - matched), sum(joint < 0 for joint in body.joints)


def in_layout(character: Character, layout: Layout) -> LayoutBody:
    """The character in this layout: joint for joint where it is of that structure, else by roles.

    Joints without a role are matched by their order between joints with one."""
    aligned_body = aligned(character)
    for turned in (False, True):
        parents, joints = tree_of(character, turned)
        roles = tuple(character.roles[joint] for joint in joints)
        if tuple(parents) == layout.parents and roles == layout.roles:
            return LayoutBody(character, layout, joints)
    by_role = [character.joint_of.get(role, -1) if role else -1 for role in layout.roles]
    if layout.roles[0] != "hips":
        by_role[0] = aligned_body.joints[
            where_legs_begin(aligned_body.skeleton.parents.tolist(), aligned_body.roles)
        ]
        by_role[1:] = [joint if joint != by_role[0] else -1 for joint in by_role[1:]]
    matched = [joint if joint in aligned_body.joints else -1 for joint in by_role]
    for rank in range(len(matched)):
        if matched[rank] >= 0:
            _between(character, layout, rank, matched)
    return LayoutBody(character, layout, tuple(matched))


def _between(character: Character, layout: Layout, rank: int, matched: list[int]) -> None:
    """Match the joints without a role above a matched joint, up to the next matched one."""
    ranks, above = [], layout.parents[rank]
    while above > 0 and matched[above] < 0:
        ranks.append(above)
        above = layout.parents[above]
    if not ranks or matched[above] < 0:
        return
    parents = character.skeleton.parents.tolist()
    joints, joint = [], parents[matched[rank]]
    while joint >= 0 and joint != matched[above]:
        joints.append(joint)
        joint = parents[joint]
    unnamed = (each for each in joints if character.roles[each] is None and each not in matched)
    for free, other in zip((each for each in ranks if layout.roles[each] is None), unnamed, strict=False):
        matched[free] = other
