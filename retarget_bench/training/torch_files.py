"""Tensors that other programs saved with torch. Nothing in their files is run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from retarget_bench.errors import FileError


def read(path: Path) -> Mapping[str, Any]:
    """The named tensors and plain values of a file that ``torch.save`` wrote.

    Raises FileError where it cannot be read, or holds something else.
    """
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    except Exception as error:  # torch says in many ways that it cannot read a file
        raise FileError(
            path, "cannot be read: it is damaged, or holds more than tensors and plain values"
        ) from error
    if not isinstance(content, Mapping) or not all(isinstance(name, str) for name in content):
        raise FileError(path, "holds something else than named tensors")
    return content


def real(value: object, name: str, path: Path) -> Tensor:
    """The tensor in single precision. Raises FileError unless it is one of finite real numbers."""
    if not isinstance(value, Tensor) or value.is_complex() or value.layout != torch.strided:
        raise FileError(path, f"{name} is no tensor of real numbers")
    tensor = value.float()
    if not torch.isfinite(tensor).all():
        raise FileError(path, f"{name} has numbers that are not finite")
    return tensor
