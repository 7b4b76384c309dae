"""Roles: a table typed by hand for every family of skeletons, and small trees for other spellings."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.errors import FileError, SkeletonError
from retarget_bench.motion import bvh
from retarget_bench.motion.roles import (
    body_part,
    chain,
    explain,
    find,
    in_order,
    is_body,
    is_finger,
    is_quadruped,
    load_overrides,
    missing,
)
from retarget_bench.motion.skeleton import Skeleton

LIMBS = ["shoulder", "arm", "forearm", "hand"], ["up_leg", "leg", "foot", "toe"]
PARTS = [*LIMBS[0], *LIMBS[1]]


def sided(pattern: str, names: list[str], roles: list[str], left: str, right: str) -> dict[str, str]:
    """Both sides of ``pattern`` with S for the side and N for each name."""
    return {
        pattern.replace("S", word).replace("N", name): f"{side}_{role}"
        for side, word in (("left", left), ("right", right))
        for name, role in zip(names, roles, strict=True)
    }


def fingers(pattern: str, left: str, right: str, names: dict[str, str], count: int) -> dict[str, str]:
    return {
        pattern.replace("S", word).replace("F", name).replace("#", str(k)): f"{side}_{finger}_{k}"
        for side, word in (("left", left), ("right", right))
        for name, finger in names.items()
        for k in range(1, count + 1)
    }


def trunk(spine: list[str], neck: list[str], hips: str = "Hips", head: str = "Head") -> dict[str, str]:
    table = {hips: "hips", head: "head"} | {name: f"spine_{k}" for k, name in enumerate(spine, 1)}
    return table | {n: f"neck_{k}" if len(neck) > 1 else "neck" for k, n in enumerate(neck, 1)}


MIXAMO = ["Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase"]
MIXAMO_BODY = trunk(["Spine", "Spine1", "Spine2"], ["Neck"]) | sided("SN", MIXAMO, PARTS, "Left", "Right")
FIVE = {name.capitalize(): name for name in ("thumb", "index", "middle", "ring", "pinky")}
FOUR = {name: finger for name, finger in FIVE.items() if finger != "pinky"}
MIXAMO_ENDS = {"HeadTop_End": "head_top", "LeftToe_End": "left_toe_end", "RightToe_End": "right_toe_end"}
MIXAMO_A = MIXAMO_BODY | fingers("SHandF#", "Left", "Right", FIVE, 3)
MIXAMO_B5 = MIXAMO_BODY | MIXAMO_ENDS | fingers("SHandF#", "Left", "Right", FIVE, 4)
MIXAMO_B4 = MIXAMO_BODY | MIXAMO_ENDS | fingers("SHandF#", "Left", "Right", FOUR, 4)
CMU = trunk(["LowerBack", "Spine", "Spine1"], ["Neck", "Neck1"])
CMU |= sided("SN", MIXAMO, PARTS, "Left", "Right")
CMU_THUMBS = {"LThumb": "left_thumb_1", "RThumb": "right_thumb_1"}
CMU_131 = (
    trunk(["lowerback", "Chest", "Chest2"], ["lowerneck", "Neck"])
    | sided(
        "SN",
        ["Collar", "Shoulder", "Elbow", "Wrist", "Hip", "Knee", "Ankle", "Toe"],
        PARTS,
        "Left",
        "Right",
    )
    | CMU_THUMBS
)
LAFAN = trunk(["Spine", "Spine1", "Spine2"], ["Neck"]) | sided(
    "SN", [*MIXAMO[:-1], "Toe"], PARTS, "Left", "Right"
)
BANDAI = trunk(["Spine", "Chest"], ["Neck"]) | sided(
    "N_S",
    ["Shoulder", "UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Toes"],
    PARTS,
    "L",
    "R",
)
ICLONE = {
    f"CC_Base_{name}": role
    for name, role in (
        trunk(["Waist", "Spine01", "Spine02"], ["NeckTwist01", "NeckTwist02"], hips="Hip")
        | sided(
            "S_N",
            ["Clavicle", "Upperarm", "Forearm", "Hand", "Thigh", "Calf", "Foot", "ToeBase"],
            PARTS,
            "L",
            "R",
        )
        | fingers(
            "S_F#",
            "L",
            "R",
            {"Thumb": "thumb", "Index": "index", "Mid": "middle", "Ring": "ring", "Pinky": "pinky"},
            3,
        )
    ).items()
}
DOG = (
    trunk(["Spine", "Spine1"], ["Neck"])
    | sided("SN", MIXAMO[:-1], PARTS[:-1], "Left", "Right")
    | {"Tail": "tail_1", "Tail1": "tail_2"}
)
MAKEHUMAN_OLD = (
    trunk(["Spine1", "Spine2", "Spine3"], ["Neck"], hips="Root")
    | sided("N_S", ["Clavicle", "UpArm", "LoArm", "Hand", "UpLeg", "LoLeg", "Foot", "Toe"], PARTS, "L", "R")
    | fingers("F#_S", "L", "R", FIVE, 3)
)
MAKEHUMAN = (
    trunk([f"spine0{k}" for k in (5, 4, 3, 2, 1)], ["neck01", "neck02", "neck03"], "root", "head")
    | sided(
        "N.S",
        ["clavicle", "upperarm01", "lowerarm01", "wrist", "upperleg01", "lowerleg01", "foot", "toe1-1"],
        PARTS,
        "L",
        "R",
    )
    | fingers("finger#-F.S", "L", "R", {}, 0)
    | {
        f"finger{number}-{k}.{word}": f"{side}_{finger}_{k}"
        for number, finger in enumerate(("thumb", "index", "middle", "ring", "pinky"), 1)
        for side, word in (("left", "L"), ("right", "R"))
        for k in (1, 2, 3)
    }
)
SAME_FOUR = trunk(["LowerBack", "Spine", "Spine1", "Spine2"], ["Neck"])
SAME_TWO = trunk(["Spine", "Spine1"], ["Neck"]) | sided("SN", MIXAMO, PARTS, "Left", "Right")

TABLES = {
    "mixamo_san/std_bvhs/Aj.bvh": MIXAMO_A,
    "mixamo_san/std_bvhs/Kaya.bvh": MIXAMO_A,
    "mixamo_san/std_bvhs/BigVegas.bvh": {f"newVegas:{name}": role for name, role in MIXAMO_A.items()},
    "mixamo_san/std_bvhs/Goblin_m.bvh": MIXAMO_B5,
    "mixamo_san/std_bvhs/Mousey_m.bvh": MIXAMO_B4,
    "mixamo_r2et/Ortiz/Angry.bvh": {f"mixamorig:{name}": role for name, role in MIXAMO_B5.items()},
    "mixamo_r2et/Mousey/Angry.bvh": {f"mixamorig:{name}": role for name, role in MIXAMO_B4.items()},
    "cmu_bvh/01_01.bvh": CMU | CMU_THUMBS,
    "cmu_bvh/131_01.bvh": CMU_131,
    "cmu_bvh/pfnn_hierarchy.bvh": CMU
    | CMU_THUMBS
    | {"LeftHandIndex1": "left_index_1", "RightHandIndex1": "right_index_1"},
    "cmu_iclone/002_01.bvh": ICLONE,
    "cmu_iclone/002_04.bvh": ICLONE,
    "lafan1/Lafan1_example.bvh": LAFAN,
    "bandai_namco/dataset-1_walk_old_001.bvh": BANDAI,
    "dog/Dog_example.bvh": DOG,
    "same_pairs/lafan1/aiming1_subject1_0.bvh": LAFAN,
    "same_pairs/pfnn/LocomotionFlat01_000_3.bvh": CMU,
    "same_pairs/SFU/0005_JumpRope001_0.bvh": SAME_TWO,
    "same_pairs/ACAAD/Female1_A05_PickUpBox_0.bvh": SAME_TWO,
    "same_pairs/result/0.bvh": SAME_TWO,
    "same_pairs/result/3.bvh": SAME_FOUR | sided("SN", MIXAMO, PARTS, "Left", "Right"),
    "same_pairs/result/6.bvh": MIXAMO_BODY,
    "makehuman/makehuman/data/animations/walks/walk1.bvh": MAKEHUMAN_OLD,
    "makehuman/makehuman/data/poses/benchmark.bvh": MAKEHUMAN,
    "makehuman/makehuman/data/poses/tpose.bvh": MAKEHUMAN,
}
"""File -> every joint that has a role; all other joints have none."""


@pytest.mark.parametrize("file", TABLES)
def test_every_family_has_exactly_the_roles_of_the_table(real_data, file):
    skeleton = bvh.read(real_data / file).skeleton
    roles = find(skeleton)
    found = {name: role for name, role in zip(skeleton.names, roles, strict=True) if role is not None}
    assert found == TABLES[file]
    assert len(set(found.values())) == len(found)
    assert in_order(skeleton, roles)
    assert is_quadruped(skeleton, roles) == file.startswith("dog")
    assert missing(roles) == []
    assert "not understood" not in explain(skeleton, roles)


def tree(text: str) -> Skeleton:
    """A skeleton from lines ``name`` indented by two blanks per level; offsets are arbitrary."""
    names: list[str] = []
    parents: list[int] = []
    above: list[int] = []
    for line in text.strip("\n").splitlines():
        depth = (len(line) - len(line.lstrip())) // 2
        del above[depth:]
        parents.append(above[-1] if above else -1)
        above.append(len(names))
        names.append(line.strip())
    return Skeleton(tuple(names), np.array(parents), np.tile([0.0, 0.1, 0.0], (len(names), 1)))


def roles_of(text: str, overrides: dict[str, str | None] | None = None) -> dict[str, str]:
    skeleton = tree(text)
    found = zip(skeleton.names, find(skeleton, overrides), strict=True)
    return {name: role for name, role in found if role is not None}


BIPED = """
Bip01
  Bip01 Pelvis
    Bip01 Spine
      Bip01 Spine1
        Bip01 Neck
          Bip01 Head
          Bip01 L Clavicle
            Bip01 L UpperArm
              Bip01 L Forearm
                Bip01 L Hand
                  Bip01 L ForeTwist
    Bip01 L Thigh
      Bip01 L Calf
        Bip01 L Foot
          Bip01 L Toe0
    Bip01 R Thigh
      Bip01 R Calf
        Bip01 R Foot
