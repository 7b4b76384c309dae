"""Paths of results: in place, and along an axis."""

from __future__ import annotations

import numpy as np
import pytest
from editing_bodies import body, gait
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.motion import facing, rotation
from retarget_bench.motion.editing import loops, path
from retarget_bench.motion.skeleton import Skeleton
from tests.examples import examples

BODY = body()
AXES = {"x": (1.0, 0.0), "-x": (-1.0, 0.0), "z": (0.0, 1.0), "-z": (0.0, -1.0)}


def local(positions: np.ndarray) -> np.ndarray:
    return positions - positions[:, :1]


def test_in_place_takes_the_path_and_leaves_heights_and_pose():
    motion = gait(BODY, turn=1.0)
    placed = path.in_place(motion)
    np.testing.assert_allclose(placed.root[:, [0, 2]], np.repeat(motion.root[:1, [0, 2]], motion.frames, 0))
    np.testing.assert_allclose(placed.root[:, 1], motion.root[:, 1])
    np.testing.assert_allclose(placed.rotations, motion.rotations)
    np.testing.assert_allclose(path.in_place(placed).root, placed.root)


def test_in_place_holds_the_hips_where_these_are_not_the_root():
    plain = gait(BODY)
    above = BODY.skeleton
    skeleton = Skeleton(
        ("Armature", *above.names),
        np.concatenate([[-1], above.parents + 1]),
        np.concatenate([np.zeros((1, 3)), above.offsets]),
    )
    character = type(BODY).of("rooted", skeleton)
    rotations = np.concatenate(
        [np.tile(rotation.identity(), (plain.frames, 1, 1)), plain.rotations], axis=1
    )
    sway = np.stack([0.1 * np.sin(np.arange(plain.frames)), 0 * plain.root[:, 1], plain.root[:, 2]], axis=1)
    placed = path.in_place(character.motion(rotations, sway, 30.0))
    hips = placed.positions[:, character.joint_of["hips"]]
    assert np.ptp(hips[:, [0, 2]], axis=0).max() < 1e-12


@given(axis=st.sampled_from(sorted(AXES)), turn=st.floats(-3.0, 3.0), x=st.floats(-5.0, 5.0))
@examples(20)
def test_along_an_axis_the_character_travels_there_from_the_same_place(axis, turn, x):
    motion = gait(BODY, speed=2.0)
    motion = path.moved(motion, turn, motion.root[0], np.array([x, 0.0, -x]))
    placed = path.along(motion, axis)
    way = placed.root[-1, [0, 2]] - placed.root[0, [0, 2]]
    np.testing.assert_allclose(way / np.linalg.norm(way), AXES[axis], atol=1e-9)
    np.testing.assert_allclose(placed.root[0], motion.root[0], atol=1e-12)
    np.testing.assert_allclose(placed.root[:, 1], motion.root[:, 1])
    sizes = [np.linalg.norm(local(each.positions), axis=-1) for each in (placed, motion)]
    np.testing.assert_allclose(*sizes, atol=1e-9)
    np.testing.assert_allclose(placed.positions[..., 1], motion.positions[..., 1], atol=1e-9)


@pytest.mark.parametrize("axis", AXES)
def test_a_motion_on_the_spot_faces_along_the_axis(axis):
    motion = gait(BODY, speed=0.05)
    motion = path.moved(motion, 0.7, motion.root[0], np.zeros(3))
    placed = path.along(motion, axis)
    front = facing.facing(placed.positions[:1], BODY)[0]
    np.testing.assert_allclose([front.imag, front.real], AXES[axis], atol=1e-9)


def test_paths_keep_loops():
    motion = gait(BODY, turn=0.5)
    for option in ("in-place", "x", "-z"):
        assert loops.is_loop(path.edited(motion, option))
    assert path.edited(motion, "keep") is motion
