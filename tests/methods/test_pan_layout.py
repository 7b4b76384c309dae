"""What PAN sees of structures, and motions as its numbers and back."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import method_bodies
import numpy as np
import pan_material
import pan_reference
import pytest
from method_bodies import dance
from scipy.spatial.transform import Rotation

from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.assignment import assign, in_layout
from retarget_bench.methods.pan.parts import SIX, THREE, layout_of, parts_of
from retarget_bench.motion import rotation
from retarget_bench.training.layers.skeletal.features import Features
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


# ----------------------------------------------------------------------------------------- motions and back
BODIES = pan_material.BODIES
FORMS = [
    Features(*each) for each in product(("velocity", "position", "height"), ("world", "body"), (0.0, 3.0))
]


def there_and_back(features, motion, body, yaw, tips=True):
    encoded = features.see(motion, body)
    ends = body.ends_of(motion) if tips else None
    ratios = features.ratios(motion.character, body.character)
    return features.motion(body, encoded["edges"], encoded, ratios, yaw, ends)


def apart(one, other, joints=slice(None)) -> float:
    return float(np.abs(one.positions[:, joints] - other.positions[:, joints]).max()) / one.character.height


@pytest.mark.parametrize("yaw", ["source", "predicted"])
@pytest.mark.parametrize("features", FORMS, ids=str)
def test_seen_and_shown_again(features, yaw):
    for name in ("one", "legs", "one_one_armed", "rex"):
        body = Pan(parts="three").body(BODIES[name])
        motion = dance(pan_material.BODIES[name], 25)
        assert apart(motion, there_and_back(features, motion, body, yaw)) < 1e-9


def test_numbers_of_the_root_by_hand():
    """Velocities and turns are those of the walk, seen from where the body faces."""
    body = BODIES["one"]
    angles = np.radians(np.linspace(0.0, 90.0, 10))
    ahead = 0.02 * np.stack([np.sin(angles), np.zeros(10), np.cos(angles)], axis=1)
    height = body.measures.hip_height
    root = np.cumsum(ahead, axis=0) - ahead[0] + [0.0, height, 0.0]
    motion = method_bodies.pose(body, 10, {"Hips": method_bodies.about("Y", np.degrees(angles))}, root)
    edges = {
        kind: Features(kind, "world", 0.0).see(motion, Pan().body(body))["edges"][:, -1]
        for kind in ("velocity", "height", "position")
    }
    turns = np.full(10, angles[1])
    np.testing.assert_allclose(
        edges["velocity"], np.stack([0 * turns, 0 * turns, 0 * turns + 2, turns], 1), atol=1e-9
    )
    np.testing.assert_allclose(edges["height"][:, 1], 100 * height, atol=1e-9)
    np.testing.assert_allclose(edges["height"][:, [0, 2, 3]], edges["velocity"][:, [0, 2, 3]], atol=1e-12)
    np.testing.assert_allclose(edges["position"], np.c_[100 * root, 0 * turns], atol=1e-9)
    own = Features("velocity", "body", 0.0).see(motion, Pan().body(body))["edges"][:, -1]
    np.testing.assert_allclose(own[:, 2], 0.02 / (height / 90.0), atol=1e-9)


def test_slots_of_one_joint_that_disagree_give_their_mean():
    """Turned by 10 and by 30 degrees about one axis, the hips are turned by 20; what hangs from each edge
    keeps the orientation that its own edges say."""
    body = Pan().body(BODIES["one"])
    edges = np.zeros((1, body.layout.edges, 4))
    edges[..., 0] = 1.0
    leaving = [edge for edge in range(body.layout.edges) if body.layout.parents[edge + 1] == 0]
    assert len(leaving) == 3
    for edge, angle in zip(leaving, (10.0, 20.0, 30.0), strict=True):
        edges[:, edge] = method_bodies.about("X", np.array([angle]))
    answer = body.motion(edges, None, np.zeros((1, 3)), 30.0)
    turned = answer.global_rotations[0]
    for edge, angle in zip(leaving, (10.0, 20.0, 30.0), strict=True):
        child = body.joints[edge + 1]
        expected = Rotation.from_euler("X", angle, degrees=True)
        assert (_turn(turned[child]) * expected.inv()).magnitude() < 1e-6
    hips = _turn(turned[body.joints[0]])
    assert (hips * Rotation.from_euler("X", 20.0, degrees=True).inv()).magnitude() < 1e-3


# ------------------------------------------------------------------------- other slots and other roots
@pytest.mark.parametrize("name", ["one", "rex"])
@pytest.mark.parametrize("features", FORMS, ids=str)
def test_joints_are_seen_and_shown_again(features, name):
    """Ends of chains too, which say their own rotations."""
    body = Pan(parts="three", variant="released").body(BODIES[name])
    motion = dance(pan_material.BODIES[name], 12)
    returned = there_and_back(features, motion, body, "predicted", tips=False)
    assert apart(motion, returned) < 1e-9
    assert rotation.angle(returned.global_rotations, motion.global_rotations).max() < 1e-6


def turning_pelvis():
    """A body with a pelvis that dances, and turns it against its hips."""
    body = pan_material.with_pelvis(BODIES["one"])
    motion = method_bodies.dance(body, 15)
    turned = np.array(motion.rotations)
    turned[:, 1] = method_bodies.about("X", np.linspace(-20.0, 30.0, 15))
    return body.motion(turned, motion.root, 30.0)


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_a_body_is_seen_from_its_pelvis_and_shown_again(features):
    motion = turning_pelvis()
    body = Pan(variant="released").body(motion.character)
    assert [motion.character.skeleton.names[joint] for joint in body.joints[:2]] == ["Pelvis", "LeftUpLeg"]
    assert apart(motion, there_and_back(features, motion, body, "source")) < 1e-9
    assert body.root(motion)[3] == pytest.approx(motion.positions[3, 1])


@pytest.mark.parametrize("features", FORMS, ids=str)
def test_bodies_with_a_pelvis_and_without_go_through_one_another_s_structures(features):
    plain, pelvis = BODIES["one"], turning_pelvis()
    layouts = [Pan(variant="released").body(each).layout for each in (plain, pelvis.character)]
    through = in_layout(plain, layouts[1])
    assert through.joints[0] == plain.joint_of["hips"]
    assert through.layout.roles[0] is None
    motion = dance(pan_material.BODIES["one"], 12)
    assert apart(motion, there_and_back(features, motion, through, "source")) < 1e-9
    away = in_layout(pelvis.character, layouts[0])
    returned = there_and_back(features, pelvis, away, "source")
    present = [joint for joint in away.joints if joint >= 0]
    assert 1 not in present
    turns = rotation.angle(returned.global_rotations[:, present], pelvis.global_rotations[:, present])
    assert turns.max() < 1e-6, "the pelvis follows the hips, and what hangs from it is turned as it was"


# ------------------------------------------------------------------------------- another structure


def test_a_body_without_any_known_part_is_named():
    layout = Pan().body(BODIES["one"]).layout
    torso = pan_material.without(
        BODIES["one"],
        *(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "Toe")),
        structure="torso",
    )
    legs = replace(layout, names=("left_leg",), parts=layout.parts[:1])
    assert assign(torso, {"one": SimpleNamespace(layout=layout)}).structure == "one"
    with pytest.raises(NotSupported, match=r"no joint of any part that these weights know \(left leg\)"):
        assign(torso, {"one": SimpleNamespace(layout=legs)})


def _turn(quaternion) -> Rotation:
    return Rotation.from_quat(quaternion[[1, 2, 3, 0]])


def test_end_sites_are_where_the_file_has_them():
    body = Pan(parts="three", variant="released").body(BODIES["one"])
    names = BODIES["one"].skeleton.names
    assert {names[body.joints[rank]] for rank in body.end_sites} == {"LeftToeBase", "RightToeBase"}
    for place in body.end_sites.values():
        np.testing.assert_allclose(place, [0.0, 0.0, 0.05], atol=1e-9)


def test_signs_of_slots_do_not_matter_to_their_mean():
    body = Pan().body(BODIES["one"])
    motion = dance(pan_material.BODIES["one"], 6)
    edges = FORMS[0].see(motion, body)["edges"][:, :-1]
    flipped = edges.copy()
    flipped[:, ::2] *= -1.0
    one, other = (body.motion(each, None, np.zeros((6, 3)), 30.0) for each in (edges, flipped))
    assert apart(one, other) < 1e-9
