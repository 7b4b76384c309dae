"""Retargeting by HuMoT: any length, rate and skeleton, and joints that its networks do not see."""

from __future__ import annotations

from pathlib import Path

import humot_material
import method_bodies
import numpy as np
import pan_material
import pytest

from retarget_bench.api import Context
from retarget_bench.evaluation.tasks.definitions import reduced
from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import MAJOR, USUAL, body
from retarget_bench.methods.humot.inference import WINDOW, Question
from retarget_bench.motion import aligned, importer, rates, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from tests.methods.method_bodies import dance

BODIES = humot_material.BODIES


@pytest.fixture(scope="module")
def method():
    return humot_material.trained()


@pytest.fixture
def perfect(monkeypatch):
    """Networks that answer with what they are given."""
    monkeypatch.setattr(
        "retarget_bench.methods.humot.network.Autoencoder.forward",
        lambda self, inputs, target_side, frames: inputs["places"],
    )


def danced(name, frames):
    return method_bodies.dance(pan_material.BODIES[name], frames)


def carried(method, source, target):
    return method.retarget(source, target, context=Context(seed=0))


@pytest.mark.parametrize("frames", [1, 2, 12])
def test_a_clip_shorter_than_a_window_waits_where_it_ends(method, frames):
    source = danced("one", frames)
    waiting = source.at(np.minimum(np.arange(WINDOW), frames - 1))
    answer, expected = (carried(method, each, BODIES["legs"]).positions for each in (source, waiting))
    assert len(answer) == frames
    np.testing.assert_allclose(answer, expected[:frames], atol=1e-5)


def test_a_perfect_network_gives_the_source_back(method, perfect):
    """What is around the networks changes nothing: pieces, fading, axes, rates."""
    for frames in (1, 12, 77):
        source = danced("one", frames)
        answer = carried(method, source, source.character)
        np.testing.assert_allclose(answer.positions, source.positions, atol=1e-5)


@pytest.mark.parametrize("rule", ["leg_length", "hip_height"])
def test_the_hips_path_is_scaled_by_the_legs(method, perfect, rule):
    method = HuMoT(root_rule=rule).using(method.tensors)
    source, tall = danced("one", 50), BODIES["tall"]
    positions = carried(method, source, tall).positions
    ratio = getattr(tall.measures, rule) / getattr(source.character.measures, rule)
    np.testing.assert_allclose(positions[:, 0], ratio * source.positions[:, 0], atol=1e-5)
    joints = list(body(tall).joints)
    poses = (positions[:, joints] - positions[:, :1]) / body(tall).stature
    expected = (source.positions[:, joints] - source.positions[:, :1]) / body(source.character).stature
    np.testing.assert_allclose(poses, expected, atol=1e-5)


def test_a_skeleton_never_trained_on_is_taken():
    method = humot_material.trained(("one", "tall"))
    assert method.supports(BODIES["legs"], BODIES["one_one_armed"]) is None
    answer = carried(method, danced("legs", 20), BODIES["one_one_armed"])
    assert answer.positions.shape == (20, len(BODIES["one_one_armed"].skeleton), 3)


def test_a_part_of_a_body_is_read_and_not_written(method):
    """The paper's Figure 12: twelve joints in, the whole body out."""
    source = danced("one", 20)
    full = source.character
    kept = sorted(full.joint_of[role] for role in MAJOR)
    part = reduced(full, kept)
    part_positions = part.positions(source.positions[:, kept], source.fps)
    assert method.supports(part, full) is None
    assert carried(method, part_positions, full).positions.shape == (20, len(full.skeleton), 3)
    assert "known as hips" in method.supports(full, part)
    places = [body(full).joints.index(joint) for joint in kept]
    np.testing.assert_allclose(body(part).template, body(full).template[places], atol=1e-9)


@pytest.mark.parametrize("kept", ["left_", "right_foot", "head", "spine"])
def test_a_part_is_centred_where_the_whole_body_is(method, monkeypatch, kept):
    """A body that stands as its template does, turned and put anywhere: what is given of it lies where the
    networks saw it in training, which leaves joints out after it has centred a window."""
    batches = []
    monkeypatch.setattr(
        "retarget_bench.methods.humot.network.Autoencoder.forward",
        lambda self, inputs, target_side, frames: (
            batches.append(inputs) or target_side["template"][:, None].repeat(1, WINDOW, 1, 1)
        ),
    )
    full = BODIES["one"]
    turn = rotation.about(np.array([0.0, 1.0, 0.0]), 2.0)
    places = rotation.rotate(turn, aligned.template(full)) + np.array([3.0, 1.0, -2.0])
    joints = [joint for role, joint in full.joint_of.items() if role.startswith(kept)]
    part = reduced(full, joints)
    assert joints
    assert method.supports(part, full) is None
    carried(method, part.positions(np.repeat(places[None, sorted(joints)], 5, 0), 30.0), full)
    humot_body = body(full)
    expected = humot_body.template - humot_body.template[humot_body.major].mean(0)
    expected = (
        expected[[humot_body.joints.index(joint) for joint in sorted(joints)]] * USUAL / humot_body.stature
    )
    inputs = batches[0]["places"][0, 0].numpy()
    np.testing.assert_allclose(inputs[:, 2], expected[:, 2], atol=1e-5)
    if len(joints) > 1 and kept == "left_":  # which way less stands, nothing tells
        np.testing.assert_allclose(inputs, expected, atol=1e-5)


