"""The authors' weights: their ``.pt`` file and the statistics that their code reads from other files.

https://github.com/Kebii/R2ET keeps them as ``pretrain/skeleton_aware_pre.pt`` and
``datasets/mixamo/stats/mixamo_*.npy``.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from torch import Tensor

from retarget_bench.errors import FileError
from retarget_bench.training import torch_files
from retarget_bench.training.authors import AuthorsWeights

STATISTICS = {
    "positions_mean": "mixamo_local_motion_mean.npy",
    "positions_deviation": "mixamo_local_motion_std.npy",
    "rotations_mean": "mixamo_quat_mean.npy",
    "rotations_deviation": "mixamo_quat_std.npy",
}
PLACES = (".", "stats", "../datasets/mixamo/stats")
"""Where they are looked for, from the folder of the ``.pt`` file; the last is the repository's."""
NOTE = "Weights of the authors, trained on Mixamo; what of it they have seen is not told."
_PREFIX, _UNUSED = "module.", "delta_dec.pos_encoder.pe"
_ENCODER = {
    "token_linear": "enter",
    "trans1.layers.0.0.to_qkv": "qkv",
    "trans1.layers.0.0.nn1": "out",
    "trans1.layers.0.1.fn.norm": "norm",
    "trans1.layers.0.1.fn.fn.nn1": "feed.0",
    "trans1.layers.0.1.fn.fn.nn2": "feed.1",
}
_MODULES = {
    **{f"delta_dec.q_encoder.{released}": f"motion.{own}" for released, own in _ENCODER.items()},
    **{f"delta_dec.skel_encoder.{released}": f"body.{own}" for released, own in _ENCODER.items()},
    "delta_dec.embed_linear": "join",
    "delta_dec.delta_linear": "change",
}


def at(path: Path) -> AuthorsWeights | None:
    """The weights of a ``.pt`` file and the statistics near it; None for a path of another suffix.

    Raises FileError where a file is missing."""
    if path.suffix != ".pt":
        return None
    statistics = _statistics(path)
    return AuthorsWeights(path, (path, *statistics.values()), lambda: read(path, statistics), NOTE)


def read(path: Path, statistics: Mapping[str, Path]) -> dict[str, Tensor]:
    """The tensors of ``SkeletonAwareNetwork``. statistics: their names -> files.

    Raises FileError where a file is not what it should be.
    """
    tensors = renamed(torch_files.read(path), path)
    for name, file in statistics.items():
        tensors[f"scale.{name}"] = torch_files.array(file)
    still = tensors["scale.positions_deviation"] == 0
    tensors["scale.positions_deviation"][still] = 1.0
    return tensors


def renamed(weights: Mapping[str, Any], path: Path) -> dict[str, Tensor]:
    """Tensors of the authors' names under ours. Raises FileError where a name is not one of theirs, or is
    not of a tensor of finite real numbers."""
    tensors: dict[str, Tensor] = {}
    for name, tensor in weights.items():
        module, _, kind = name.removeprefix(_PREFIX).rpartition(".")
        if f"{module}.{kind}" == _UNUSED:
            continue
        if module not in _MODULES:
            raise FileError(path, f"holds {name}, so it is not R2ET's skeleton-aware network")
        tensors[f"{_MODULES[module]}.{kind}"] = torch_files.real(tensor, name, path)
    return tensors


def _statistics(path: Path) -> dict[str, Path]:
    if not path.is_file():
        raise FileError(path, "there is no such file; give the authors' skeleton_aware_pre.pt")
    for place in PLACES:
        files = {name: path.parent / place / file for name, file in STATISTICS.items()}
        if all(file.is_file() for file in files.values()):
            return files
    raise FileError(
        path,
        f"lacks the statistics of its training motions; put {', '.join(STATISTICS.values())} beside it, or "
        "leave both where the authors' repository has them",
    )