"""


def test_3ds_max_biped():
    assert roles_of(BIPED) == {
        "Bip01 Pelvis": "hips",
        "Bip01 Spine": "spine_1",
        "Bip01 Spine1": "spine_2",
        "Bip01 Neck": "neck",
        "Bip01 Head": "head",
        "Bip01 L Clavicle": "left_shoulder",
        "Bip01 L UpperArm": "left_arm",
        "Bip01 L Forearm": "left_forearm",
        "Bip01 L Hand": "left_hand",
        "Bip01 L Thigh": "left_up_leg",
        "Bip01 L Calf": "left_leg",
        "Bip01 L Foot": "left_foot",
        "Bip01 L Toe0": "left_toe",
        "Bip01 R Thigh": "right_up_leg",
        "Bip01 R Calf": "right_leg",
        "Bip01 R Foot": "right_foot",
    }


def test_smpl_calls_the_toe_joint_foot():
    found = roles_of("""
pelvis
  left_hip
    left_knee
      left_ankle
        left_foot
  right_hip
    right_knee
      right_ankle
        right_foot
  spine1
    spine2
      spine3
        neck
          head
        left_collar
          left_shoulder
            left_elbow
              left_wrist
""")
    assert found["pelvis"] == "hips"
    assert found["left_hip"] == "left_up_leg"
    assert found["left_ankle"] == "left_foot"
    assert found["left_foot"] == "left_toe"
    assert found["left_collar"] == "left_shoulder"
    assert found["left_shoulder"] == "left_arm"
    assert found["left_wrist"] == "left_hand"


def test_asf_names_with_the_side_run_into_them():
    found = roles_of("""
