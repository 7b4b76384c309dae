"""Two puppets with their meshes, as SKR and SKIN are trained on them, and networks that know nothing."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import torch
from training_material import single_precision

from retarget_bench.methods.skin import SKIN
from retarget_bench.methods.skr import SKR
from retarget_bench.methods.skr.network import SkeletonRegressor
from retarget_bench.motion.character import Character
from retarget_bench.motion.mesh import Mesh
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.data import ClipArrays, TrainingData
from retarget_bench.training.layers import exported

NAMES = ("ada", "boris")
CONFIG = TrainingConfig(steps=1, batch=4, window=1, rate=1e-3)


@cache
def motions() -> dict[str, Motion]:
    """A clip of each body."""
    data: Any = registry.create("datasets", Spec.parse("puppets"))
    clips = {name: each for bodies in data.training().values() for name, each in bodies.items()}
    return {name: clips[name][0] for name in NAMES}


@cache
def body(name: str = "ada") -> Character:
    return motions()[name].character


def training_data(method: Any) -> TrainingData:
    clips = {}
    for name, motion in motions().items():
        clips[name] = [ClipArrays(name, "clip", single_precision(method.prepare(motion)))]
    return TrainingData({name: body(name) for name in clips}, clips)


def skr_training(**parameters: Any) -> Any:
    """SKR's training module for few points."""
    method = SKR(**{"fewest": 48, "most": 80, **parameters})
    torch.manual_seed(0)
    return method.training_module(training_data(method), CONFIG)


def skin_training(**parameters: Any) -> Any:
    """SKIN's training module, with the joints that bodies have."""
    method = SKIN(**{"joints": "truth", **parameters})
    torch.manual_seed(0)
    return method.training_module(training_data(method), CONFIG)


def regressor(seed: int = 0, **parameters: Any) -> SkeletonRegressor:
    """Random weights in every layer; the last ones begin at nothing and would hide the others."""
    torch.manual_seed(seed)
    network = SkeletonRegressor(**parameters)
    with torch.no_grad():
        for part in network.modules():
            if isinstance(part, torch.nn.Linear):
                part.bias.normal_(std=0.02)
        network.last.weight.normal_(std=0.01)
        network.turned.last.weight.normal_(std=0.02)
        if network.mixed is not None:
            network.mixed.last.weight.normal_(std=0.002)
    return network.eval()


@cache
def untrained(seed: int = 0) -> SKR:
    return SKR().using(exported(regressor(seed)))


def points(count: int = 500, frames: int = 2, seed: int = 0) -> list[np.ndarray]:
    """Roughly the shape of a person who stands 3 m from the origin, single precision."""
    numbers = np.random.default_rng(seed)
    drawn = numbers.normal(size=(frames, count, 3)) * [0.3, 0.5, 0.15] + [3.0, 0.9, -2.0]
    return list(drawn.astype(np.float32))


def halved(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces, and of every vertex the number of the one that it was, -1 for new ones: of pairs of
    neighbours one takes the place of the other, in the middle of their edge."""
    merged, onto = np.zeros(len(mesh.vertices), bool), np.arange(len(mesh.vertices))
    places = mesh.vertices.copy()
    edges = np.concatenate([mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)])
    for a, b in edges.tolist():
        if not merged[a] and not merged[b]:
            merged[a] = merged[b] = True
            onto[b] = a
            places[a] = 0.5 * (mesh.vertices[a] + mesh.vertices[b])
    kept, numbers = np.unique(onto, return_inverse=True)
    faces = numbers[mesh.faces]
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return places[kept], faces[proper], np.where(merged[kept], -1, kept)
