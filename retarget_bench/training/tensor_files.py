"""A file of named arrays and the card beside it: safetensors and JSON, never pickle.

The card holds the hash of the arrays. So a file that was damaged or exchanged is noticed, and a card alone
says what its arrays are, without their being read.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.errors import FileError
from retarget_bench.files import atomic, read_json

Arrays = Mapping[str, np.ndarray]
LARGEST_CARD = 20_000_000
"""Bytes of a card."""


def arrays_hash(arrays: Arrays) -> str:
    """Sixteen hex digits of names, types and numbers."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name], order="C")
        total.update(f"{name} {array.dtype.str} {array.shape}\n".encode() + array.tobytes())
    return total.hexdigest()[:16]


def pair(path: Path) -> tuple[Path, Path]:
    """Arrays and card of either of the two, or of their common name."""
    stem = path.with_suffix("") if path.suffix in (".safetensors", ".json") else path
    return stem.with_name(f"{stem.name}.safetensors"), stem.with_name(f"{stem.name}.json")


def write(path: Path, arrays: Arrays, card: Mapping[str, Any], schema: int) -> dict[str, Any]:
    """Both files, each atomically, the card last; the card as it was written.

    Raises FileError where they cannot be written: what was there before is then intact.
    """
    from safetensors.numpy import save

    file, facts = pair(path)
    full_card = {"schema": schema, "hash": arrays_hash(arrays), **card}
    text = json.dumps(full_card, indent=1, ensure_ascii=False) + "\n"
    # both are complete before either is renamed; the inner one, the arrays, is renamed first
    with atomic(facts) as new_facts, atomic(file) as new_file:
        # not save_file, which makes files that nobody else may read
        new_file.write_bytes(save({name: np.asarray(each, order="C") for name, each in arrays.items()}))
        new_facts.write_text(text, encoding="utf-8", newline="\n")
    return full_card


def read_card(path: Path, schema: int, needed: tuple[str, ...], what: str) -> dict[str, Any]:
    """A card; ``what``: whose it should be (``a feature network``), ``needed``: required entries.

    Raises FileError where it is none, or from a newer version.
    """
    _, facts = pair(path)
    try:
        card = read_json(facts, LARGEST_CARD)
        version = card["schema"]
        missing = [key for key in ("hash", *needed) if key not in card]
    except FileError as error:
        raise FileError(facts, f"is not the card of {what}: it {error.problem}") from error
    except (KeyError, TypeError) as error:
        raise FileError(facts, f"is not the card of {what} ({error})") from error
    if not isinstance(version, int) or version > schema:
        raise FileError(facts, f"has schema {version}; this version reads up to {schema}")
    if missing:
        raise FileError(facts, f"is not the card of {what} (it lacks {', '.join(missing)})")
    return dict(card)


def read_arrays(path: Path, card: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The arrays that a card describes. Raises FileError where they are damaged, others or not finite."""
    from safetensors import SafetensorError
    from safetensors.numpy import load_file

    file, facts = pair(path)
    try:
        if not file.is_file():
            raise OSError("it is no file")
        arrays = load_file(file)
    except (OSError, SafetensorError) as error:
        raise FileError(file, f"cannot be read ({error}); train it anew") from error
    except (KeyError, TypeError, AttributeError, ValueError) as error:  # of types that numpy lacks
        raise FileError(file, f"holds numbers of a type that cannot be read ({error})") from error
    if arrays_hash(arrays) != card["hash"]:
        raise FileError(file, f"is not what {facts.name} describes; train it anew")
    for name, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise FileError(file, f"{name} is of type {array.dtype}; weights are real numbers")
        with np.errstate(over="ignore"):  # single precision is what they are used in
            finite = np.isfinite(array.astype(np.float32)).all()
        if not finite:
            raise FileError(file, f"{name} has numbers that are not finite; train it anew")
    return dict(arrays)


def verify(path: Path, card: Mapping[str, Any]) -> None:
    """Compare the arrays with what their card says, once for each state of their file. Raises FileError."""
    file, _ = pair(path)
    try:
        state = file.stat()
    except OSError as error:
        raise FileError(file, f"cannot be read ({error.strerror}); train it anew") from error
    _verified(file, str(card["hash"]), state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=128)
def _verified(file: Path, written: str, _changed: int, _size: int) -> None:
    read_arrays(file, {"hash": written})