root
  lhipjoint
    lfemur
      ltibia
        lfoot
          ltoes
  rhipjoint
    rfemur
      rtibia
        rfoot
  lowerback
    upperback
      thorax
        lowerneck
          upperneck
            head
        lclavicle
          lhumerus
            lradius
              lwrist
                lhand
                  lfingers
                lthumb
""")
    assert [found[n] for n in ("lowerback", "upperback", "thorax")] == ["spine_1", "spine_2", "spine_3"]
    assert [found[name] for name in ("lowerneck", "upperneck")] == ["neck_1", "neck_2"]
    assert found["root"] == "hips"
    assert found["lfemur"] == "left_up_leg"
    assert found["ltoes"] == "left_toe"
    assert found["lhumerus"] == "left_arm"
    assert found["lwrist"] == "left_hand"
    assert "lhand" not in found
    assert "lhipjoint" not in found


def test_the_tree_checks_the_names():
    """An arm that hangs below a leg, and a costume's collar, are not believed."""
    found = roles_of("""
Hips
  LeftUpLeg
    LeftLeg
      LeftFoot
        LeftHand
  RightUpLeg
    RightLeg
      RightFoot
  Spine
    Left_Collar
    LeftShoulder
      LeftArm
        LeftForeArm
    Head
""")
    assert found["LeftShoulder"] == "left_shoulder"
    assert found["LeftArm"] == "left_arm"
    assert "LeftHand" not in found
    assert "Left_Collar" not in found


def test_hips_are_what_carries_legs_and_spine_whatever_it_is_called():
    found = roles_of("""
Armature
  Centre
    Hips
      LeftUpLeg
        LeftLeg
      RightUpLeg
        RightLeg
    Spine
      Head
""")
    assert found["Centre"] == "hips"
    assert "Hips" not in found


