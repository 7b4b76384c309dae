"""Structures that a method with networks for each is trained on, and those of its weights."""

from collections.abc import Iterable, Mapping

from retarget_bench.motion.character import Character

TWO_LEGGED, ALL = "two_legged", "all"
"""Values of a parameter ``structures``; otherwise names of structures joined by ``+``."""


def not_among(character: Character, structures: str, method: str) -> str:
    """Reason why a body is not of the structures that a method is for; "" if it is."""
    if structures == TWO_LEGGED:
        if character.four_legged:
            return f"{character.name} stands on four legs, and this {method} is for bodies of two"
    elif structures != ALL and character.structure not in structures.split("+"):
        return f"{character.name} is of structure {character.structure}, not of {structures}"
    return ""


def unknown(
    character: Character,
    trained: Mapping[str, object],
    key: str,
    joints: object,
    names: Iterable[str] = (),
) -> str:
    """Reason why weights have no networks for a body; "" if they have.

    trained: key of a structure -> its joints, in a form that can be compared. key, joints: of the body.
    names: of the trained structures, where these are not their keys.
    """
    if key not in trained:
        listed = ", ".join(names or trained)
        return f"{character.name} is of structure {character.structure}, and these weights know {listed}"
    if trained[key] != joints:
        return f"{character.name} has other joints than the {character.structure} that these weights know"
    return ""
