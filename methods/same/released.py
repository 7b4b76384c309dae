"""The authors' released weights: a folder with ``last_model.pt`` and ``ms_dict.pt``.

They are under CC BY-NC 4.0 and not shipped. Nothing that such files hold is executed.
"""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from retarget_bench.errors import FileError

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
    def at(cls, folder: Path) -> "Released | None":
        """The weights in a folder; None where neither of the files is there."""
        return cls(folder) if any((folder / name).is_file() for name in (MODEL, STATISTICS)) else None

    @cached_property
    def hash(self) -> str:
        """Sixteen hex digits of both files. Raises FileError where one is missing."""
        found = hashlib.sha256()
        for name in (MODEL, STATISTICS):
            try:
                found.update(hashlib.sha256((self.folder / name).read_bytes()).digest())
            except OSError as error:
                raise FileError(
                    self.folder, f"{name} cannot be read; SAME needs both {MODEL} and {STATISTICS}"
                ) from error
        return found.hexdigest()[:16]

    def tensors(self) -> Mapping[str, Tensor]:
        """Parameters and statistics by our names. Raises FileError where a file is not SAME's."""
        model = self._read(MODEL).get("model")
        if not isinstance(model, Mapping):
            raise FileError(self.folder / MODEL, "holds no network of SAME's")
        found: dict[str, Tensor] = {}
        for name, tensor in model.items():
            if (known := _NAME.fullmatch(str(name))) and known[3] in _PARTS:
                found[f"{known[1]}.{known[2]}.{_PARTS[known[3]]}"] = tensor.float().squeeze(0)
        return found | self._statistics()

    def _statistics(self) -> dict[str, Tensor]:
        kept = self._read(STATISTICS)
        found: dict[str, Tensor] = {}
        for short, name in (("m", "mean"), ("s", "deviation")):
            for kind, parts in _KINDS.items():
                keys = [f"{part}_{short}" for part in parts]
                if missing := [key for key in keys if not isinstance(kept.get(key), Tensor)]:
                    raise FileError(
                        self.folder / STATISTICS, f"lacks SAME's statistics {', '.join(missing)}"
                    )
                found[f"scale.{kind}_{name}"] = torch.cat([kept[key].float() for key in keys])
        # contacts are seen as they are
        for name, value in (("mean", 0.0), ("deviation", 1.0)):
            key = f"scale.pose_{name}"
            found[key] = torch.cat([found[key], torch.tensor([value])])
        return found

    def _read(self, name: str) -> Mapping[str, Any]:
        path = self.folder / name
        try:
            found = torch.load(path, map_location="cpu", weights_only=True)
        except OSError as error:
            raise FileError(path, f"cannot be read ({error.strerror})") from error
        except Exception as error:  # torch says in many ways that it cannot read a file
            raise FileError(path, "is damaged, or holds more than tensors and plain values") from error
        if not isinstance(found, Mapping):
            raise FileError(path, "is not what SAME's code writes under this name")
        return found
