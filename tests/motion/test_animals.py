"""Animals of all sizes: roles of rigs that name them in their own way, unit, facing, reference pose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from animal_rigs import bird, horse, skeleton, written

from retarget_bench.motion import species
from retarget_bench.motion.character import Character
from retarget_bench.motion.importer import UNITS, load
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.roles import ESSENTIAL, chain, explain, has_level_trunk, is_quadruped
from retarget_bench.motion.skeleton import Skeleton

PECKS = np.concatenate([np.full(20, 80.0), np.zeros(10), np.full(30, 95.0)])
"""Degrees by which a bird tips its trunk down: far beyond level in its first frame, and mostly."""


@pytest.mark.parametrize("facing", [-150.0, -91.0, 0.0, 88.0])
@pytest.mark.parametrize("slope", [-10.0, 0.0, 25.0, 40.0])
@pytest.mark.parametrize("wing", [("UpperArm", "Forearm", "Hand"), ("Wing1", "Wing2", "Wing3")])
def test_a_pecking_bird_faces_where_its_trunk_points(tmp_path, facing, slope, wing):
    """Its hips' front points down and back while it pecks: the facing is as for a bird that looks up."""
    findings = load(
        written(tmp_path / "b.bvh", bird(wing, slope), scale=100, facing=facing, pitch=PECKS)
    ).findings
    assert findings.facing == pytest.approx(facing, abs=1e-3)
    assert (findings.level, findings.quadruped, findings.up, findings.unit[0]) == (True, False, "y", "cm")
    assert findings.missing == ()
    assert findings.warnings == ()
    assert "two legs, the trunk level" in findings.text()


def test_a_bird_whose_wings_are_not_known(tmp_path):
    """Named after feathers, or not there: it is no four-legged body, and faces as others do."""
    feathers = bird(("Feather1", "Feather2", "Feather3"))
    bare = {name: bone for name, bone in feathers.items() if "Feather" not in name}
    for bones in (feathers, bare):
        file = written(tmp_path / "b.bvh", bones, scale=100, facing=88.0, pitch=PECKS)
        findings = load(file).findings
        assert findings.facing == pytest.approx(88.0, abs=1e-3)
        assert findings.level
        assert not findings.quadruped
        assert (findings.up, findings.unit[0]) == ("y", "cm")


def test_dogs_that_sit_face_where_their_trunk_points(real_data):
    """From the hips to the neck, level: another measurement of where a dog faces."""
    files = sorted((real_data / "dog").glob("*.bvh"))
    for file in files:
        read = load(file)
        joint, places = read.motion.character.joint_of, read.motion.at(slice(0, 1)).positions[0]
        trunk = places[joint["head"]] - places[joint["hips"]]
        apart = read.findings.facing - math.degrees(math.atan2(trunk[0], trunk[2]))
        assert abs((apart + 180) % 360 - 180) < 35, file.name
    assert files


@pytest.mark.parametrize("unit", ["m", "cm", "mm"])
@pytest.mark.parametrize(
    ("animal", "size"), [("", 1.0), ("", 0.05), ("", 3.3 / 1.6), ("Mouse", 0.05), ("elephant", 3.3 / 1.6)]
)
def test_units_of_animals(tmp_path, animal, size, unit):
    """A horse of 1.6 m, a mouse of 8 cm and an elephant of 3.3 m. By its size alone a mouse in millimetres
    could be a dog in centimetres: the doctor says both, and the name of the file decides."""
    file = written(tmp_path / f"{animal}Walk_01.bvh", horse(), scale=1 / UNITS[unit], size=size)
    findings = load(file).findings
    assert findings.animal == animal.lower()
    if (animal, size, unit) == ("", 0.05, "mm"):
        assert (findings.unit[0], findings.other_unit[0]) == ("cm", "mm")
        assert "in mm 0.081 m" in findings.text()
        return
    assert findings.unit[0] == unit
    assert findings.stands == pytest.approx(1.615 * size, rel=1e-3)
    assert f"stands {findings.stands:.2f} m" in findings.text() or findings.stands < 0.2
    assert findings.warnings == ()


def test_a_size_that_no_animal_has_is_doubted(tmp_path):
    """Neither 0.3 m nor 30 m is an elephant's; any animal may stand 0.3 m."""
    elephant = load(written(tmp_path / "elephant.bvh", horse(), scale=100.0, size=0.2)).findings
    assert any("unit is a guess" in warning for warning in elephant.warnings)
    assert load(written(tmp_path / "a.bvh", horse(), scale=100.0, size=0.2)).findings.warnings == ()


def test_species_are_found_as_whole_words(tmp_path):
    assert species.animal_of(tmp_path / "HorseRun_02.bvh") == "horse"
    assert species.animal_of(tmp_path / "Elephant" / "walk.bvh") == "elephant"
    assert species.animal_of(tmp_path / "Mousey_m" / "walk.bvh") == ""
    assert all(species.plausible(metres, animal) for animal, metres in species.STANDING.items())
    assert all(species.SMALLEST <= metres <= species.LARGEST for metres in species.STANDING.values())


