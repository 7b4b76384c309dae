"""Through which trained structure's networks a body goes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from retarget_bench.errors import SkeletonError
from retarget_bench.motion.character import Character

from .body import Body, cast, missing, own

if TYPE_CHECKING:
    from .structure import Structure

FOUR: Final = "four_legged"
"""What follows a structure's name where it stands on four legs."""


@dataclass(frozen=True, eq=False)
class Seat:
    """A character in a trained structure.

    structure: its key; "": there is none. body: the character in its layout; None: there is none.
    refusal:   why the character cannot be seen there, as a sentence, or "".
    """

    structure: str
    body: Body | None
    refusal: str

    @property
    def taken(self) -> Body:
        """The body, of a seat that does not refuse it."""
        assert self.body is not None
        return self.body

    @property
    def note(self) -> str:
        """Through which trained structure the body goes, as a sentence; "" where it is its own."""
        mine = self.taken.character
        unseen, absent = _misfit(self.taken)
        if not absent and not unseen and key_of(mine) == self.structure:
            return ""
        more = [f"{absent} joints there that it lacks are bones of no length"] if absent else []
        more += [f"{unseen} of its own are not seen"] if unseen else []
        differs = "; ".join(("", *more))
        known = self.structure.removesuffix(f"_{FOUR}")
        return f"{mine.name} ({mine.structure}) goes through the networks of {known}{differs}"


def seated(character: Character, structures: Mapping[str, Structure]) -> Seat:
    """The structure, on as many legs, that misses fewest of the character's joints, then the one of whose
    joints it lacks fewest; its own where several fit alike."""
    try:
        own(character)
    except SkeletonError as error:
        return Seat("", None, str(error))
    fitting = [name for name in structures if name.endswith(FOUR) == character.four_legged]
    if not fitting:
        legs = "four legs" if character.four_legged else "two legs"
        return Seat("", None, f"{character.name} stands on {legs}, and these weights know no such body")
    bodies = {name: cast(character, structures[name].layout) for name in fitting}
    mine = key_of(character)
    best = min(fitting, key=lambda name: (*_misfit(bodies[name]), name != mine, name))
    return Seat(best, bodies[best], missing(bodies[best]))


def _misfit(body: Body) -> tuple[int, int]:
    """Joints of the body that the layout does not have, and joints of the layout that the body lacks."""
    known = {joint for joint in body.joints if joint >= 0}
    return len(set(own(body.character).joints) - known), sum(joint < 0 for joint in body.joints)


def key_of(character: Character) -> str:
    """What a structure's tensors begin with: a name that torch takes for a module, without a dot."""
    from torch import nn

    name = character.structure.replace(".", "_")
    if character.four_legged:
        return f"{name}_{FOUR}"
    return f"{name}_" if name.endswith(FOUR) or hasattr(nn.ModuleDict(), name) else name
