"""The files of SAN's and PAN's authors, out of the arrays that their code answers with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import torch

Arrays = Mapping[str, np.ndarray]
MIXAMO = {"S23": "topology0", "S28": "topology1"}
EPOCH = "20000"


def arrays(real_data: Path, name: str) -> Arrays:
    path = real_data / "oracles" / f"{name}.npz"
    if not path.is_file():
        pytest.skip("no answers of the authors' code")
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def state(oracle: Arrays, network: str, start: str = "") -> dict[str, torch.Tensor]:
    """A state dict as the authors' code saves it: masks beside weights, poolings, the encoder twice."""
    content = {}
    for kind, end in (("state", ""), ("mask", ".mask"), ("pool_weight", ".weight")):
        before = f"{start}{kind}/{network}/"
        content |= {
            name.removeprefix(before) + end: torch.tensor(each, dtype=torch.float32)
            for name, each in oracle.items()
            if name.startswith(before)
        }
    if any(name.startswith("dec.unpools") for name in content):
        content |= {f"dec.{name}": each for name, each in content.items() if name.startswith("enc.")}
    return content


def save(folder: Path, networks: Mapping[str, Mapping[str, torch.Tensor]], prefix: str = "") -> None:
    folder.mkdir(parents=True)
    for name, content in networks.items():
        torch.save({prefix + key: each for key, each in content.items()}, folder / name)


def mixamo(real_data: Path, method: str, folder: Path, prefix: str = "") -> Path:
    """``pretrained`` of a repository, with the statistics where SAN's has them."""
    for name, topology in MIXAMO.items():
        oracle = arrays(real_data, f"{method}_{name}")
        networks = {f"{each}.pt": state(oracle, each) for each in ("auto_encoder", "static_encoder")}
        save(folder / "pretrained" / "models" / topology / EPOCH, networks, prefix)
        (folder / "pretrained" / "models" / topology / "15000").mkdir()
        statistics = folder / "datasets" / "Mixamo" / "mean_var"
        statistics.mkdir(parents=True, exist_ok=True)
        for number, character in enumerate(oracle["structure/characters"]):
            for kind in ("mean", "var"):
                np.save(statistics / f"{character}_{kind}.npy", oracle[f"norm/{kind}"][number])
    return folder / "pretrained"


def between_legs(real_data: Path, folder: Path) -> Path:
    """``pretrained_lafan1dog``, the statistics beside ``models``."""
    oracle = arrays(real_data, "pan_three")
    for name, statistics in (("human", "humstats"), ("dog", "dogstats")):
        networks = {f"{each}.pth": state(oracle, each, f"{name}/") for each in ("ae", "skel_enc")}
        save(folder / "models" / name / "200", networks)
        np.savez(
            folder / f"{statistics}.npz",
            **{kind: oracle[f"{name}/norm/{kind}"] for kind in ("mean", "std")},
            parents=oracle[f"{name}/structure/parents"],
        )
    return folder
