"""What of a structure PAN sees: edges and parts, on the structures of the papers and on odd ones."""

from __future__ import annotations

import pan_material
import pan_reference
import pytest

from retarget_bench.errors import BenchError
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.parts import SIX, THREE, layout_of, parts_of
from retarget_bench.training.layers.skeletal.tree import rerooted, where_legs_begin

LEG = ("up_leg", "leg", "foot", "toe")
ARM = ("shoulder", "arm", "forearm", "hand")


def limb(side: str, parts: tuple[str | None, ...]) -> list[str | None]:
    return [part and f"{side}_{part}" for part in parts]


# 23 and 28 joints, as the skeleton-aware retargeting papers use them
S23 = [0, *pan_reference.S23.parents[1:]]
S23_ROLES = [
    "hips",
    *limb("left", LEG),
    *limb("right", LEG),
    *(None, "spine_1", "spine_2", "spine_3", "neck", "head"),
    *limb("left", ARM),
    *limb("right", ARM),
]
S28 = [0, *pan_reference.S28.parents[1:]]
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
    return layout_of([-1, *parents[1:]], roles, parts, four_legged)


@pytest.mark.parametrize(
    ("parents", "roles", "expected"),
    [(S23, S23_ROLES, pan_reference.S23), (S28, S28_ROLES, pan_reference.S28)],
)
def test_parts_of_the_structures_of_the_papers(parents, roles, expected):
    structure = layout(parents, roles)
    assert structure.names == ("left_leg", "right_leg", "spine", "head", "left_arm", "right_arm")
    assert structure.parts == expected.parts
    assert structure.edges == len(parents) - 1
    assert structure.encoded.all()


def test_a_pelvis_without_a_role_is_of_both_legs():
    parents = [-1, 0, *(parent + 1 for parent in S23[1:])]  # legs hang from the pelvis
    parents[S23_ROLES.index("spine_1") + 1] = 0
    structure = layout(parents, ["hips", None, *S23_ROLES[1:]])
    pelvis = {name for name, edges in zip(structure.names, structure.parts, strict=True) if 0 in edges}
    assert pelvis == {"left_leg", "right_leg"}


def test_three_parts_of_two_legs_and_of_four():
    two = Pan(parts="three").body(pan_material.BODIES["one"])
    four = Pan(parts="three").body(pan_material.BODIES["rex"])
    assert two.layout.names == four.layout.names == ("legs", "spine", "head")

    def roles(body, part):
        return {body.layout.roles[edge + 1] for edge in body.layout.parts[part]}

    assert roles(two, 0) == {role for side in ("left", "right") for role in limb(side, LEG)}
    # the edge that leads to the chest is of what branches there, as in the papers' six parts
    assert roles(four, 0) == {
        *(role for side in ("left", "right") for role in (*limb(side, LEG[:3]), *limb(side, ARM))),
        "spine_2",
    }
    assert left_out(two) == {role for side in ("left", "right") for role in limb(side, ARM)}
    assert left_out(four) == {"tail_1", "tail_2"}


def left_out(body):
    """Roles of joints that no part has."""
    layout = body.layout
    return {role for role, encoded in zip(layout.roles, layout.encoded, strict=True) if not encoded}


@pytest.mark.parametrize("name", ["one", "rex"])
def test_layouts_of_joints(name):
    """Section 7 as released: every joint has its own rotation, and the hips are of every part."""
    edges = Pan(parts="three").body(pan_material.BODIES[name]).layout
    joints = Pan(parts="three", variant="released").body(pan_material.BODIES[name]).layout
    count = len(joints.parents)
    assert (edges.edges, joints.edges) == (count - 1, count)
    assert (edges.common, joints.common) == ((count - 1,), (0, count))
    assert joints.turned.tolist() == joints.leads.tolist() == list(range(count))
    assert edges.leads.tolist() == list(range(1, count))
    assert joints.encoded.tolist() == edges.encoded.tolist()
    of = {
        part: {joints.roles[joint] for joint in own}
        for part, own in zip(joints.names, joints.parts, strict=True)
    }
    spine = {role for role in joints.roles if role and role.startswith("spine")}
    assert (of["spine"], of["head"]) == (spine, {"neck", "head"}), "the chest is the spine's alone"


# ------------------------------------------------------------------------------------ trees turned round
AS_FILED = ("hips", None, *S23_ROLES[10:], *S23_ROLES[1:9])
"""Hips, a pelvis below them, the spine and what it carries, then the legs below the pelvis."""


def test_a_tree_begins_where_the_legs_do():
    parents = [-1, 0, 0, 2, 3, 4, 5, 4, 7, 8, 9, 4, 11, 12, 13, 1, 15, 16, 17, 1, 19, 20, 21]
    assert where_legs_begin(parents, AS_FILED) == 1
    tree, order = rerooted(parents, AS_FILED)
    assert tree == [-1, *S23[1:]]
    roles = [AS_FILED[joint] for joint in order]
    assert roles == [None, *S23_ROLES[1:9], "hips", *S23_ROLES[10:]]


def test_a_tree_without_a_pelvis_keeps_its_root_and_is_ordered_by_limbs():
    shuffled = [0, *range(11, 28), *range(6, 11), *range(1, 6)]
    place = {joint: rank for rank, joint in enumerate(shuffled)}
    parents = [-1, *(place[S28[joint]] for joint in shuffled[1:])]
    tree, order = rerooted(parents, [S28_ROLES[joint] for joint in shuffled])
    assert (tree, [shuffled[joint] for joint in order]) == ([-1, *S28[1:]], list(range(28)))


def test_a_body_without_legs_keeps_its_root():
    assert where_legs_begin([-1, 0, 1], ["hips", "spine_1", "head"]) == 0


def test_parts_of_a_file(tmp_path):
    path = tmp_path / "halves.toml"
    path.write_text('lower = ["left_leg", "right_leg"]\nupper = ["head", "left_arm", "right_arm"]\n')
    name, parts = parts_of(str(path))
    assert name == "lower:left_leg+right_leg upper:head+left_arm+right_arm"
    method = Pan(parts=str(path))
    assert method.facts()["parts"] == name
    assert method.body(pan_material.BODIES["one"]).layout.names == ("lower", "upper")
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
