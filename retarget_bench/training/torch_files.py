"""Tensors that other programs saved with torch or numpy. Nothing in their files is run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
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


def array(path: Path, name: str = "") -> Tensor:
    """The numbers of a ``.npy`` file, or of an array in a ``.npz``, in one row, in single precision.

    Raises FileError where it cannot be read or holds other than finite numbers."""
    try:
        content = np.load(path, allow_pickle=False)
        values = (content[name] if name else content).reshape(-1).astype(np.float32)
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror or error})") from error
    except (ValueError, EOFError, KeyError, AttributeError, BadZipFile) as error:
        raise FileError(path, "holds no array of real numbers as numpy saves it") from error
    return real(torch.from_numpy(values), name or "the array", path)
