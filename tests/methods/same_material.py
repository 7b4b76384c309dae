"""SAME on the small bodies of ``method_bodies``, and the arrays that the authors' code gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from method_bodies import body, without
from training_material import training_data

from retarget_bench.methods.same import Same
from retarget_bench.methods.same.graph import Nodes
from retarget_bench.methods.same.network import Autoencoder
from retarget_bench.methods.same.released import MODEL, STATISTICS, at
from retarget_bench.methods.same.training import SameTraining
from retarget_bench.motion.character import Character, Motion
from retarget_bench.motion.importer import load
from retarget_bench.motion.measures import measure
from retarget_bench.training.config import presets

BODIES: dict[str, Character] = {
    "plain": replace(body("plain"), name="plain"),
    "small": replace(body("small", scale=0.6, arm=0.4, spines=2, droop=20.0), name="small"),
    "toeless": replace(without(body(spines=5), "LeftToeBase", "RightToeBase", "Neck"), name="toeless"),
}
WINDOW = 8


def training_module(frames: tuple[int, ...] = (30, 11)) -> SameTraining:
    method = Same()
    torch.manual_seed(0)
    return method.training_module(training_data(method, BODIES, frames), presets(method)["quick"])


def trained(**parameters: Any) -> Same:
    """A method whose weights are drawn, not learnt."""
    return Same(**parameters).using(training_module().export())


# --------------------------------------------------------------------------------- the authors' arrays
Oracle = Mapping[str, np.ndarray]
PAIRS = ("pair0", "pair2")


def oracle(real_data: Path) -> Oracle:
    path = real_data / "oracles" / "same_ckpt0.npz"
    if not path.exists():
        pytest.skip(f"no {path.name}")
    with np.load(path, allow_pickle=False) as arrays:
        return dict(arrays)


def write_released(arrays: Oracle, folder: Path) -> Path:
    """The files that the authors' code writes, out of its arrays."""
    model = {name[6:]: torch.from_numpy(each) for name, each in arrays.items() if name.startswith("state/")}
    model |= {name.replace("lin_src", "lin_dst"): each for name, each in model.items() if "lin_src" in name}
    torch.save(
        {"epoch": 239, "model": model, "optimizer": {}, "scheduler": {"last_epoch": 240}}, folder / MODEL
    )
    statistics = {
        name[6:]: torch.from_numpy(each) for name, each in arrays.items() if name.startswith("stats/")
    }
    torch.save(statistics, folder / STATISTICS)
    return folder


def released(arrays: Oracle, folder: Path) -> Autoencoder:
    network = Autoencoder()
    found = at(write_released(arrays, folder))
    assert found is not None
    network.load_state_dict(dict(found.read()))
    return network.eval()


def nodes(arrays: Oracle, side: str) -> Nodes:
    """side: ``pair0/source`` and the like."""
    shape = np.concatenate([arrays[f"{side}/local_offsets"], arrays[f"{side}/global_offsets"]], -1)
    parents = arrays[f"{side}/parents"].astype(np.int64)
    return Nodes(parents, shape, np.isin(np.arange(len(parents)), parents))


def standing(path: Path) -> Motion:
    """A motion whose body's reference pose is its first frame, which is left out, as the authors do."""
    motion = load(path).motion
    one, pose = motion.character, motion.rotations[0]
    sizes = replace(measure(one.skeleton, one.roles, pose), root_offset=float(motion.root[0, 1]))
    character = replace(one, reference_pose=pose, measures=sizes)
    return character.motion(motion.rotations[1:], motion.root[1:], motion.fps)


def order(names: list[str], required: list[str]) -> list[int]:
    """Where the authors' joints are among nodes."""
    return [names.index(name.replace("_End", " tip")) for name in required]
