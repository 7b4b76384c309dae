"""Roles of bones in the words of VRM's humanoids (glTF) and of HumanIK's characters (FBX)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_LIMBS = {
    "shoulder": "shoulder",
    "hand": "hand",
    "foot": "foot",
    **dict.fromkeys(("upperarm", "arm"), "arm"),
    **dict.fromkeys(("lowerarm", "forearm"), "forearm"),
    **dict.fromkeys(("upperleg", "upleg"), "up_leg"),
    **dict.fromkeys(("lowerleg", "leg"), "leg"),
    **dict.fromkeys(("toes", "toebase"), "toe"),
}
_SIDED = re.compile(r"(left|right)(.+)")
_FINGER = re.compile(r"(?:hand)?(thumb|index|middle|ring|little|pinky)([1-9]|[a-z]+)")
SEGMENTS = ("proximal", "intermediate", "distal")


def roles_of(
    bones: Iterable[str], spine: Sequence[str], neck: Sequence[str], thumb: Sequence[str] = SEGMENTS
) -> dict[str, str]:
    """Bone -> role, of those that have one; rolls and metacarpals of fingers have none.

    spine, neck: the bones of these chains, from the hips on. thumb: the words for its segments.
    """
    roles = {bone: f"spine_{number}" for number, bone in enumerate(spine, 1)}
    roles |= {bone: f"neck_{number}" if len(neck) > 1 else "neck" for number, bone in enumerate(neck, 1)}
    for bone in bones:
        sided = _SIDED.fullmatch(bone.lower())
        if sided is None:
            if bone.lower() in ("hips", "head"):
                roles[bone] = bone.lower()
            continue
        side, part = sided.groups()
        if part in _LIMBS:
            roles[bone] = f"{side}_{_LIMBS[part]}"
        elif match := _FINGER.fullmatch(part):
            finger, segment = match.groups()
            words = thumb if finger == "thumb" else SEGMENTS
            if segment.isdigit() or segment in words:
                number = int(segment) if segment.isdigit() else words.index(segment) + 1
                roles[bone] = f"{side}_{'pinky' if finger == 'little' else finger}_{number}"
    return roles
