"""Roles of nodes that a glTF file states: the humanoid maps of VRM.

After the specifications of VRM 0.x and 1.0 and of VRM animations (VRM Consortium): ``VRM``, ``VRMC_vrm``
and ``VRMC_vrm_animation``.
"""

from __future__ import annotations

from retarget_bench.motion.files.gltf.document import Document

_LIMBS = {
    "Shoulder": "shoulder",
    "UpperArm": "arm",
    "LowerArm": "forearm",
    "Hand": "hand",
    "UpperLeg": "up_leg",
    "LowerLeg": "leg",
    "Foot": "foot",
    "Toes": "toe",
}
_FINGERS = {"Thumb": "thumb", "Index": "index", "Middle": "middle", "Ring": "ring", "Little": "pinky"}
_SEGMENTS = ("Proximal", "Intermediate", "Distal")
_THUMB_SEGMENTS = ("Metacarpal", "Proximal", "Distal")
"""Of VRM 1.0; VRM 0.x names a thumb as the other fingers."""
_SPINE = ("spine", "chest", "upperChest")


def roles(document: Document) -> dict[int, str]:
    """Node -> role, as the file states it; empty where it states none. Raises FileError where it is
    damaged."""
    extensions = document.inside(document.content, "extensions", "the file")
    for name in ("VRMC_vrm", "VRMC_vrm_animation", "VRM"):
        if name in extensions:
            humanoid = document.inside(document.inside(extensions, name, "the file"), "humanoid", name)
            bones = _nodes(document, humanoid, name)
            role_of = _roles_of_bones(name, bones)
            return {node: role_of[bone] for bone, node in reversed(bones.items()) if bone in role_of}
    return {}


def _nodes(document: Document, humanoid: dict[str, object], name: str) -> dict[str, int]:
    """Bone -> node. VRM 0.x has a list of bones, VRM 1.0 an object."""
    if name == "VRM":
        bones = [(each.get("bone"), each) for each in document.listed(humanoid, "humanBones", name)]
    else:
        table = document.inside(humanoid, "humanBones", name)
        bones = [(bone, document.inside(table, bone, name)) for bone in table]
    nodes: dict[str, int] = {}
    for bone, entry in bones:
        node = document.integer(entry, "node", f"{name} humanBones")
        document.item("nodes", node, name)
        nodes.setdefault(str(bone), node)
    return nodes


def _roles_of_bones(name: str, bones: dict[str, int]) -> dict[str, str]:
    """Bone -> role. bones: those that the file has."""
    spine = [bone for bone in _SPINE if bone in bones]
    out = {"hips": "hips", "neck": "neck", "head": "head"}
    out |= {bone: f"spine_{number}" for number, bone in enumerate(spine, 1)}
    for side in ("left", "right"):
        out |= {f"{side}{bone}": f"{side}_{part}" for bone, part in _LIMBS.items()}
        for bone, finger in _FINGERS.items():
            segments = _THUMB_SEGMENTS if bone == "Thumb" and name != "VRM" else _SEGMENTS
            for number, segment in enumerate(segments, 1):
                out[f"{side}{bone}{segment}"] = f"{side}_{finger}_{number}"
    return out
