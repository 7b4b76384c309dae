"""Skinning in torch: against the NumPy version, and its gradients against differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from retarget_bench.motion.character import Motion
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.skinning_torch import bound, joint_moves, skinned
from tests.motion.test_mesh import moved, skin


def in_torch(mesh: Mesh, motion: Motion, dtype: torch.dtype = torch.float32) -> torch.Tensor:
    def tensor(values: np.ndarray) -> torch.Tensor:
        return torch.tensor(values, dtype=dtype)

    places = bound(mesh, motion.skeleton, dtype)
    moves = joint_moves(tensor(motion.positions), tensor(motion.global_rotations), *places)
    return skinned(tensor(mesh.vertices), tensor(mesh.weights), *moves)


@pytest.mark.parametrize("posed", [False, True])
def test_both_versions_agree(posed):
    motion = moved(70)
    mesh = skin(motion.rotations[0] if posed else None)
    expected = mesh.skinned(motion)
    assert np.abs(in_torch(mesh, motion).numpy() - expected).max() < 1e-5
    assert np.abs(in_torch(mesh, motion, torch.float64).numpy() - expected).max() < 1e-12


def test_bodies_of_a_batch_are_moved_as_alone():
    meshes, motions = (skin(), skin(moved(1).rotations[0])), (moved(5), moved(5, seed=9))
    alone = torch.stack([in_torch(*each, torch.float64) for each in zip(meshes, motions, strict=True)])
    stacked = {
        "vertices": [mesh.vertices for mesh in meshes],
        "weights": [mesh.weights for mesh in meshes],
        "positions": [motion.positions for motion in motions],
        "rotations": [motion.global_rotations for motion in motions],
        "places": [mesh.bound(motions[0].skeleton)[0] for mesh in meshes],
        "turned": [mesh.bound(motions[0].skeleton)[1] for mesh in meshes],
    }
    tensors = {name: torch.tensor(np.stack(values)) for name, values in stacked.items()}
    moves = joint_moves(*(tensors[name] for name in ("positions", "rotations", "places", "turned")))
    # two vertices and a joint of padding change nothing
    vertices = torch.nn.functional.pad(tensors["vertices"], (0, 0, 0, 2))
    weights = torch.nn.functional.pad(tensors["weights"], (0, 1, 0, 2))
    padded = [torch.cat([each, each[:, :, :1]], dim=2) for each in moves]
    assert torch.allclose(skinned(vertices, weights, *padded)[:, :, :9], alone, atol=1e-12)
