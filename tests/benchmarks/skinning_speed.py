"""Seconds that linear blend skinning takes: ours in NumPy and in torch, beside two usual forms.

    python tests/benchmarks/skinning_speed.py

``naive`` is the formula as it stands, with a transform of each joint for each vertex, ``(F, V, J, 4, 4)``,
summed by one einsum. ``blended`` is the form of smplx (Pavlakos et al. 2019, ``lbs.py``): transforms are
blended to ``(F, V, 4, 4)`` by a product of matrices, then applied to homogeneous vertices. Ours multiplies
vertices by weights once, and moves them all by one product. All give the same vertices to 1e-5 m.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from collections.abc import Callable

import numpy as np
import torch

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion
from retarget_bench.motion.skinning_torch import bound, joint_moves, skinned
from retarget_bench.plugins import registry

FRAMES, ROUNDS = 300, 5
CHUNK = 4
"""Frames that the naive form takes at a time: 300 would fill 4 GB."""


def walk() -> Motion:
    """So many frames of a puppet."""
    data = registry.create("datasets", "puppets[size=tiny]")
    moved = data.load(data.cases("retarget", "self")[0]).source
    found = moved.at(np.resize(np.arange(moved.frames), FRAMES))
    assert found.positions is not None
    return found


def transforms(motion: Motion) -> np.ndarray:
    """``(F, J, 4, 4)`` from the mesh's own pose to the motion's."""
    places, turned = motion.character.mesh.bound(motion.skeleton)
    found = np.zeros((motion.frames, len(places), 4, 4))
    found[..., :3, :3] = rotation.to_matrix(
        rotation.multiply(motion.global_rotations, rotation.conjugate(turned))
    )
    found[..., :3, 3] = motion.positions - np.einsum("fjab,jb->fja", found[..., :3, :3], places)
    found[..., 3, 3] = 1.0
    return found


def naive(motion: Motion) -> np.ndarray:
    mesh, moves = motion.character.mesh, transforms(motion)
    points = np.concatenate([mesh.vertices, np.ones((len(mesh.vertices), 1))], axis=1)
    found = np.empty((motion.frames, *mesh.vertices.shape))
    for first in range(0, motion.frames, CHUNK):
        each = mesh.weights[None, :, :, None, None] * moves[first : first + CHUNK, None]
        found[first : first + CHUNK] = np.einsum("fvjab,vb->fva", each, points)[..., :3]
    return found


def blended(motion: Motion) -> np.ndarray:
    mesh, moves = motion.character.mesh, transforms(motion)
    points = np.concatenate([mesh.vertices, np.ones((len(mesh.vertices), 1))], axis=1)
    each = (mesh.weights @ moves.reshape(*moves.shape[:2], 16)).reshape(motion.frames, -1, 4, 4)
    found: np.ndarray = (each @ points[..., None])[..., :3, 0]
    return found


def ours(motion: Motion) -> np.ndarray:
    return motion.character.mesh.skinned(motion)


def in_torch(motion: Motion) -> np.ndarray:
    mesh = motion.character.mesh

    def tensor(values: np.ndarray) -> torch.Tensor:
        return torch.tensor(values, dtype=torch.float32)

    moves = joint_moves(
        tensor(motion.positions), tensor(motion.global_rotations), *bound(mesh, motion.skeleton)
    )
    return skinned(tensor(mesh.vertices), tensor(mesh.weights), *moves).numpy()


def seconds(work: Callable[[], object]) -> float:
    """Of the processor; the least of several."""
    taken = []
    for _ in range(ROUNDS):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    return min(taken)


def main() -> None:
    torch.set_num_threads(1)
    motion = walk()
    joints, vertices = len(motion.skeleton), len(motion.character.mesh.vertices)
    print(f"{FRAMES} frames, {vertices} vertices, {joints} joints, one thread")
    reference, base = ours(motion), 0.0
    for name, form in (("naive", naive), ("blended", blended), ("ours", ours), ("ours, torch", in_torch)):
        off = float(np.abs(form(motion) - reference).max())
        assert off < 1e-5, f"{name} gives other vertices"
        taken = seconds(lambda form=form: form(motion))
        base = base or taken
        print(f"  {name:<12} {1000 * taken:8.1f} ms  {base / taken:6.1f} times naive   within {off:.1e} m")


if __name__ == "__main__":
    main()
