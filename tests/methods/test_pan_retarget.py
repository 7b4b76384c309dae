"""PAN as a method: refusals, statistics, bodies of other structures, and what it attends to."""

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
from retarget_bench.evaluation import attention as asking
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

BODIES = pan_material.BODIES


# ----------------------------------------------------------------------------------------- refusals
def test_refusals_are_sentences():
    method = pan_material.trained()
    assert "rex stands on four legs, and these weights know no such body" in method.supports(
        BODIES["rex"], BODIES["one"]
    )
    legless = pan_material.without(
        BODIES["one"],
        *(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "Toe")),
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


@pytest.mark.parametrize("structure", ["body22", "body23", "body28"])
def test_another_order_of_the_same_joints_is_the_same_body(structure):
    body = next(each for each in puppets().values() if each.structure == structure)
    plain = Pan().body(body)
    other = rewriting.reordered(body).body
    assert other.skeleton.names != body.skeleton.names
    ordered = in_layout(other, plain.layout)
    names = [other.skeleton.names[joint] for joint in ordered.joints]
    assert names == [body.skeleton.names[joint] for joint in plain.joints]


# ------------------------------------------------------------------------------------- what parts attend to
def asked(method, motion) -> asking.Attention:
    return asking.ask(method, motion, "pan")


def marked(method, name, by_frame=False) -> None:
    """The encoder of a structure says in the place of weights which edge it is, or which frame."""
    encoder = method.structures[name].encoder

    def attention(values):
        rows, frames, edges = values.shape[:3]
        which = torch.arange(frames if by_frame else edges) / 1000.0
        each = which[:, None] if by_frame else which[None]
        parts = encoder.count
        mask = torch.zeros(parts, edges)
        mask[:, encoder.edges] = (encoder.hidden[:parts, parts:] == 0.0).float()
        return (each[:, None] * mask).expand(rows, frames, parts, edges)

    encoder.attention = attention


def fresh(names=pan_material.TWO, **parameters) -> Pan:
    """A method of its own, whose networks may be spoilt."""
    return pan_material.training_module(names, **parameters).method()


@pytest.mark.parametrize("variant", ["own", "released", "paper"])
def test_a_part_heeds_joints_of_its_own_and_weights_add_up_to_less_than_one(variant):
    method = pan_material.trained(variant=variant)
    motion = dance(pan_material.BODIES["one"], 20)
    weights = asked(method, motion)
    assert weights.parts == ("left_leg", "right_leg", "spine", "head", "left_arm", "right_arm")
    assert weights.weights.shape == (20, 6, len(weights.joints))
    assert sorted(weights.joints) == list(range(len(motion.skeleton)))
    total = weights.weights.sum(-1)
    assert ((total > 0.3) & (total < 1.0)).all()
    assert (weights.weights[:, weights.sees] > 0.0).all()
    names = np.array(motion.skeleton.names)[weights.joints]
    of = {part: set(names[sees]) for part, sees in zip(weights.parts, weights.sees, strict=True)}
    assert of["left_leg"] == {"Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase"}
    assert of["head"] == {"Hips", "Spine2", "Neck", "Head"}
    assert of["right_arm"] == {
        "Hips",
        "Spine2",
        *(f"Right{p}" for p in ("Shoulder", "Arm", "ForeArm", "Hand")),
    }
    assert asked(method, motion).weights.tobytes() == weights.weights.tobytes()


def test_a_joint_has_the_weight_of_the_slot_that_leads_to_it_and_the_hips_that_of_the_root():
    """In these bodies joint c hangs at the end of edge c - 1; the root's edge is the last."""
    method = fresh()
    marked(method, "plain")
    body = BODIES["one"]
    weights = asked(method, method_bodies.dance(body, 3))
    edges = len(body.skeleton) - 1
    for joint, weight in zip(weights.joints, weights.largest[0], strict=True):
        expected = edges if body.roles[joint] == "hips" else joint - 1
        assert weight == pytest.approx(expected / 1000.0), body.skeleton.names[joint]


@pytest.mark.parametrize("fps", [30.0, 60.0, 24.0])
def test_weights_are_those_of_the_sources_own_frames(fps):
    method = fresh()
    marked(method, "plain", by_frame=True)
    motion = dance(pan_material.BODIES["one"], 31)
    other = motion.character.motion(motion.rotations, motion.root, fps)
    weights = asked(method, other)
    seconds = np.arange(31) / fps
    expected = np.minimum(seconds, (31 - 1) / fps) * 30.0 / 1000.0
    np.testing.assert_allclose(
        weights.largest, np.repeat(expected[:, None], len(weights.joints), 1), atol=1e-7
    )


def test_long_clips_go_in_pieces(monkeypatch):
    from retarget_bench.methods.pan import attention_weights

    method = pan_material.trained()
    motion = dance(pan_material.BODIES["legs"], 50)
    at_once = asked(method, motion)
    monkeypatch.setattr(attention_weights, "PIECE", 16)
    np.testing.assert_allclose(asked(method, motion).weights, at_once.weights, atol=1e-6)


def test_a_whole_body_is_one_part():
    weights = asked(fresh(by_part=False), method_bodies.dance(BODIES["one"], 4))
    assert weights.parts == ("whole body",)
    assert weights.sees.all()


def test_of_joints_the_hips_have_the_weight_of_their_rotation_and_of_the_root():
    method = pan_material.trained(pan_material.LEGS, parts="three", variant="released")
    weights = asked(method, method_bodies.dance(BODIES["one"], 4))
    assert len(set(weights.joints)) == len(weights.joints)
    assert weights.sees[:, weights.joints == BODIES["one"].joint_of["hips"]].all(0).tolist() == [True]
    assert (weights.weights.sum(-1) < 1.0).all(), "the rest is the token's to itself"
    assert (weights.weights.sum(-1) > 0.5).all()


def test_without_attention_there_is_none_to_show():
    with pytest.raises(NotSupported, match="MLP in the place of attention"):
        asked(fresh(attention=False), method_bodies.dance(BODIES["one"], 4))


def test_a_body_of_no_known_structure_is_explained():
    """Section 6.2.3: what it lacks has no joint to show a weight on, so that weights add up to less."""
    hugo = bound.dataset(Spec.parse("puppets[size=tiny]")).built.characters()["hugo"]
    method = fresh()
    assignment = method.assignment(hugo).body
    marked(method, "plain" if len(assignment.layout.parents) == 22 else "short_spine")
    weights = asked(method, method_bodies.dance(hugo, 4))
    assert sorted(weights.joints) == list(range(17))
    assert "hugo (h36m17) goes through the networks of" in weights.note
    lacking = sum(joint < 0 for joint in assignment.joints)
    assert f"{lacking} joints there that it lacks are bones of no length" in weights.note
    place = {role: n for n, role in enumerate(assignment.layout.roles) if role}
    for joint, weight in zip(weights.joints, weights.largest[0], strict=True):
        role = hugo.roles[joint]
        expected = assignment.layout.edges if role == "hips" else place[role] - 1
        assert weight == pytest.approx(expected / 1000.0), role


def test_bodies_that_were_trained_on_need_no_explanation():
    method = pan_material.trained()
    for name in pan_material.TWO:
        assert asked(method, method_bodies.dance(BODIES[name], 2)).note == ""
