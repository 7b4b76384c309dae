"""What PAN says that it attends to: whose weights these are, at which joints, at which frames."""

from __future__ import annotations

import method_bodies
import numpy as np
import pan_material
import pytest
import torch
from method_bodies import dance

from retarget_bench.errors import NotSupported
from retarget_bench.evaluation import attention as asking
from retarget_bench.methods.pan import Pan
from retarget_bench.plugins import bound
from retarget_bench.plugins.spec import Spec

BODIES = pan_material.BODIES


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
