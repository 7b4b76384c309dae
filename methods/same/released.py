"""The authors' released weights: a folder with ``last_model.pt`` and ``ms_dict.pt``.

They are under CC BY-NC 4.0 and not shipped. Nothing that such files hold is executed.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from retarget_bench.errors import FileError
from retarget_bench.training import torch_files
from retarget_bench.training.authors import AuthorsWeights

MODEL, STATISTICS = "last_model.pt", "ms_dict.pt"
_NAME = re.compile(r"(encoder|decoder)\.0\.(?:de)?convs\.(\d)\.(.+)")
_PARTS = {"lin_src.weight": "linear.weight", "att_dst": "asking", "att_src": "asked", "bias": "bias"}
"""Parameter of a layer there -> here; ``lin_dst`` is ``lin_src`` once more."""
_KINDS = {"shape": ("lo", "go"), "pose": ("q", "p", "r", "pv", "qv", "pprev")}


def at(path: Path) -> AuthorsWeights | None:
    """The weights in a folder, or beside one of the files; None where neither of them is there.

    Raises FileError where one is missing."""
    folder = path.parent if path.name in (MODEL, STATISTICS) else path
    files = folder / MODEL, folder / STATISTICS
    missing = [file.name for file in files if not file.is_file()]
    if len(missing) == len(files):
        return None
    if missing:
        raise FileError(folder, f"lacks {missing[0]}; SAME needs both {MODEL} and {STATISTICS}")
    return AuthorsWeights(folder, files, lambda: read(*files), "the authors' weights, under CC BY-NC 4.0")


def read(model: Path, statistics: Path) -> dict[str, Tensor]:
    """Parameters and statistics by our names. Raises FileError where a file is not SAME's."""
    network = torch_files.read(model).get("model")
    if not isinstance(network, Mapping):
        raise FileError(model, "holds no network of SAME's")
    tensors: dict[str, Tensor] = {}
    for name, tensor in network.items():
        if (match := _NAME.fullmatch(str(name))) and match[3] in _PARTS:
            values = torch_files.real(tensor, str(name), model)
            tensors[f"{match[1]}.{match[2]}.{_PARTS[match[3]]}"] = values.squeeze(0)
    return tensors | _statistics(statistics)


def _statistics(path: Path) -> dict[str, Tensor]:
    content = torch_files.read(path)
    statistics: dict[str, Tensor] = {}
    for short, name in (("m", "mean"), ("s", "deviation")):
        for kind, parts in _KINDS.items():
            keys = [f"{part}_{short}" for part in parts]
            if missing := [key for key in keys if not isinstance(content.get(key), Tensor)]:
                raise FileError(path, f"lacks SAME's statistics {', '.join(missing)}")
            values = [torch_files.real(content[key], key, path).reshape(-1) for key in keys]
            statistics[f"scale.{kind}_{name}"] = torch.cat(values)
    # contacts are seen as they are
    for name, value in (("mean", 0.0), ("deviation", 1.0)):
        key = f"scale.pose_{name}"
        statistics[key] = torch.cat([statistics[key], torch.tensor([value])])
    return statistics
