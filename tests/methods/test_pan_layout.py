"""What of a structure PAN sees: edges and parts, on the structures of the papers and on odd ones."""

from __future__ import annotations

import pan_material
import pytest

from retarget_bench.errors import BenchError
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.layout import SIX, THREE, Layout, parts_of

LEG = ("up_leg", "leg", "foot", "toe")
ARM = ("shoulder", "arm", "forearm", "hand")


def limb(side: str, parts: tuple[str | None, ...]) -> list[str | None]:
    return [part and f"{side}_{part}" for part in parts]


# 23 and 28 joints, as the skeleton-aware retargeting papers use them
S23 = [0, 0, 1, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11, 12, 13, 12, 15, 16, 17, 12, 19, 20, 21]
S23_ROLES = [
    "hips",
    *limb("left", LEG),
    *limb("right", LEG),
    *(None, "spine_1", "spine_2", "spine_3", "neck", "head"),
    *limb("left", ARM),
    *limb("right", ARM),
]
S28 = [0, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 0, 11, 12, 13, 14, 15, 16, 14, 18, 19, 20, 21, 14, 23, 24, 25, 26]
SPLIT = ("shoulder", None, "arm", "forearm", "hand")
S28_ROLES = [
    "hips",
    *limb("left", (*LEG, "toe_end")),
    *limb("right", (*LEG, "toe_end")),
    *("spine_1", "spine_2", None, "spine_3", "neck", "head", "head_top"),
    *limb("left", SPLIT),
    *limb("right", SPLIT),
]


def layout(parents, roles, parts=SIX, four_legged=False):
    return Layout.of([-1, *parents[1:]], roles, parts, four_legged)


def test_parts_of_the_structure_of_28_joints():
    found = layout(S28, S28_ROLES)
    assert found.names == ("left_leg", "right_leg", "spine", "head", "left_arm", "right_arm")
    assert found.parts == (
        (0, 1, 2, 3, 4),
        (5, 6, 7, 8, 9),
        (10, 11, 12, 13),
        (13, 14, 15, 16),
        (13, 17, 18, 19, 20, 21),
        (13, 22, 23, 24, 25, 26),
    )
    assert found.edges == 27
    assert found.encoded.all()


def test_parts_of_the_structure_of_23_joints():
    found = layout(S23, S23_ROLES)
    assert found.parts == (
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        (8, 9, 10, 11),
        (11, 12, 13),
        (11, 14, 15, 16, 17),
        (11, 18, 19, 20, 21),
    )
    assert found.encoded.all()


def test_a_pelvis_without_a_role_is_of_both_legs():
    parents = [-1, 0, *(parent + 1 for parent in S23[1:])]  # legs hang from the pelvis
    parents[S23_ROLES.index("spine_1") + 1] = 0
    found = layout(parents, ["hips", None, *S23_ROLES[1:]])
    pelvis = {name for name, edges in zip(found.names, found.parts, strict=True) if 0 in edges}
    assert pelvis == {"left_leg", "right_leg"}


def test_slots_carry_the_joint_that_they_leave():
    found = layout(S23, S23_ROLES)
    assert found.turned.tolist() == S23[1:]
    # three edges leave the hips, three leave the chest, and each has the edge that leads there above it
    assert [edge for edge in range(22) if found.above[edge] == -1] == [0, 4, 8]
    assert [edge for edge in range(22) if found.above[edge] == 11] == [12, 14, 18]
    assert found.ends.tolist() == [3, 7, 13, 17, 21]


def test_a_body_with_one_arm_has_five_parts():
    found = Pan()._own(pan_material.BODIES["one_one_armed"]).layout
    assert found.names == ("left_leg", "right_leg", "spine", "head", "left_arm")
    assert found.encoded.all()


def test_three_parts_of_two_legs_and_of_four():
    two = Pan(parts="three")._own(pan_material.BODIES["one"])
    four = Pan(parts="three")._own(pan_material.BODIES["rex"])
    assert two.layout.names == four.layout.names == ("legs", "spine", "head")

    def roles(body, part):
        return {body.layout.roles[edge + 1] for edge in body.layout.parts[part]}

    assert roles(two, 0) == {role for side in ("left", "right") for role in limb(side, LEG)}
    # the edge that leads to the chest is of what branches there, as in the papers' six parts
    assert roles(four, 0) == {
        *(role for side in ("left", "right") for role in (*limb(side, LEG[:3]), *limb(side, ARM))),
        "spine_2",
    }
    left_out = {
        two.layout.roles[edge + 1] for edge in range(two.layout.edges) if not two.layout.encoded[edge]
    }
    assert left_out == {role for side in ("left", "right") for role in limb(side, ARM)}
    left_out = {
        four.layout.roles[edge + 1] for edge in range(four.layout.edges) if not four.layout.encoded[edge]
    }
    assert left_out == {"tail_1", "tail_2"}


def test_parts_of_a_file(tmp_path):
    path = tmp_path / "halves.toml"
    path.write_text('lower = ["left_leg", "right_leg"]\nupper = ["head", "left_arm", "right_arm"]\n')
    name, parts = parts_of(str(path))
    assert name == "lower:left_leg+right_leg upper:head+left_arm+right_arm"
    found = Pan(parts=str(path))
    assert found.facts()["parts"] == name
    assert found._own(pan_material.BODIES["one"]).layout.names == ("lower", "upper")
    # fore legs go with hind legs only where nobody says otherwise
    assert "left_arm" not in {
        role for edge in layout(S23, S23_ROLES, parts, True).parts[0] for role in [S23_ROLES[edge + 1]]
    }


def test_a_file_that_says_what_a_name_says_is_that_name(tmp_path):
    path = tmp_path / "parts.toml"
    path.write_text('legs = ["left_leg", "right_leg"]\nspine = ["trunk"]\nhead = ["head"]\n')
    assert parts_of(str(path)) == ("three", THREE)
    assert Pan(parts=str(path)).facts() == Pan(parts="three").facts()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("legs = [", "no file of body parts"),
        ('legs = "left_leg"', "legs has to be a list of some of trunk"),
        ('legs = ["left_wing"]', "legs has to be a list of some of trunk"),
        ("legs = [[1]]", "legs has to be a list of some of trunk"),
        ("legs = []", "legs has to be a list of some of trunk"),
        ("", "there is no part in it"),
        ("\udcff", "no file of body parts"),
    ],
)
def test_files_that_say_no_parts(tmp_path, text, problem):
    path = tmp_path / "parts.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(BenchError, match=f"parts.toml: {problem}"):
        parts_of(str(path))


def test_names_that_are_no_parts():
    with pytest.raises(BenchError, match=r"six, three, or a \.toml file, and not 'seven'"):
        Pan(parts="seven")
    with pytest.raises(BenchError, match=r"gone\.toml: no file of body parts"):
        Pan(parts="gone.toml")


def test_a_structure_without_any_part():
    with pytest.raises(BenchError, match="no joint of any of the body parts"):
        layout([0, 0, 1], ["hips", "tail_1", "tail_2"])
