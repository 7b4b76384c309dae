"""Bodies over the 22 roles: joints of no length change no place and no orientation of the others."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from retarget_bench.motion import kinematics, transfer
from retarget_bench.motion.body22 import JOINTS, PARENTS, Body22, folded, unfit
from retarget_bench.motion.character import Character
from retarget_bench.motion.skeleton import Skeleton
from tests.methods.method_bodies import body, dance, first, without

LACKING = {
    "none": (),
    "toes": ("LeftToeBase", "RightToeBase"),
    "collar bones": ("LeftShoulder", "RightShoulder"),
    "one collar bone": ("LeftShoulder",),
    "a spine joint": ("Spine1",),
    "all spine joints": ("Spine", "Spine1", "Spine2"),
    "neck": ("Neck",),
    "much": ("Spine2", "Neck", "LeftToeBase", "RightToeBase", "LeftShoulder", "RightShoulder"),
}
FRAMES = 7
each_body = pytest.mark.parametrize("lacking", LACKING)


def short(lacking: str) -> Character:
    return without(body(), *LACKING[lacking])


def anything(seed: int = 0) -> np.ndarray:
    """``(frames, 22, 4)`` rotations."""
    return first(Rotation.random(FRAMES * JOINTS, random_state=seed)).reshape(FRAMES, JOINTS, 4)


@each_body
def test_a_motion_is_seen_and_given_back(lacking):
    motion = dance(short(lacking))
    body22 = Body22(motion.character)
    rotations, hips = body22.see(motion)
    assert (rotations[:, body22.lacks] == [1.0, 0.0, 0.0, 0.0]).all()
    back = body22.motion(rotations, hips, motion.fps)
    np.testing.assert_allclose(back.positions, motion.positions, atol=1e-9)


@each_body
def test_joints_are_where_kinematics_over_the_22_has_them(lacking):
    """Of a motion, and of any answer: the tree of 22 has the places of the body's joints, and those that it
    lacks are where they hang."""
    motion = dance(short(lacking))
    body22 = Body22(motion.character)
    rotations, hips = body22.see(motion)
    places = kinematics.forward(body22.skeleton, rotations, hips)[0]
    np.testing.assert_allclose(places, motion.positions[:, list(body22.joints)], atol=1e-9)
    answer = body22.motion(anything(), hips[:FRAMES], motion.fps)
    places = kinematics.forward(body22.skeleton, folded(anything(), body22.lacks), hips[:FRAMES])[0]
    np.testing.assert_allclose(places, answer.positions[:, list(body22.joints)], atol=1e-9)
    assert body22.lacks.sum() == len(LACKING[lacking])
    np.testing.assert_array_equal(body22.offsets[body22.lacks], 0.0)


@each_body
def test_orientations_of_all_other_joints_are_those_that_were_asked_for(lacking):
    """By SciPy: the product of all rotations from the hips to the joint, joints of no length included."""
    body22 = Body22(short(lacking))
    rotations = anything()
    answer = body22.motion(rotations, np.zeros((FRAMES, 3)), 30.0)
    turned = transfer.relative(answer)
    for rank, joint in zip(body22.ranks, body22.present.joints, strict=True):
        chain = Rotation.identity(FRAMES)
        step = rank
        while step >= 0:
            chain = Rotation.from_quat(rotations[:, step, [1, 2, 3, 0]]) * chain
            step = PARENTS[step]
        assert (
            np.abs((chain.inv() * Rotation.from_quat(turned[:, joint][:, [1, 2, 3, 0]])).magnitude()).max()
            < 1e-6
        )


def test_without_joints_of_no_length_nothing_is_touched():
    rotations = anything()
    assert folded(rotations, np.zeros(JOINTS, dtype=bool)) is rotations
    assert not Body22(body()).lacks.any()


def test_rows_of_a_tensor_may_lack_different_joints():
    lacks = np.stack([Body22(short(lacking)).lacks for lacking in LACKING])
    rotations = np.stack([anything(seed) for seed in range(len(LACKING))])
    rows = torch.from_numpy(rotations).requires_grad_()
    merged = folded(rows, torch.from_numpy(lacks)[:, None])
    for row, missing, result in zip(rotations, lacks, merged.detach().numpy(), strict=True):
        np.testing.assert_allclose(result, folded(row, missing), atol=1e-12)
    merged.sum().backward()
    assert rows.grad is not None
    assert bool(torch.isfinite(rows.grad).all())


@each_body
def test_bodies_that_lack_such_joints_fit(lacking):
    assert unfit(short(lacking), "it") == ""


@pytest.mark.parametrize("joint", ["LeftHand", "RightLeg", "Head"])
def test_a_body_without_a_limb_or_head_does_not(joint):
    assert "no joint is known as" in unfit(without(body(), joint), "it")


def test_a_body_whose_joints_hang_otherwise_does_not():
    original = body()
    names = original.skeleton.names
    parents = original.skeleton.parents.copy()
    parents[names.index("LeftShoulder")] = names.index("Spine")
    other = Skeleton(names, parents, original.skeleton.offsets, original.skeleton.end_sites)
    assert "hang together in another way than it knows" in unfit(Character.of("odd", other), "it")
