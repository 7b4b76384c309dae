"""Cases of joints whose names were not understood, or whose chains were not complete."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from editing_bodies import body

import retarget_bench as rb
from retarget_bench.motion.findings import NO_ROLE
from retarget_bench.motion.importer import load
from retarget_bench.viewer.bodies import radii


@pytest.fixture
def cases(real_data: Path) -> Path:
    if not (real_data / "cases").is_dir():
        pytest.skip("no cases")
    return real_data / "cases"


def roles_of(path: Path) -> dict[str, str]:
    joints = load(path).findings.joints
    return {name: meaning for name, meaning in joints if meaning not in NO_ROLE}


@pytest.mark.parametrize("sensor", ["azure_kinect", "xsens_mvn"])
def test_a_bow_under_other_names_is_the_same_to_the_digit(cases: Path, sensor: str) -> None:
    folder = cases / "01_spine_words_silent"
    usual, other = (rb.retarget(folder / f"bow{name}.bvh", body()) for name in ("", f"_{sensor}"))
    assert np.array_equal(usual.rotations, other.rotations)
    assert np.array_equal(usual.root, other.root)


@pytest.mark.parametrize("rig", ["arkit", "autorig", "maya_hik", "optitrack_prefix", "valve", "vroid"])
def test_prefixes_and_suffixes_on_all_names(cases: Path, rig: str) -> None:
    usual = roles_of(cases / "01_spine_words_silent" / "bow.bvh")
    roles = roles_of(cases / "02_prefix_on_every_joint" / f"{rig}.bvh")
    assert list(roles.values()) == list(usual.values())
    assert len(roles) == 21


@pytest.mark.parametrize("names", ["mmd_ja", "cyrillic"])
def test_other_scripts(cases: Path, names: str) -> None:
    usual = roles_of(cases / "01_spine_words_silent" / "bow.bvh")
    assert list(roles_of(cases / "23_mmd_and_other_scripts" / f"{names}.bvh").values()) == list(
        usual.values()
    )


@pytest.mark.usefixtures("forked")
def test_a_file_of_maya(cases: Path) -> None:
    findings = load(next((cases / "03_maya_humanik_fbx").glob("*.fbx"))).findings
    assert findings.not_understood == findings.missing == ()
    assert findings.rest_pose == "T-pose"


def test_the_example_of_the_bvh_description(cases: Path) -> None:
    path = cases / "10_bvh_spec_example_names" / "bvhio_tests_example.bvh"
    roles = roles_of(path)
    assert len(roles) == len(load(path).findings.joints) == 18
    assert roles["LeftLowArm"] == "left_forearm"
    assert roles["RightLowLeg"] == "right_leg"


def test_rigify(cases: Path) -> None:
    findings = load(cases / "11_rigify_head" / "rig_rigify.bvh").findings
    roles = dict(findings.joints)
    assert [roles[f"DEF-spine{end}"] for end in ("", ".001", ".003", ".004", ".005", ".006")] == [
        "hips",
        "spine_1",
        "spine_3",
        "neck_1",
        "neck_2",
        "head",
    ]
    assert roles["DEF-f_index.02.L"] == "left_index_2"
    assert roles["DEF-thumb.01.R"] == "right_thumb_1"
    assert findings.height == pytest.approx(1.68, abs=0.05)
    assert not findings.not_understood


def test_daz(cases: Path) -> None:
    findings = load(cases / "12_daz_genesis_8" / "rig_daz.bvh").findings
    roles = dict(findings.joints)
    assert roles["lShldrBend"] == "left_arm"
    assert roles["lShldrTwist"] == roles["lThighTwist"] == "helper"
    assert [roles[name] for name in ("abdomenLower", "chestUpper", "neckLower", "neckUpper")] == [
        "spine_1",
        "spine_4",
        "neck_1",
        "neck_2",
    ]
    assert not findings.missing
    assert not findings.not_understood


@pytest.mark.parametrize("file", ["09_vrm1_oddnames.vrm", "09b_vrm0_oddnames.vrm"])
def test_vrm_files_state_what_is_what(cases: Path, file: str) -> None:
    usual = roles_of(cases / "01_spine_words_silent" / "bow.bvh")
    roles = roles_of(cases / "06_vrm_humanoid_ignored" / file)
    assert sorted(roles.values()) == sorted(usual.values())


def test_handles_of_a_rig_are_not_drawn(cases: Path) -> None:
    """Nor is the way from the root on the floor to the hips."""
    character = load(cases / "13_ue5_helpers_drawn" / "rig_ue5.bvh").motion.character
    drawn = {
        name
        for name, radius in zip(character.skeleton.names, radii(character), strict=True)
        if radius.any()
    }
    assert not drawn & {
        "pelvis",
        "ik_hand_gun",
        "ik_foot_root",
        "ik_hand_l",
        "center_of_mass",
        "interaction",
    }
    assert {"spine_01", "head", "thigh_l", "hand_r", "index_02_l", "upperarm_twist_02_l"} <= drawn


@pytest.mark.usefixtures("forked")
def test_a_sheep_stands_on_four_legs(cases: Path) -> None:
    findings = load(next((cases / "21_quadruped_front_back").glob("*.fbx"))).findings
    roles = dict(findings.joints)
    assert findings.quadruped
    assert findings.missing == ()
    assert findings.height > 0
    assert roles["FrontUpLeg.R"] == "right_arm"
    assert roles["BackLowLeg.L"] == "left_leg"
