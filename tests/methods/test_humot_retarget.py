"""Retargeting by HuMoT: any length, rate and skeleton, and what is beside a clip does not matter."""

from __future__ import annotations

import humot_material
import method_bodies
import numpy as np
import pan_material
import pytest

from retarget_bench.api import Context
from retarget_bench.evaluation.tasks.definitions import reduced
from retarget_bench.methods.humot import HuMoT
from retarget_bench.methods.humot.features import MAJOR, USUAL, body
from retarget_bench.methods.humot.inference import HOP, WINDOW, Question, _fade, _pieces
from retarget_bench.motion import aligned, rates, rotation
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton

BODIES = humot_material.BODIES


@pytest.fixture(scope="module")
def method():
    return humot_material.trained()


def dance(name, frames):
    return method_bodies.dance(pan_material.BODIES[name], frames)


def carried(method, source, target):
    return method.retarget(source, target, context=Context(seed=0))


def test_windows_cover_a_clip_and_fade_into_each_other(method):
    for frames in (5, 30, 31, 44, 45, 46, 100):
        question = Question.of(dance("one", frames), BODIES["one"], "leg_length", True)
        pieces = list(_pieces(question, "overlapping"))
        weight = np.zeros(max(frames, WINDOW))
        for piece in pieces:
            assert piece.stop - piece.start == WINDOW
            weight[piece.start : piece.stop] += _fade(piece.stop - piece.start)
        assert (weight > 0.0).all()
        assert [piece.start for piece in pieces][:-1] == list(range(0, max(frames - WINDOW, 0), HOP))
    assert len(list(_pieces(question, "whole"))) == 1


@pytest.mark.parametrize("frames", [1, 2, 12])
def test_a_clip_shorter_than_a_window_waits_where_it_ends(method, frames):
    source = dance("one", frames)
    waiting = source.at(np.minimum(np.arange(WINDOW), frames - 1))
    answer, expected = (carried(method, each, BODIES["legs"]).positions for each in (source, waiting))
    assert len(answer) == frames
    np.testing.assert_allclose(answer, expected[:frames], atol=1e-5)


def test_an_answer_moves_with_its_source(method):
    """Windows are centred: another place in the world is the same question."""
    source = dance("one", 40)
    step = np.array([3.0, 0.5, -2.0])
    there = source.character.motion(source.rotations, source.root + step, source.fps)
    answer, expected = (carried(method, each, BODIES["tall"]).positions for each in (there, source))
    ratio = BODIES["tall"].measures.leg_length / BODIES["one"].measures.leg_length
    np.testing.assert_allclose(answer, expected + ratio * step, atol=1e-4)


def test_a_perfect_network_gives_the_source_back(method, monkeypatch):
    """What is around the networks changes nothing: pieces, fading, axes, rates."""
    monkeypatch.setattr(
        "retarget_bench.methods.humot.network.Autoencoder.forward",
        lambda self, inputs, target_side, frames: inputs["places"],
    )
    for frames in (1, 12, 77):
        source = dance("one", frames)
        answer = carried(method, source, source.character)
        np.testing.assert_allclose(answer.positions, source.positions, atol=1e-5)


@pytest.mark.parametrize("rule", ["leg_length", "hip_height"])
def test_the_hips_path_is_scaled_by_the_legs(method, monkeypatch, rule):
    method = HuMoT(root_rule=rule).using(method.tensors)
    monkeypatch.setattr(
        "retarget_bench.methods.humot.network.Autoencoder.forward",
        lambda self, inputs, target_side, frames: inputs["places"],
    )
    source, tall = dance("one", 50), BODIES["tall"]
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
    answer = carried(method, dance("legs", 20), BODIES["one_one_armed"])
    assert answer.positions.shape == (20, len(BODIES["one_one_armed"].skeleton), 3)


def test_thirty_frames_per_second_are_the_networks(method):
    """A source at 60 gives what every second frame of it gives, at those frames."""
    source = dance("one", 41)
    fast = source.character.motion(source.rotations, source.root, 60.0)
    slow = rates.at_thirty(fast)
    answered = carried(method, fast, BODIES["legs"]).positions[::2]
    np.testing.assert_allclose(answered, carried(method, slow, BODIES["legs"]).positions, atol=1e-5)


def test_a_part_of_a_body_is_read_and_not_written(method):
    """The paper's Figure 12: twelve joints in, the whole body out."""
    source = dance("one", 20)
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
    source = dance("one", 40)
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
    pair = dance("one", 20), BODIES["tall"]
    own, usual = (Question.of(*pair, "leg_length", each) for each in (False, True))
    assert (own.actor_size, own.body_size) == (1.0, 1.0)
    pose, joint_of = aligned.template(BODIES["tall"]), BODIES["tall"].joint_of
    shoulder, ankle = (pose[joint_of[role], 1] for role in ("left_arm", "left_foot"))
    assert usual.body_size * (shoulder - ankle) == pytest.approx(USUAL)
