"""PAN as a method: who is refused, whose statistics count, and bodies of structures in no training."""

from __future__ import annotations

from functools import cache

import method_bodies
import numpy as np
import pan_material
import pytest
import torch
from method_bodies import apart, carried, dance
from training_material import training_data

from retarget_bench.errors import NotSupported
from retarget_bench.methods.pan import Pan
from retarget_bench.motion import kinematics, roles, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig

BODIES = pan_material.BODIES


def test_bodies_without_training_go_through_what_is_nearest():
    method = pan_material.trained()
    odd = pan_material.without(method_bodies.body("odd"), "LeftToe", "RightToe", structure="odd")
    assert method.assignment(odd).structure == "plain"
    assert (
        method.assignment(pan_material.without(BODIES["legs"], "LeftToe", structure="odd")).structure
        == "short_spine"
    )
    assert method.assignment(BODIES["one_one_armed"]).structure == "plain"
    for name in ("one", "one_one_armed"):
        source = dance(BODIES[name], 20)
        assert np.isfinite(carried(method, source, odd).positions).all()
    assert method.supports(odd, BODIES["one"]) is None


# ----------------------------------------------------------------------------------------- refusals
def test_refusals_are_sentences():
    method = pan_material.trained()
    assert "rex stands on four legs, and these weights know no such body" in method.supports(
        BODIES["rex"], BODIES["one"]
    )
    legless = pan_material.without(
        BODIES["one"],
        "LeftUpLeg",
        "LeftLeg",
        "LeftFoot",
        "LeftToe",
        "RightUpLeg",
        "RightLeg",
        "RightFoot",
        "RightToe",
        structure="legless",
    )
    why = method.supports(legless, BODIES["one"])
    assert why
    with pytest.raises(NotSupported, match=r"one"):
        carried(method, method_bodies.pose(legless, 5, {}, np.zeros((5, 3))), BODIES["one"])
    source = dance(BODIES["one"], 5)
    positions = source.character.positions(source.positions, 30.0)
    with pytest.raises(NotSupported, match="known by positions only"):
        carried(method, positions, BODIES["tall"])
    assert "pan[parts=three] is for bodies of two and of four" in Pan().unfit(BODIES["rex"])
    assert Pan().unfit(BODIES["one"]) == ""
    assert Pan(parts="three").unfit(BODIES["rex"]) == ""


def test_what_a_parameter_says_wins_over_the_variant():
    settings = Pan(variant="paper", cycle=0.0, root="height", facing=2.0, kinematic=10.0).settings
    assert (settings.weights.cycle, settings.features.root, settings.features.facing) == (
        0.0,
        "height",
        2.0,
    )
    assert (settings.weights.kinematic, settings.weights.again_positions) == (10.0, 10.0)
    without = Pan(kinematic=0.0).settings.weights
    assert (without.kinematic, without.again_positions, without.root) == (0.0, 0.0, 0.0)


# --------------------------------------------------------------------------------------- statistics
def test_statistics_of_the_target_are_privileged_and_change_the_answer():
    plain = Pan(statistics="character")
    leaking = Pan(statistics="character", target_stats="own")
    assert plain.card.needs == ()
    assert leaking.card.needs == ("target_motions",)
    assert plain.facts() == leaking.facts(), "the same weights serve both"
    tensors = pan_material.trained(statistics="character").tensors
    plain, leaking = plain.using(tensors), leaking.using(tensors)
    source, motions = dance(BODIES["one"], 20), [dance(BODIES["legs"], 50)]
    leaked = carried(leaking, source, BODIES["legs"], target_motions=motions)
    other = carried(leaking, source, BODIES["legs"], target_motions=[m.at(slice(0, 9)) for m in motions])
    assert apart(leaked, other) > 1e-3
    alone = carried(plain, source, BODIES["legs"], target_motions=motions)
    assert apart(alone, carried(plain, source, BODIES["legs"])) == 0.0
    with pytest.raises(NotSupported, match="no motion of legs to take statistics of"):
        carried(leaking, source, BODIES["legs"])


# ------------------------------------------------------------------------------- bodies of other structures
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
    assert method.supports(points, mixamo_like) is None
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
    assert method.supports(mixamo_like, points) is None
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
