"""Roles that FBX files state: HumanIK characterisations, over whatever nodes are called."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fbx_files import Joint, Made, person
from gltf_files import ROLES

from retarget_bench.motion.files.fbx.reading import roles_by_links as roles
from retarget_bench.motion.importer import load

pytest.importorskip("ufbx")
pytestmark = pytest.mark.usefixtures("forked")

LINKS = (
    *("Hips", "Spine", "Neck", "Head"),
    *("LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand"),
    *("LeftUpLeg", "LeftLeg", "LeftFoot", "RightUpLeg", "RightLeg", "RightFoot"),
)
"""What HumanIK calls the joints of ``fbx_files.NAMES``."""


def characterised(rename: Any, links: dict[str, int] | None = None) -> Made:
    figure = person(np.random.default_rng(3), frames=4)
    for number, joint in enumerate(figure.joints[: len(ROLES)]):
        joint.name = rename(number, joint.name)
    figure.characters = [{link: joint for joint, link in enumerate(LINKS)} if links is None else links]
    return figure


@pytest.mark.parametrize("kind", [{}, {"ascii": True}, {"version": 7700}])
def test_a_characterisation_says_what_nodes_of_any_name_are(tmp_path: Path, kind: Any) -> None:
    path = characterised(lambda number, _: f"joint{number}").save(tmp_path / "one.fbx", **kind)
    findings = load(path).findings
    assert [role for _, role in findings.joints] == list(ROLES)
    assert "16 joints have the roles that the file states" in findings.notes


def test_names_say_what_is_left_out(tmp_path: Path) -> None:
    """A character of the hips alone, and links to what is no joint of the body."""
    figure = characterised(lambda _, name: name, {"Hips": 0, "Reference": 17, "LeftToeBase": 17})
    figure.joints.append(Joint("handle", -1, kind="Null"))
    findings = load(figure.save(tmp_path / "one.fbx")).findings
    assert [role for _, role in findings.joints] == list(ROLES)


def test_spines_and_necks_are_numbered_as_they_come() -> None:
    links = ("Hips", "Spine2", "Spine", "Neck1", "Neck", "Spine1", "Head", "LeftHandPinky3", "LeftArmRoll")
    stated = roles([{link: node for node, link in enumerate(links)}], range(len(links)))
    assert list(zip(links, map(stated.get, range(len(links))), strict=True)) == [
        ("Hips", "hips"),
        ("Spine2", "spine_3"),
        ("Spine", "spine_1"),
        ("Neck1", "neck_2"),
        ("Neck", "neck_1"),
        ("Spine1", "spine_2"),
        ("Head", "head"),
        ("LeftHandPinky3", "left_pinky_3"),
        ("LeftArmRoll", None),
    ]


def test_of_several_characters_that_of_the_body_counts() -> None:
    first, second = {"Hips": 0, "Neck": 1, "Head": 2}, {"Hips": 3, "Neck": 4}
    again = {"Hips": 1, "Head": 2}
    assert roles([first, second, again], range(3)) == {0: "hips", 1: "neck", 2: "head"}
    assert roles([first, second, again], [3, 4]) == {3: "hips", 4: "neck"}
    assert roles([first, second, again], range(5)) == {0: "hips", 1: "neck", 2: "head"}
    assert roles([], range(3)) == {}


def test_a_file_of_maya_states_its_roles(real_data: Path) -> None:
    """All links of its character, and the same as its names say."""
    files = list((real_data / "cases/03_maya_humanik_fbx").glob("*.fbx"))
    if not files:
        pytest.skip("no file of Maya")
    findings = load(files[0]).findings
    assert any("joints have the roles that the file states" in note for note in findings.notes)
    joints = dict(findings.joints)
    assert joints["Character1_LeftHandIndex4"] == "left_index_4"
    assert joints["Character1_Spine2"] == "spine_3"
    assert joints["Character1_RightToeBase"] == "right_toe"
