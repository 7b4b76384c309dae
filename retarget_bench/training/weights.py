"""Weights as files: ``NAME.safetensors`` and the card ``NAME.json``, which says where they come from.

Tensors of many numbers are kept in half precision, others (biases, statistics) as they are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins.spec import Scalar, Spec
from retarget_bench.training import tensor_files as files
from retarget_bench.training.record import Record

if TYPE_CHECKING:
    from torch import Tensor, nn

LARGEST = 12_000_000
"""Bytes that a shipped file may have."""
FEW = 4096
"""Numbers that a tensor may have to be kept in single precision."""
RUN = "run.json"
"""The record of a run, in its folder."""
BEST = "weights"
"""The name of the best weights in a folder of ``bench train``."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """tensors: name -> tensor on the CPU, floats in single precision."""

    tensors: Mapping[str, Tensor]
    card: Record

    @property
    def hash(self) -> str:
        """Sixteen hex digits of the tensors as the file has them: the identity of the weights in
        results."""
        return self.card.hash


def write(
    folder: Path,
    name: str,
    tensors: Mapping[str, Tensor],
    card: Record,
    exact: Collection[str] = (),
) -> Bundle:
    """Both files; the bundle as reading gives it (rounded to half precision).

    exact: names of tensors that are kept in single precision however many numbers they have.
    Raises BenchError for tensors that are not finite, FileError where the files cannot be written.
    """
    arrays = {key: _stored(key, tensor, key in exact) for key, tensor in tensors.items()}
    full_card = files.write(folder / f"{name}.json", card, arrays)
    return Bundle({key: _tensor(array) for key, array in arrays.items()}, full_card)


def locate(path: str | Path) -> Path:
    """The card of weights given by card, by file of tensors, or by a folder of ``bench train``.

    Raises FileError where there is none.
    """
    path = Path(path).expanduser()
    path = path.parent if path.name == RUN else path
    named = path / BEST if path.is_dir() else path
    stem = named.with_suffix("") if named.suffix in (".safetensors", ".json") else named
    card = stem.with_name(f"{stem.name}.json")
    if not card.exists():
        if (file := files.arrays_of(card)).exists():
            raise FileError(file, f"lies without its card {card.name}")
        raise FileError(
            path,
            "there are no weights of this name; give a folder of bench train, a card (.json) or a file of "
            "tensors (.safetensors); bench info METHOD says whether it reads its authors' files, too",
        )
    return card


def read_card(path: str | Path) -> Record:
    """The card alone, which is quick. Raises FileError."""
    return files.read_record(locate(path), Record, "the card of weights of a method")


def read(path: str | Path) -> Bundle:
    """Weights, verified. Raises FileError where the files are damaged or do not belong together."""
    card = read_card(path)
    arrays = files.read_weights(locate(path), card.hash)
    return Bundle({key: _tensor(array) for key, array in arrays.items()}, card)


def check(
    path: str | Path,
    card: Record,
    method: str,
    version: str = "",
    facts: Mapping[str, Scalar] | None = None,
) -> None:
    """Raises BenchError where weights are another method's, another version's, or made with other
    parameters, with those that would fit. version, facts: where they are to be those."""
    if card.method != method:
        raise BenchError(f"{path}: these are weights of {card.method}, not of {method}")
    if version and card.version != version:
        raise BenchError(
            f"{path}: these weights were trained with version {card.version} of {card.method}, and "
            f"this is version {version}; train them anew"
        )
    if facts is None or dict(facts) == card.facts:
        return
    trained_with = card.facts
    if unknown := sorted(set(facts) ^ set(trained_with)):
        raise BenchError(
            f"{path}: these weights are of another form of {card.method}: one of the two lacks "
            f"{', '.join(unknown)}; train them anew"
        )
    other = Spec(
        card.method,
        {key: trained_with[key] for key in trained_with if trained_with[key] != facts[key]},
    )
    inside = str(other).partition("[")[2].removesuffix("]")
    raise BenchError(
        f"{path}: these weights were trained as {other}; write {inside} in the brackets of "
        f"{card.method}, or train others"
    )


def fill(module: nn.Module, tensors: Mapping[str, Tensor], where: str = "weights") -> None:
    """Put tensors into the parameters and buffers of the same names.

    Raises BenchError unless names and shapes are all the same; the module is then as it was.
    """
    expected = module.state_dict()
    if odd := sorted(set(expected) ^ set(tensors)):
        lacking = odd[0] in expected
        raise BenchError(
            f"{where}: {len(odd)} tensors are not those of the network: {odd[0]} is "
            f"{'missing' if lacking else 'not known to it'}; they are of another structure"
        )
    for name, tensor in tensors.items():
        if tensor.shape != expected[name].shape:
            raise BenchError(
                f"{where}: {name} has shape {tuple(tensor.shape)}, the network's has "
                f"{tuple(expected[name].shape)}; they are of another structure"
            )
    module.load_state_dict(dict(tensors))


def _stored(name: str, tensor: Tensor, exact: bool) -> np.ndarray:
    array = tensor.detach().cpu().numpy()
    if not np.issubdtype(array.dtype, np.floating):
        return np.asarray(array)
    array = array.astype(np.float32)
    if not np.isfinite(array).all():
        raise BenchError(f"{name} is not finite: these weights are not written; training has diverged")
    if exact or array.size <= FEW or np.abs(array).max() > np.finfo(np.float16).max:
        return array
    return array.astype(np.float16)


def _tensor(array: np.ndarray) -> Tensor:
    import torch

    floating = np.issubdtype(array.dtype, np.floating)
    return torch.from_numpy(np.array(array, dtype=np.float32 if floating else array.dtype))
