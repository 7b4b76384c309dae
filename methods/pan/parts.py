"""The body parts whose edges PAN's networks attend to, on a structure of any joints."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

from retarget_bench.errors import BenchError
from retarget_bench.motion import roles as anatomy
from retarget_bench.training.layers.skeletal.layout import Layout, Slots

Parts = Mapping[str, tuple[str, ...]]
"""Name of a part -> what of ``roles.body_part`` belongs to it."""

SIX: Parts = {
    "left_leg": ("left_leg",),
    "right_leg": ("right_leg",),
    "spine": ("trunk",),
    "head": ("head",),
    "left_arm": ("left_arm",),
    "right_arm": ("right_arm",),
}
THREE: Parts = {"legs": ("left_leg", "right_leg"), "spine": ("trunk",), "head": ("head",)}
HIND, FORE = {"left_leg", "right_leg"}, {"left_arm", "right_arm"}
"""On four legs: a part that has the hind legs has the fore legs too, unless these are a part's by name."""
BRANCHES = {"head", "left_arm", "right_arm"}
"""The parts that leave the trunk at the chest: the edge that leads to the chest is theirs as well."""
BY_NAME = {"six": SIX, "three": THREE}


def parts_of(name: str) -> tuple[str, Parts]:
    """Parts by name: ``six``, ``three``, or a TOML file of ``part = ["left_leg", ...]``; and how they are
    known: by a name, where there is one for them, else by all that they have.

    Raises BenchError where the name is none of these, or the file does not say what parts have.
    """
    parts = BY_NAME[name] if name in BY_NAME else _read(name)
    for known_name, same in BY_NAME.items():
        if list(parts.items()) == list(same.items()):
            return known_name, parts
    return " ".join(f"{part}:{'+'.join(members)}" for part, members in parts.items()), parts


def _read(name: str) -> Parts:
    path = Path(name).expanduser()
    if path.suffix != ".toml":
        raise BenchError(f"parts of pan are six, three, or a .toml file, and not {name!r}")
    try:
        read = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BenchError(f"{path}: no file of body parts can be read here: {error}") from None
    for part, members in read.items():
        if (
            not isinstance(members, list)
            or not members
            or any(each not in anatomy.BODY_PARTS for each in members)
        ):
            names = ", ".join(anatomy.BODY_PARTS)
            raise BenchError(f"{path}: {part} has to be a list of some of {names}")
    if not read:
        raise BenchError(f"{path}: there is no part in it")
    return {part: tuple(members) for part, members in read.items()}


def layout_of(
    parents: Sequence[int],
    roles: Sequence[str | None],
    parts: Parts,
    four_legged: bool,
    slots: Slots = "edges",
) -> Layout:
    """The parts that a structure with these joints has. Raises BenchError where it has none."""
    where = _body_parts(parents, roles)
    apart = {member for members in parts.values() for member in members} & FORE
    by_part: dict[str, tuple[int, ...]] = {}
    for name, members in parts.items():
        regions = set(members)
        if four_legged and regions >= HIND and not apart:
            regions |= FORE
        own = {joint for joint in range(1, len(parents)) if where[joint] & regions}
        if own and slots == "edges":
            own = {joint - 1 for joint in own | _chests(parents, where, regions)}
        if own:
            by_part[name] = tuple(sorted(own))
    if not by_part:
        raise BenchError("there is no joint of any of the body parts that pan uses")
    return Layout(tuple(parents), tuple(roles), tuple(by_part), tuple(by_part.values()), slots, four_legged)


def _body_parts(parents: Sequence[int], roles: Sequence[str | None]) -> list[frozenset[str]]:
    """Body parts of each joint; without a role, those of its children (a pelvis that carries both legs is
    of both), or of what it hangs from."""
    by_role = [frozenset(() if role is None else (anatomy.body_part(role),)) for role in roles]
    body_parts = list(by_role)
    for joint in reversed(range(1, len(parents))):
        if not by_role[parents[joint]]:
            body_parts[parents[joint]] |= body_parts[joint]
    for joint in range(1, len(parents)):
        body_parts[joint] = body_parts[joint] or body_parts[parents[joint]]
    return body_parts


def _chests(parents: Sequence[int], where: Sequence[frozenset[str]], regions: set[str]) -> set[int]:
    """The joints where a part that branches from the chest begins."""
    begins = (
        parents[joint]
        for joint in range(1, len(parents))
        if where[joint] & regions & BRANCHES and where[parents[joint]] == {"trunk"}
    )
    return {chest for chest in begins if chest > 0}
