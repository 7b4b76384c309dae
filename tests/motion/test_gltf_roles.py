"""Roles that glTF files state: humanoid maps of VRM, over whatever nodes are called."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import NAMES, ROLES, Made, person

from retarget_bench.errors import FileError
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.findings import NO_ROLE
from retarget_bench.motion.importer import load

BONES = (
    *("hips", "chest", "neck", "head"),
    *("leftUpperArm", "leftLowerArm", "leftHand", "rightUpperArm", "rightLowerArm", "rightHand"),
    *("leftUpperLeg", "leftLowerLeg", "leftFoot", "rightUpperLeg", "rightLowerLeg", "rightFoot"),
)
"""What VRM calls the joints of ``gltf_files.NAMES``."""


def vrm_0(nodes: dict[str, int]) -> dict[str, Any]:
    bones = [{"bone": bone, "node": node, "useDefaultValues": True} for bone, node in nodes.items()]
    return {"VRM": {"humanoid": {"humanBones": bones}}}


def vrm_1(nodes: dict[str, int]) -> dict[str, Any]:
    bones = {bone: {"node": node} for bone, node in nodes.items()}
    return {"VRMC_vrm": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}}


def vrm_animation(nodes: dict[str, int]) -> dict[str, Any]:
    return {"VRMC_vrm_animation": vrm_1(nodes)["VRMC_vrm"]}


KINDS = (vrm_0, vrm_1, vrm_animation)


def written(path: Path, extensions: Callable[[dict[str, int]], dict[str, Any]], names: list[str]) -> Path:
    asset = person(np.random.default_rng(3))
    for node, name in enumerate(names, 1):
        asset.content["nodes"][node]["name"] = name
    asset.content["extensions"] = extensions({bone: node for node, bone in enumerate(BONES, 1)})
    return asset.save(path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_humanoid_map_says_what_nodes_of_any_name_are(tmp_path: Path, kind: Any) -> None:
    findings = load(written(tmp_path / "a.glb", kind, [f"node {n}" for n in range(len(NAMES))])).findings
    assert [role for _, role in findings.joints] == list(ROLES)
    assert any("16 joints have the roles that the file states" in note for note in findings.notes)


@pytest.mark.parametrize("kind", KINDS)
def test_a_humanoid_map_wins_over_names_and_the_user_over_both(tmp_path: Path, kind: Any) -> None:
    swapped = [name.replace("Left", "\0").replace("Right", "Left").replace("\0", "Right") for name in NAMES]
    path = written(tmp_path / "a.glb", kind, swapped)
    assert [role for _, role in load(path).findings.joints] == list(ROLES)
    reading = Reading(roles={"Head": None, "Neck": "head"})
    assert [role for _, role in load(path, reading).findings.joints[2:4]] == ["head", "not understood"]


def test_thumbs_begin_with_a_metacarpal_in_vrm_1_only(tmp_path: Path) -> None:
    for kind, segments in ((vrm_0, "Proximal Intermediate Distal"), (vrm_1, "Metacarpal Proximal Distal")):
        asset = Made()
        asset.add("nodes", {"name": "root", "children": [1], "translation": [0, 1, 0]})
        for node in (1, 2, 3):
            below = {"children": [node + 1]} if node < 3 else {}
            asset.add("nodes", {"name": f"n{node}", "translation": [0.1, 0, 0], **below})
        asset.content["scenes"] = [{"nodes": [0]}]
        thumb = {f"leftThumb{segment}": node for node, segment in enumerate(segments.split(), 1)}
        asset.content["extensions"] = kind({"leftHand": 0, **thumb})
        times = asset.array(np.arange(2.0))
        turns = asset.array([[0, 0, 0, 1], [0, 0, 0.1, 1]])
        asset.animate("act", {(node, "rotation"): (times, turns) for node in range(4)})
        roles = [role for _, role in load(asset.save(tmp_path / "thumb.glb")).findings.joints]
        assert roles == ["left_hand", "left_thumb_1", "left_thumb_2", "left_thumb_3"]


@pytest.mark.parametrize(
    "extensions",
    [
        {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 99}}}}},
        {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": "one"}}}}},
        {"VRMC_vrm": {"humanoid": {"humanBones": {"hips": 1}}}},
        {"VRM": {"humanoid": {"humanBones": {"hips": 1}}}},
        {"VRM": {"humanoid": {"humanBones": [1]}}},
        {"VRM": []},
        [],
    ],
)
def test_damaged_maps_are_named(tmp_path: Path, extensions: Any) -> None:
    path = written(tmp_path / "a.glb", lambda _: extensions, list(NAMES))
    with pytest.raises(FileError):
        load(path)


@pytest.mark.parametrize("bone", ["jaw", "leftEye", "tail", None, 3])
def test_bones_that_have_no_role_are_passed_over(tmp_path: Path, bone: Any) -> None:
    path = written(tmp_path / "a.glb", lambda nodes: vrm_0({**nodes, bone: 0}), list(NAMES))
    assert [role for _, role in load(path).findings.joints if role not in NO_ROLE] == list(ROLES)
