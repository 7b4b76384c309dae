"""The authors' released weights: a folder with ``last_model.pt`` and ``ms_dict.pt``.

They are under CC BY-NC 4.0 and not shipped. Nothing that such files hold is executed.
"""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import torch
from torch import Tensor

from retarget_bench.errors import FileError
from retarget_bench.training import torch_files

MODEL, STATISTICS = "last_model.pt", "ms_dict.pt"
_NAME = re.compile(r"(encoder|decoder)\.0\.(?:de)?convs\.(\d)\.(.+)")
_PARTS = {"lin_src.weight": "linear.weight", "att_dst": "asking", "att_src": "asked", "bias": "bias"}
"""Parameter of a layer there -> here; ``lin_dst`` is ``lin_src`` once more."""
_KINDS = {"shape": ("lo", "go"), "pose": ("q", "p", "r", "pv", "qv", "pprev")}


@dataclass(frozen=True)
class Released:
    """folder: that holds the files."""

    folder: Path

    @classmethod
    def at(cls, path: Path) -> "Released | None":
        """The weights in a folder, or beside one of the files; None where neither of them is there."""
        folder = path.parent if path.name in (MODEL, STATISTICS) else path
        return cls(folder) if any((folder / name).is_file() for name in (MODEL, STATISTICS)) else None

    @cached_property
    def hash(self) -> str:
        """Sixteen hex digits of both files. Raises FileError where one is missing."""
        digest = hashlib.sha256()
        for name in (MODEL, STATISTICS):
            try:
                digest.update(hashlib.sha256((self.folder / name).read_bytes()).digest())
            except OSError as error:
                raise FileError(
                    self.folder, f"{name} cannot be read; SAME needs both {MODEL} and {STATISTICS}"
                ) from error
        return digest.hexdigest()[:16]

    def tensors(self) -> Mapping[str, Tensor]:
        """Parameters and statistics by our names. Raises FileError where a file is not SAME's."""
        path = self.folder / MODEL
        model = torch_files.read(path).get("model")
        if not isinstance(model, Mapping):
            raise FileError(path, "holds no network of SAME's")
        tensors: dict[str, Tensor] = {}
        for name, tensor in model.items():
            if (match := _NAME.fullmatch(str(name))) and match[3] in _PARTS:
                values = torch_files.real(tensor, str(name), path)
                tensors[f"{match[1]}.{match[2]}.{_PARTS[match[3]]}"] = values.squeeze(0)
        return tensors | self._statistics()

    def _statistics(self) -> dict[str, Tensor]:
        path = self.folder / STATISTICS
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
