"""Weights as files: ``NAME.safetensors`` and the card ``NAME.json``, which says where they come from.

Tensors of many numbers are kept in half precision, others (biases, statistics) as they are.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from retarget_bench.errors import BenchError, FileError
from retarget_bench.plugins.spec import Scalar, Spec
from retarget_bench.training import tensor_files as files

if TYPE_CHECKING:
    from torch import Tensor, nn

SCHEMA = 1
LARGEST = 12_000_000
"""Bytes that a shipped file may have."""
FEW = 4096
"""Numbers that a tensor may have to be kept in single precision."""
BEST = "weights"
"""The name of the best weights in a folder of ``bench train``."""
NEEDED = ("method", "version", "facts")

Text = Annotated[str, Field(description="a text")]
WholeNumber = Annotated[int, Field(description="a whole number")]
Scores = Annotated[dict[str, dict[str, float]], Field(description="numbers by split and name")]


class _Fields(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow")


class _Data(_Fields):
    hours: float = 0.0


class _Validation(_Fields):
    step: int
    scores: dict[str, Annotated[dict[str, float], Field(min_length=1)]] = Field(min_length=1)


class _Card(_Fields):
    """The fields of a card; a description ends the sentence "its NAME has to be".

    method, version, facts: what the weights fit: the method's version, and ``Trainable.facts()``.
    data:         what they were trained on: ``spec``, ``label``, ``content``, ``hours``.
    init:         hash of the weights that training began with.
    losses:       term -> mean over the last steps. validation: also the ``seconds`` of each.
    scores:       those of the weights kept, measured with the method as ``scored_as`` spells it.
    training_manifest: ``characters``, ``structures``, ``kinds`` and/or ``clips`` that training had.
    """

    hash: Text
    method: Text
    version: Text
    facts: dict[str, Scalar] = Field(description="parameters by name")
    data: _Data = Field(_Data(), description="facts by name, hours a number")
    recipe: dict[str, Scalar | dict[str, Scalar] | None] = Field({}, description="values by name")
    preset: Text = ""
    command: Text = ""
    seed: WholeNumber = 0
    steps: WholeNumber = 0
    step: WholeNumber = 0
    seconds: float = Field(0.0, description="a number")
    hardware: Text = ""
    torch: Text = ""
    processes: WholeNumber = 1
    init: str | None = Field(None, description="a text or null")
    losses: dict[str, float] = Field({}, description="numbers by name")
    validation: list[_Validation] = Field(
        [], description="a list, each with a step and with scores by split and name"
    )
    scores: Scores = {}
    scored_as: Text = ""
    training_manifest: dict[str, list[Scalar]] = Field({}, description="lists of names")
    notes: list[str] = Field([], description="a list of sentences")


@dataclass(frozen=True, eq=False)
class Bundle:
    """tensors: name -> tensor on the CPU, floats in single precision. card: plain data, see ``_Card``."""

    tensors: Mapping[str, Tensor]
    card: Mapping[str, Any]

    @property
    def hash(self) -> str:
        """Sixteen hex digits of the tensors as the file has them: the identity of the weights in
        results."""
        return str(self.card["hash"])


def write(
    folder: Path,
    name: str,
    tensors: Mapping[str, Tensor],
    card: Mapping[str, Any],
    exact: Collection[str] = (),
) -> Bundle:
    """Both files; the bundle as reading gives it (rounded to half precision).

    exact: names of tensors that are kept in single precision however many numbers they have.
    Raises BenchError for tensors that are not finite, FileError where the files cannot be written.
    """
    arrays = {key: _stored(key, tensor, key in exact) for key, tensor in tensors.items()}
    full_card = files.write(folder / name, arrays, {key: card[key] for key in NEEDED} | dict(card), SCHEMA)
    return Bundle({key: _tensor(array) for key, array in arrays.items()}, full_card)


def locate(path: str | Path) -> Path:
    """The card of weights given by card, by file of tensors, or by a folder of ``bench train``.

    Raises FileError where there is none.
    """
    path = Path(path).expanduser()
    file, card = files.pair(path / BEST if path.is_dir() else path)
    if not card.exists():
        if file.exists():
            raise FileError(file, f"lies without its card {card.name}")
        raise FileError(
            path,
            "there are no weights of this name; give a folder of bench train, a card (.json) or a file of "
            "tensors (.safetensors); bench info METHOD says whether it reads its authors' files, too",
        )
    return card


def read_card(path: str | Path) -> Mapping[str, Any]:
    """The card alone, which is quick, its known fields of their types. Raises FileError."""
    place = locate(path)
    card = files.read_card(place, SCHEMA, NEEDED, "weights of a method")
    try:
        _Card.model_validate(card)
    except ValidationError as error:
        name = str(error.errors()[0]["loc"][0])
        expected = _Card.model_fields[name].description
        raise FileError(place, f"is damaged: its {name} has to be {expected}") from None
    return card


def read(
    path: str | Path,
    *,
    method: str = "",
    version: str = "",
    facts: Mapping[str, Scalar] | None = None,
) -> Bundle:
    """Weights, verified; for a method, its version and its parameters where these are given.

    Raises FileError where the files are damaged or do not belong together, BenchError where the weights
    are another method's, another version's, or made with other parameters.
    """
    card = read_card(path)
    check(path, card, method=method, version=version, facts=facts)
    arrays = files.read_arrays(locate(path), card)
    return Bundle({key: _tensor(array) for key, array in arrays.items()}, card)


def check(
    path: str | Path,
    card: Mapping[str, Any],
    *,
    method: str = "",
    version: str = "",
    facts: Mapping[str, Scalar] | None = None,
) -> None:
    """Raises BenchError where weights do not fit the request, with weights that would."""
    if method and card["method"] != method:
        raise BenchError(f"{path}: these are weights of {card['method']}, not of {method}")
    if version and card["version"] != version:
        raise BenchError(
            f"{path}: these weights were trained with version {card['version']} of {card['method']}, and "
            f"this is version {version}; train them anew"
        )
    if facts is None or dict(facts) == card["facts"]:
        return
    trained_with: Mapping[str, Scalar] = card["facts"]
    if unknown := sorted(set(facts) ^ set(trained_with)):
        raise BenchError(
            f"{path}: these weights are of another form of {card['method']}: one of the two lacks "
            f"{', '.join(unknown)}; train them anew"
        )
    other = Spec(
        str(card["method"]),
        {key: trained_with[key] for key in trained_with if trained_with[key] != facts[key]},
    )
    inside = str(other).partition("[")[2].removesuffix("]")
    raise BenchError(
        f"{path}: these weights were trained as {other}; write {inside} in the brackets of "
        f"{card['method']}, or train others"
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