@pytest.mark.parametrize("beyond", [0.2, 0.9, 3.0])
def test_what_size_a_body_has_is_nothing_that_the_networks_are_told(method, beyond):
    """As sources and as targets: the same answers, in the body's size."""
    source = danced("one", 40)
    one = source.character
    skeleton = one.skeleton
    resized = Skeleton(skeleton.names, skeleton.parents, skeleton.offsets * beyond)
    other = Character.of("resized", resized, roles=one.roles)
    moved = other.motion(source.rotations, source.root * beyond, source.fps)
    expected = carried(method, source, one).positions
    for actor in (source, moved):
        for target, factor in ((one, 1.0), (other, beyond)):
            np.testing.assert_allclose(
                carried(method, actor, target).positions / factor, expected, atol=1e-4
            )


def test_bodies_go_through_as_they_are_where_that_is_asked_for():
    pair = danced("one", 20), BODIES["tall"]
    own, usual = (Question.of(*pair, "leg_length", each) for each in (False, True))
    assert (own.actor_size, own.body_size) == (1.0, 1.0)
    pose, joint_of = aligned.template(BODIES["tall"]), BODIES["tall"].joint_of
    shoulder, ankle = (pose[joint_of[role], 1] for role in ("left_arm", "left_foot"))
    assert usual.body_size * (shoulder - ankle) == pytest.approx(USUAL)


def test_thirty_frames_per_second_are_the_networks(method):
    """A source at 60 gives what every second frame of it gives, at those frames."""
    source = danced("one", 41)
    fast = source.character.motion(source.rotations, source.root, 60.0)
    slow = rates.at_thirty(fast)
    answered = carried(method, fast, BODIES["legs"]).positions[::2]
    np.testing.assert_allclose(answered, carried(method, slow, BODIES["legs"]).positions, atol=1e-5)


# -------------------------------------------------------------------------- joints that networks do not see
EXTRAS = {
    "LeftEye": ("Head", (0.03, 0.05, 0.08)),
    "RightEye": ("Head", (-0.03, 0.05, 0.08)),
    "Hair": ("Head", (0.0, 0.12, -0.08)),
    "Hair1": ("Hair", (0.0, -0.1, -0.05)),
    "Cape": ("Spine2", (0.0, 0.05, -0.1)),
    "Cape1": ("Cape", (0.0, -0.4, -0.05)),
    "Tail": ("Hips", (0.0, 0.0, -0.15)),
    "Tail1": ("Tail", (0.0, -0.05, -0.15)),
    "Pouch": ("Hips", (0.12, -0.02, 0.05)),
    "LeftHandIndex1": ("LeftHand", (0.08, 0.0, 0.02)),
    "LeftHandThumb1": ("LeftHand", (0.03, 0.0, 0.05)),
    "RightHandIndex1": ("RightHand", (-0.08, 0.0, 0.02)),
    "RightHandThumb1": ("RightHand", (-0.03, 0.0, 0.05)),
}
EXACT = 1e-4


def dressed(scale: float = 1.0) -> Character:
    plain = method_bodies.body(scale=scale).skeleton
    names = (*plain.names, *EXTRAS)
    parents = [*plain.parents, *(names.index(parent) for parent, _ in EXTRAS.values())]
    extras = scale * np.array([offset for _, offset in EXTRAS.values()])
    offsets = np.concatenate([plain.offsets, extras])
    return Character.of("dressed", Skeleton(names, np.array(parents), offsets))


def moving(character: Character) -> Motion:
    """A dance in which nothing of the extras moves of its own but the tail, which has a role."""
    motion = dance(character)
    rotations = motion.rotations.copy()
    rotations[:, [character.skeleton.index(name) for name in EXTRAS if name != "Tail"]] = [1, 0, 0, 0]
    return character.motion(rotations, motion.root, motion.fps)


@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_heads_and_hands_are_turned_as_the_source_s(scale):
    """Positions of necks and wrists do not show it. The source has neither eyes nor fingers."""
    plain, target = dance(method_bodies.body()), dressed(scale)
    expected = transfer.carry(plain, target, "hip_height")
    humot_body = body(target)
    restored = humot_body.positions(humot_body.see(expected), 30.0, plain)
    np.testing.assert_allclose(restored.positions, expected.positions, atol=EXACT)
    silent = humot_body.positions(
        humot_body.see(expected), 30.0, plain.character.positions(plain.positions, 30.0)
    )
    assert np.abs(silent.positions - expected.positions).max() > 0.02


def test_a_perfect_network_gives_back_what_it_does_not_see(perfect):
    source = moving(dressed())
    answer = humot_material.trained().retarget(source, source.character, context=Context(seed=0))
    np.testing.assert_allclose(answer.positions, source.positions, atol=EXACT)


@pytest.mark.parametrize(
    "file",
    ["cmu_iclone/005_03.bvh", "mixamo_san/BigVegas/Box Turn.bvh", "mixamo_san/Kaya/Getting Thrown.bvh"],
)
def test_heads_of_real_rigs_turn_with_their_bodies(real_data: Path, file: str):
    if not (real_data / file).is_file():
        pytest.skip(f"{file} is not among the real motion data")
    motion = rates.at_thirty(importer.load(real_data / file).motion).at(slice(0, 60))
    humot_body, head = body(motion.character), motion.character.joint_of["head"]
    for source, most in ((motion, 2.0), (None, 90.0)):
        fitted = fit(humot_body.positions(humot_body.see(motion), 30.0, source), source).motion
        turned = [each.global_rotations[:, head] for each in (fitted, motion)]
        assert np.degrees(rotation.angle(*turned)).max() < most
        fastest = [np.degrees(rotation.angle(each[1:], each[:-1])).max() for each in turned]
        assert fastest[0] < 1.2 * fastest[1] + 5.0
