"""Roles: a table typed by hand for every family of skeletons."""

from __future__ import annotations

import pytest

from retarget_bench.motion import bvh
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.roles import ESSENTIAL, explain, in_order, is_quadruped

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
    "lafan1/Lafan1_example.bvh": LAFAN,
    "bandai_namco/dataset-1_walk_old_001.bvh": BANDAI,
    "dog/Dog_example.bvh": DOG,
    "same_pairs/pfnn/LocomotionFlat01_000_3.bvh": CMU,
    "same_pairs/result/0.bvh": SAME_TWO,
    "same_pairs/result/3.bvh": SAME_FOUR | sided("SN", MIXAMO, PARTS, "Left", "Right"),
    "same_pairs/result/6.bvh": MIXAMO_BODY,
    "makehuman/makehuman/data/animations/walks/walk1.bvh": MAKEHUMAN_OLD,
    "makehuman/makehuman/data/poses/benchmark.bvh": MAKEHUMAN,
}
"""File -> every joint that has a role; all other joints have none."""


@pytest.mark.parametrize("file", TABLES)
def test_every_family_has_exactly_the_roles_of_the_table(real_data, file):
    skeleton = bvh.read(real_data / file).skeleton
    roles = find(skeleton)
    by_name = {name: role for name, role in zip(skeleton.names, roles, strict=True) if role is not None}
    assert by_name == TABLES[file]
    assert len(set(by_name.values())) == len(by_name)
    assert in_order(skeleton, roles)
    assert is_quadruped(skeleton, roles) == file.startswith("dog")
    assert set(ESSENTIAL) <= set(roles)
    assert "not understood" not in explain(skeleton, roles)
