"""Axes that elbows of a rig bend about, from a sample of its motion, and what the fit makes of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from alignment_rigs import t_pose
from fit_bodies import along_x
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from retarget_bench.motion import importer, kinematics, rotation, structures
from retarget_bench.motion.character import Character
from retarget_bench.motion.fitting.fit import fit
from retarget_bench.motion.hinges import HINGES
from retarget_bench.motion.motion import Motion
from retarget_bench.motion.skeleton import Skeleton
from retarget_bench.verification import rewriting
from tests.examples import examples
from tests.methods.method_bodies import about, body, first, pose

ARMS = ("left_arm", "right_arm")


def axes(degrees: float) -> dict[str, np.ndarray]:
    """Elbow axes turned about the arms, alike on both sides, from those that bend straight forward."""
    turn = np.radians(degrees)
    return {
        "left_arm": np.array([0.0, -np.cos(turn), np.sin(turn)]),
        "right_arm": np.array([0.0, np.cos(turn), -np.sin(turn)]),
    }


def gesture(character: Character, degrees: float, seed: int = 0, frames: int = 90) -> Motion:
    """Shoulders that turn all ways, elbows that bend about axes turned by so much."""
    draw, t = np.random.default_rng(seed), np.linspace(0.0, 6.0, frames)
    turns = {}
    for role, axis in axes(degrees).items():
        side = "Left" if role.startswith("left") else "Right"
        bends = np.radians(75.0 + 35.0 * np.sin(t + draw.uniform(0, 6)))
        turns[f"{side}ForeArm"] = first(Rotation.from_rotvec(bends[:, None] * axis))
        ways = 0.7 * np.sin(t[:, None] + draw.uniform(0, 6, 3))
        turns[f"{side}Arm"] = first(Rotation.from_rotvec(ways))
    return pose(character, frames, turns, np.zeros((frames, 3)))


def rig(degrees: float, seed: int = 5) -> Character:
    """A body whose rig has its elbows' axes turned by so much, as a sample of its motion shows."""
    plain = body()
    return Character.of("rig", plain.skeleton, sample=gesture(plain, degrees, seed).rotations)


def apart(motion: Motion, fitted: Motion, role: str) -> np.ndarray:
    """``(frames,)`` degrees between two motions at a joint, in the world."""
    joint = motion.character.joint_of[role]
    turned = (each.global_rotations[:, joint] for each in (motion, fitted))
    return np.degrees(rotation.angle(*turned))


@examples(20)
@given(st.floats(-60.0, 60.0), st.integers(0, 100))
def test_the_axis_is_the_one_that_elbows_were_bent_about(degrees, seed):
    hinges = rig(degrees, seed).hinges
    for role, axis in axes(degrees).items():
        assert hinges[role] == pytest.approx(axis, abs=1e-9)


def test_the_axis_does_not_depend_on_how_a_rig_is_written():
    """Every bone along +X: the frames of its joints say something else, the axis in space does not."""
    written, plain = along_x(), Character.of("plain", t_pose())
    expected = gesture(plain, 30.0)
    turned = rotation.multiply(expected.global_rotations, written.reference_globals[None])
    local = kinematics.local_from_global(written.skeleton, turned)
    character = Character.of("written", written.skeleton, sample=local)
    for role, axis in axes(30.0).items():
        assert character.hinge(role) == pytest.approx(axis, abs=1e-6)


@pytest.mark.parametrize("degrees", [-20.0, 0.0, 30.0])
def test_upper_arms_of_another_clip_are_fitted_as_the_rig_has_them(degrees):
    motion = gesture(rig(degrees), degrees, seed=1)
    fitted = fit(motion.character.positions(motion.positions, 30.0)).motion
    for role in ARMS:
        assert apart(motion, fitted, role).max() < 8.0  # at the ends, where a smooth curve lags
        assert apart(motion, fitted, role)[10:-10].max() < 2.0


def test_a_sleeve_on_the_forearm_hides_no_elbow():
    """A second bone leaves the elbow; upper arms are twisted as they were all the same."""
    plain = body().skeleton
    arms = [plain.index(f"{side}ForeArm") for side in ("Left", "Right")]
    sleeved = Skeleton(
        (*plain.names, "LSleeve", "RSleeve"),
        np.append(plain.parents, arms),
        np.concatenate([plain.offsets, [[0.07, 0.0, -0.02], [-0.07, 0.0, -0.02]]]),
    )
    motion = gesture(Character.of("sleeved", sleeved), 0.0, seed=1)
    fitted = fit(motion.character.positions(motion.positions, 30.0)).motion
    for role in ARMS:
        assert apart(motion, fitted, role)[10:-10].max() < 2.0


def still(character: Character) -> np.ndarray:
    return pose(character, 20, {}, np.zeros((20, 3))).rotations


def loose(character: Character) -> np.ndarray:
    """Elbows bent about an axis that goes all round."""
    spin = np.linspace(0.0, 360.0, 60)
    turn = rotation.multiply(about("X", spin), about("Y", np.full(60, 60.0)))
    both = {"LeftForeArm": turn, "RightForeArm": turn}
    return pose(character, 60, both, np.zeros((60, 3))).rotations


@pytest.mark.parametrize("sample", [still, loose])
def test_arms_that_show_no_axis_have_that_of_bodies_in_general(sample):
    plain = body()
    character = Character.of("rig", plain.skeleton, sample=sample(plain))
    assert character.hinges == {}
    for role in ARMS:
        assert (character.hinge(role) == HINGES[role]).all()
    assert character.hinge("head") is None


def test_bodies_without_arms_and_clips_without_frames_show_none():
    plain = body()
    empty = np.zeros((0, len(plain.skeleton), 4))
    assert Character.of("rig", plain.skeleton, sample=empty).hinges == {}
    legs = tuple(None if role and "arm" in role else role for role in plain.roles)
    sample = gesture(plain, 30.0).rotations
    assert Character.of("rig", plain.skeleton, roles=legs, sample=sample).hinges == {}


def test_a_body_that_is_written_otherwise_keeps_its_axes():
    original = rig(30.0)
    for other in (rewriting.reordered(original).body, structures.reduce(original, "body22").character):
        assert other.hinge("left_arm") == pytest.approx(axes(30.0)["left_arm"], abs=1e-9)


@pytest.mark.parametrize("file", ["cmu_bvh/01_01.bvh", "cmu_bvh/131_01.bvh", "cmu_bvh/131_02.bvh"])
def test_elbows_of_cmu_are_turned_by_what_its_skeleton_files_say(real_data: Path, file: str):
    """They give a radius one degree of freedom, about an axis that is turned by 30 degrees."""
    if not (real_data / file).is_file():
        pytest.skip(f"{file} is not among the real motion data")
    motion = importer.load(real_data / file).motion.character
    for role, axis in axes(30.0).items():
        assert np.degrees(np.arccos(np.clip(motion.hinges[role] @ axis, -1.0, 1.0))) < 0.5
