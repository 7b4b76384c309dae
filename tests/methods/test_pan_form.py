"""Motions as PAN's numbers and back: exact on bodies of every structure, at every choice of features."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import method_bodies
import numpy as np
import pan_material
import pytest
from method_bodies import dance
from scipy.spatial.transform import Rotation

from retarget_bench.errors import NotSupported
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.assignment import assign, in_layout
from retarget_bench.motion import rotation
from retarget_bench.training.layers.skeletal.body import aligned
from retarget_bench.training.layers.skeletal.features import Features

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
def _few():
    return pan_material.without(method_bodies.body("few", spines=2), "LeftToe", "RightToe", structure="few")


def test_joints_that_a_layout_does_not_have_follow_their_parents():
    """And what does exist is where it was: here, hands and feet of a body with one spine joint more."""
    few = _few()
    body = in_layout(BODIES["one"], Pan().body(few).layout)
    assert len(aligned(BODIES["one"]).joints) - len(body.joints) == 3
    motion = dance(pan_material.BODIES["one"], 20)
    returned = there_and_back(FORMS[0], motion, body, "source")
    globals_ = [each.global_rotations for each in (returned, motion)]
    present = [joint for joint in body.joints if joint >= 0]
    assert rotation.angle(globals_[0][:, present], globals_[1][:, present]).max() < 1e-6


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
