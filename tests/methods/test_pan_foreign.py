"""Section 6.2.3: bodies of a structure that is in no training go through one that is, both ways, with bones
of no length where they lack joints."""

from __future__ import annotations

from functools import cache

import method_bodies
import numpy as np
import pan_material
import pytest
import torch
from training_material import training_data

from retarget_bench.api import Context
from retarget_bench.methods.pan import Pan
from retarget_bench.methods.pan.assignment import in_layout
from retarget_bench.motion import kinematics, roles, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.verification import rewriting


@cache
def puppets():
    return bound.dataset(Spec.parse("puppets[size=tiny]")).built.characters()


@cache
def trained(structures: tuple[str, ...]) -> Pan:
    """Weights that are drawn, not learnt, of puppets of these structures."""
    method = Pan()
    cast = {name: each for name, each in puppets().items() if each.structure in structures}
    torch.manual_seed(0)
    config = TrainingConfig(steps=1, batch=4, window=pan_material.WINDOW, rate=1e-3)
    return method.training_module(training_data(method, cast, (24,)), config).method()


def filled(character: Character, like: Character) -> Character:
    """The character with all joints of another: at rest in its reference pose, and those that it lacks at
    the place of the joint that they hang from. Made without PAN's code."""
    positions = kinematics.forward(character.skeleton, character.reference_pose, np.zeros(3))[0]
    counterparts = [character.joint_of.get(role, -1) for role in like.roles]
    filled_places = np.zeros((len(counterparts), 3))
    for joint, (same, parent) in enumerate(zip(counterparts, like.skeleton.parents, strict=True)):
        filled_places[joint] = positions[same] if same >= 0 else filled_places[parent]
    offsets = filled_places - filled_places[np.maximum(like.skeleton.parents, 0)]
    still = np.zeros((len(counterparts), 4))
    still[:, 0] = 1.0
    skeleton = Skeleton(like.skeleton.names, like.skeleton.parents, offsets)
    return Character("filled", skeleton, like.structure, like.roles, still, character.measures)


def performed(motion: Motion, body: Character) -> Motion:
    """The motion by a body that ``filled`` made: joints that were lacking turn with their parents."""
    character = motion.character
    turned = transfer.relative(motion)
    rotations = np.zeros((motion.frames, len(body.skeleton), 4))
    for joint, (role, parent) in enumerate(zip(body.roles, body.skeleton.parents, strict=True)):
        same = character.joint_of.get(role, -1)
        rotations[:, joint] = turned[:, same] if same >= 0 else rotations[:, parent]
    local = kinematics.local_from_global(body.skeleton, rotations)
    return body.motion(local, motion.positions[:, character.joint_of["hips"]], motion.fps)


def carried(method: Pan, source: Motion, target: Character) -> Motion:
    assert method.supports(source.character, target) is None
    return method.retarget(source, target, context=Context())


@pytest.fixture
def points() -> Character:
    return puppets()["hugo"]


@pytest.fixture
def mixamo_like() -> Character:
    return puppets()["clara"]


def test_the_structure_with_the_same_joints_is_chosen(points):
    """Each of body22, body23 and body28 has all joints of h36m17; the fewest bones of no length decide."""
    assert trained(("body22", "body28")).assignment(points).structure == "body22"
    assert trained(("body23", "body28")).assignment(points).structure == "body23"
    assert trained(("body28",)).assignment(points).structure == "body28"
    for name in ("ada", "clara"):
        assert (
            trained(("body22", "body28")).assignment(puppets()[name]).structure == puppets()[name].structure
        )


def test_as_a_source_it_is_the_body_with_bones_of_no_length(points, mixamo_like):
    method = trained(("body28",))
    motion = method_bodies.dance(points, 37)
    answer = carried(method, motion, mixamo_like)
    expected = carried(method, performed(motion, filled(points, mixamo_like)), mixamo_like)
    assert (answer.frames, answer.fps, answer.skeleton) == (37, 30.0, mixamo_like.skeleton)
    apart = np.abs(answer.positions - expected.positions).max()
    assert apart < 1e-4 * mixamo_like.height
    still = carried(method, motion.at(np.zeros(37, dtype=int)), mixamo_like)
    assert np.abs(answer.positions - still.positions).max() > 0.01 * mixamo_like.height, (
        "it heeds the source"
    )


def test_as_a_target_it_is_the_body_with_bones_of_no_length(points, mixamo_like):
    method = trained(("body28",))
    motion = method_bodies.dance(mixamo_like, 37)
    body = filled(points, mixamo_like)
    actual, expected = carried(method, motion, points), carried(method, motion, body)
    assert (actual.frames, actual.fps, actual.skeleton) == (37, 30.0, points.skeleton)
    both = [(points.joint_of[role], body.joint_of[role]) for role in points.joint_of]
    point_joints, body_joints = (list(each) for each in zip(*both, strict=True))
    turned, expected_turns = (
        transfer.relative(actual)[:, point_joints],
        transfer.relative(expected)[:, body_joints],
    )
    assert rotation.angle(turned, expected_turns).max() < 1e-3
    legs = [role for role in points.joint_of if roles.body_part(role).endswith("leg")]
    assert len(legs) == 6
    apart = actual.positions[:, points.joints(legs)] - expected.positions[:, body.joints(legs)]
    assert np.abs(apart).max() < 1e-4 * points.height


def test_what_networks_are_told_of_its_bones(points, mixamo_like):
    """Edges that lead to joints which it lacks are bones of no length, all others its own in full."""
    method = trained(("body28",))
    body = method.assignment(points).body
    bones = np.linalg.norm(method.settings.features.bones(body), axis=1)
    unit = method.settings.features.unit(points)
    positions = kinematics.forward(points.skeleton, points.reference_pose, np.zeros(3))[0]
    for edge, role in enumerate(body.layout.roles[1:]):
        same = points.joint_of.get(role, -1)
        if same < 0:
            assert bones[edge] == 0.0
        else:
            above = points.skeleton.parents[same]
            length = np.linalg.norm(positions[same] - positions[above]) / unit
            assert bones[edge] == pytest.approx(length, rel=1e-5), role


@pytest.mark.parametrize("structure", ["body22", "body23", "body28"])
def test_another_order_of_the_same_joints_is_the_same_body(structure):
    body = next(each for each in puppets().values() if each.structure == structure)
    plain = Pan().body(body)
    other = rewriting.reordered(body).body
    assert other.skeleton.names != body.skeleton.names
    ordered = in_layout(other, plain.layout)
    names = [other.skeleton.names[joint] for joint in ordered.joints]
    assert names == [body.skeleton.names[joint] for joint in plain.joints]