@pytest.mark.parametrize("above", ["Bip01 Pelvis", "Bip01", "Bip01 Spine"])
@pytest.mark.parametrize(
    "tail", ["Bip01 Tail{}", "BN_Tail0{}", "Tail.00{}", "NPC Tail{}", "jnt_tail_{}", "TailBone{}"]
)
def test_tails_hang_from_a_pelvis_or_from_the_hips(tail, above):
    """Thighs are below a spine, which so is the hips; the tail hangs above it, or from it."""
    body = skeleton(horse(tail, above))
    roles = find(body)
    assert [body.names[joint] for joint in chain(roles, "tail")] == [
        name for name in body.names if "tail" in name.lower()
    ]
    assert body.names[roles.index("hips")] == "Bip01 Spine"
    assert not set(ESSENTIAL) - set(roles)
    assert "not understood" not in explain(body, roles)
    assert is_quadruped(body, roles)


def test_a_tail_is_one_line_of_joints():
    """Tails with a branch keep the longer one; what is called a tail elsewhere is none."""
    bones = horse()
    bones["Bip01 Tail Side"] = ("Bip01 Tail", (0.1, 0.9, -0.75))
    bones["Tail9"] = ("Bip01 Tail", (0.1, 0.9, -0.75))
    bones["Tail8"] = ("Bip01", (0.0, 2.0, 0.0))
    body = skeleton(bones)
    names = [body.names[joint] for joint in chain(find(body), "tail")]
    assert names == ["Bip01 Tail", "Bip01 Tail1", "Bip01 Tail2"]


def test_a_hock_of_its_own_is_where_the_foot_begins():
    body = skeleton(horse())
    roles = dict(zip(body.names, find(body), strict=True))
    leg = ("Thigh", "Calf", "HorseLink", "Foot", "Toe0")
    assert [roles[f"Bip01 L {part}"] for part in leg] == [
        f"left_{part}" for part in ("up_leg", "leg", "foot", "toe", "toe_end")
    ]
    without = skeleton(bird())
    assert dict(zip(without.names, find(without), strict=True))["Bip01 R Foot"] == "right_foot"


def test_the_reference_pose_of_a_bird_stands_as_it_rests_with_its_wings_spread():
    body = Character.of("hen", skeleton(bird(slope=40.0)))
    assert not body.four_legged
    rest, places, joint = body.skeleton.rest_positions, body.reference_places, body.joint_of
    legs = [
        joint[f"{side}_{part}"] for side in ("left", "right") for part in ("up_leg", "leg", "foot", "toe")
    ]
    trunk = [
        *chain(body.roles, "spine"),
        *chain(body.roles, "neck"),
        joint["head"],
        *chain(body.roles, "tail"),
    ]
    joints = [joint["hips"], *legs, *trunk]
    np.testing.assert_allclose(
        places[joints] - places[joint["hips"]], rest[joints] - rest[joint["hips"]], atol=1e-9
    )
    for side, x in (("left", 1.0), ("right", -1.0)):
        wing = places[joint[f"{side}_hand"]] - places[joint[f"{side}_arm"]]
        np.testing.assert_allclose(wing / np.linalg.norm(wing), [x, 0.0, 0.0], atol=1e-9)


def test_people_who_rest_seated_are_upright():
    """Legs ahead of the hips cross the trunk too; without a tail or fore legs that is no level trunk."""
    bones = {name: place for name, place in bird().items() if "Tail" not in name}
    for side, x in (("L", 0.1), ("R", -0.1)):
        bones[f"Bip01 {side} Thigh"] = ("Bip01 Pelvis", (x, 0.5, 0.0))
        bones[f"Bip01 {side} Calf"] = (f"Bip01 {side} Thigh", (x, 0.5, 0.45))
        bones[f"Bip01 {side} Foot"] = (f"Bip01 {side} Calf", (x, 0.05, 0.45))
        bones[f"Bip01 {side} UpperArm"] = ("Bip01 Spine1", (1.5 * x, 1.0, 0.0))
        bones[f"Bip01 {side} Forearm"] = (f"Bip01 {side} UpperArm", (4.5 * x, 1.0, 0.0))
        bones[f"Bip01 {side} Hand"] = (f"Bip01 {side} Forearm", (7.0 * x, 1.0, 0.0))
    for name, y in (
        ("", 0.5),
        (" Pelvis", 0.5),
        (" Spine", 0.6),
        (" Spine1", 0.8),
        (" Neck", 1.0),
        (" Head", 1.1),
    ):
        bones[f"Bip01{name}"] = (bones[f"Bip01{name}"][0], (0.0, y, 0.0))
    body: Skeleton = skeleton(bones)
    assert not has_level_trunk(body, find(body))