def test_overrides_win_and_move_the_rest():
    text = """
Hips
  Bone_1
    Bone_2
      Head
  LeftUpLeg
    LeftLeg
  RightUpLeg
    RightLeg
"""
    assert roles_of(text) == {
        "Hips": "hips",
        "Head": "head",
        "LeftUpLeg": "left_up_leg",
        "LeftLeg": "left_leg",
        "RightUpLeg": "right_up_leg",
        "RightLeg": "right_leg",
    }
    told = roles_of(text, {"Bone_1": "spine_1", "Bone_2": "neck", "LeftLeg": None, "LeftUpLeg": "left_leg"})
    assert told == {
        "Hips": "hips",
        "Bone_1": "spine_1",
        "Bone_2": "neck",
        "Head": "head",
        "LeftUpLeg": "left_leg",
        "RightUpLeg": "right_up_leg",
        "RightLeg": "right_leg",
    }


def test_overrides_that_do_not_fit_are_explained():
    skeleton = tree(BIPED)
    with pytest.raises(SkeletonError, match=r"no joint .Bip01 Hed.*Bip01 Head"):
        find(skeleton, {"Bip01 Hed": "head"})
    with pytest.raises(SkeletonError, match=r"'heead' is no role.*head"):
        find(skeleton, {"Bip01 Head": "heead"})
    with pytest.raises(SkeletonError, match="given to two joints"):
        find(skeleton, {"Bip01 Head": "head", "Bip01 Neck": "head"})


def test_role_files(tmp_path):
    file = tmp_path / "roles.toml"
    file.write_text('"Bone 1" = "left_arm"\nHat = "none"\nBeard = ""\n', encoding="utf-8")
    assert load_overrides(file) == {"Bone 1": "left_arm", "Hat": None, "Beard": None}
    for text, problem in (
        ("Bone 1 = left_arm", "TOML"),
        ("Bone = 3", "in quotes"),
        ('Bone = "left_ram"', "no role; near it: left_arm"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(FileError, match=problem):
            load_overrides(file)
    with pytest.raises(FileError, match="cannot be read"):
        load_overrides(tmp_path / "none.toml")


def test_explanations_of_joints_without_a_role():
    skeleton = tree("""
Reference
  Hips
    Pelvis
      LeftUpLeg
        LeftLeg
      RightUpLeg
    Spine
      Spine_split
        Head
          HairA
            Curl
    Gizmo
    LeftLegTwist
""")
    found = dict(zip(skeleton.names, explain(skeleton, find(skeleton)), strict=True))
    assert found["Reference"] == "above the hips"
    assert found["Pelvis"] == found["Spine_split"] == found["LeftLegTwist"] == "helper"
    assert found["HairA"] == found["Curl"] == "extra"
    assert found["Gizmo"] == "not understood"
    assert found["LeftLeg"] == "left_leg"


def test_groups_of_roles():
    assert is_body("left_toe_end")
    assert is_body("tail_1")
    assert not is_body("left_thumb_1")
    assert not is_body(None)
    assert is_finger("right_pinky_4")
    assert not is_finger("right_hand")
    assert [body_part(r) for r in ("hips", "spine_3", "neck_1", "head_top", "tail_2", "left_index_1")] == [
        "trunk",
        "trunk",
        "head",
        "head",
        "tail",
        "left_arm",
    ]
    assert chain(("hips", "neck_2", "neck_1", None), "neck") == [2, 1]
    assert chain(("neck",), "neck") == [0]


def test_a_body_that_stands_on_four_legs():
    """Trunk across the legs in the rest pose: four legs, with or without a tail."""
    skeleton = tree("""
Hips
  LeftUpLeg
    LeftLeg
      LeftFoot
  RightUpLeg
    RightLeg
      RightFoot
  Spine
    LeftArm
      LeftForeArm
        LeftHand
    RightArm
      RightForeArm
        RightHand
    Head
""")
    down, forward = [0.0, -0.3, 0.0], [0.0, 0.0, 0.6]
    offsets = np.tile(down, (len(skeleton), 1))
    offsets[skeleton.index("Spine")] = forward
    for name, x in (("LeftUpLeg", 0.1), ("RightUpLeg", -0.1), ("LeftArm", 0.1), ("RightArm", -0.1)):
        offsets[skeleton.index(name)] = [x, 0.0, 0.0]
    standing = Skeleton(skeleton.names, skeleton.parents, offsets)
    assert is_quadruped(standing, find(standing))
    offsets[skeleton.index("Spine")] = [0.0, 0.6, 0.0]
    upright = Skeleton(skeleton.names, skeleton.parents, offsets)
    assert not is_quadruped(upright, find(upright))
