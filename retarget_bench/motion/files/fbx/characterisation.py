"""Roles of nodes that an FBX file states: HumanIK characterisations, as Maya and MotionBuilder write them.

A ``Character`` links nodes to its properties ``HipsLink``, ``LeftUpLegLink``, ... Rolls and metacarpals
have no role here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

_LIMBS = {
    "Shoulder": "shoulder",
    "Arm": "arm",
    "ForeArm": "forearm",
    "Hand": "hand",
    "UpLeg": "up_leg",
    "Leg": "leg",
    "Foot": "foot",
    "ToeBase": "toe",
}
_SIDED = re.compile(r"(Left|Right)(.+)")
_FINGER = re.compile(r"Hand(Thumb|Index|Middle|Ring|Pinky)([1-9])")
_CHAINED = re.compile(r"(Spine|Neck)([1-9]?)")


def roles(characters: Sequence[Mapping[str, int]], joints: Sequence[int]) -> dict[int, str]:
    """Node -> role, by the character that has most links to the joints of a body.

    characters: of each its links, by the property without ``Link``, and their nodes.
    """
    own = [{link: node for link, node in links.items() if node in joints} for links in characters]
    links = max(own, key=len, default={})
    role_of = _roles_of_links(links)
    return {node: role_of[link] for link, node in links.items() if link in role_of}


def _roles_of_links(links: Mapping[str, int]) -> dict[str, str]:
    """Link -> role. Spine, Spine1, ... are numbered from the hips on, as they come; so are necks."""
    out = {"Hips": "hips", "Head": "head"}
    for stem in ("Spine", "Neck"):
        chain = sorted(link for link in links if (match := _CHAINED.fullmatch(link)) and match[1] == stem)
        out |= {link: f"{stem.lower()}_{number}" for number, link in enumerate(chain, 1)}
        if stem == "Neck" and len(chain) == 1:
            out[chain[0]] = "neck"
    for link in links:
        if (sided := _SIDED.fullmatch(link)) is None:
            continue
        side, part = sided[1].lower(), sided[2]
        if part in _LIMBS:
            out[link] = f"{side}_{_LIMBS[part]}"
        elif finger := _FINGER.fullmatch(part):
            out[link] = f"{side}_{finger[1].lower()}_{finger[2]}"
    return out
