"""Roles of small trees: what the tree says, overrides, explanations."""

from __future__ import annotations

import numpy as np
import pytest

from retarget_bench.errors import FileError, SkeletonError
from retarget_bench.motion.files.reading import Reading
from retarget_bench.motion.role_finding import find
from retarget_bench.motion.roles import explain
from retarget_bench.motion.skeleton import Skeleton


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
    assigned = zip(skeleton.names, find(skeleton, overrides), strict=True)
    return {name: role for name, role in assigned if role is not None}


def test_the_tree_checks_the_names():
    """An arm that hangs below a leg, and a costume's collar, are not believed."""
    roles = roles_of("""
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
    assert roles["LeftShoulder"] == "left_shoulder"
    assert roles["LeftArm"] == "left_arm"
    assert "LeftHand" not in roles
    assert "Left_Collar" not in roles


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
    overridden = roles_of(
        text, {"Bone_1": "spine_1", "Bone_2": "neck", "LeftLeg": None, "LeftUpLeg": "left_leg"}
    )
    assert overridden == {
        "Hips": "hips",
        "Bone_1": "spine_1",
        "Bone_2": "neck",
        "Head": "head",
        "LeftUpLeg": "left_leg",
        "RightUpLeg": "right_up_leg",
        "RightLeg": "right_leg",
    }


def test_overrides_that_do_not_fit_are_explained():
    skeleton = tree("Hips\n  Neck\n    Head")
    with pytest.raises(SkeletonError, match=r"no joint .Hed.*Head"):
        find(skeleton, {"Hed": "head"})
    with pytest.raises(SkeletonError, match=r"'heead' is no role.*head"):
        find(skeleton, {"Head": "heead"})
    with pytest.raises(SkeletonError, match="given to two joints"):
        find(skeleton, {"Head": "head", "Neck": "head"})


def test_role_files(tmp_path):
    file = tmp_path / "roles.toml"
    file.write_text('"Bone 1" = "left_arm"\nHat = "none"\nBeard = ""\n', encoding="utf-8")
    assert Reading(roles=file).overrides == {"Bone 1": "left_arm", "Hat": None, "Beard": None}
    for text, problem in (
        ("Bone 1 = left_arm", "TOML"),
        ("Bone = 3", "in quotes"),
        ('Bone = "left_ram"', "no role; near it: left_arm"),
    ):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(FileError, match=problem):
            Reading(roles=file)
    with pytest.raises(FileError, match="cannot be read"):
        Reading(roles=tmp_path / "none.toml")


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
    reasons = dict(zip(skeleton.names, explain(skeleton, find(skeleton)), strict=True))
    assert reasons["Reference"] == "above the hips"
    assert reasons["Pelvis"] == reasons["Spine_split"] == reasons["LeftLegTwist"] == "helper"
    assert reasons["HairA"] == reasons["Curl"] == "extra"
    assert reasons["Gizmo"] == "not understood"
    assert reasons["LeftLeg"] == "left_leg"
