"""Joints that HuMoT's networks do not see: eyes, hair, fingers and capes go where their bodies turn."""

from __future__ import annotations

from pathlib import Path

import humot_material
import numpy as np
import pytest

from retarget_bench.api import Context
from retarget_bench.methods.humot.features import body
from retarget_bench.motion import importer, rates, rotation, transfer
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from tests.methods import method_bodies
from tests.methods.method_bodies import about, dance, pose

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


def turning(character: Character, degrees: float, frames: int = 60) -> Motion:
    height = np.full((frames, 1), character.measures.hip_height) * [[0.0, 1.0, 0.0]]
    return pose(character, frames, {"Hips": about("Y", np.linspace(0.0, degrees, frames))}, height)


def moving(character: Character) -> Motion:
    """A dance in which nothing of the extras moves of its own but the tail, which has a role."""
    motion = dance(character)
    rotations = motion.rotations.copy()
    rotations[:, [character.skeleton.index(name) for name in EXTRAS if name != "Tail"]] = [1, 0, 0, 0]
    return character.motion(rotations, motion.root, motion.fps)


def test_a_body_that_turns_by_202_degrees_turns_its_head_its_eyes_and_its_cape():
    motion = turning(dressed(), 202.0)
    humot_body = body(motion.character)
    assert {motion.skeleton.names[joint] for joint in humot_body.joints} & EXTRAS.keys() <= {
        "Tail",
        "Tail1",
    }
    restored = humot_body.positions(humot_body.see(motion), 30.0)
    np.testing.assert_allclose(restored.positions, motion.positions, atol=EXACT)
    fitted = fit(restored).motion
    expected = about("Y", np.linspace(0.0, 202.0, 60))
    for name in ("Hips", "Spine2", "Head", "LeftHand", "Cape"):
        turned = fitted.global_rotations[:, fitted.skeleton.index(name)]
        assert np.degrees(rotation.angle(turned, expected)).max() < 0.5


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


def test_a_perfect_network_gives_back_what_it_does_not_see(monkeypatch):
    monkeypatch.setattr(
        "retarget_bench.methods.humot.network.Autoencoder.forward",
        lambda self, inputs, target_side, frames: inputs["places"],
    )
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
