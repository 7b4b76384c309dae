"""Pairs to train on, kept on disk: one file of named tensors for each performance by several bodies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol, overload

import numpy as np

from retarget_bench.api import Performed, TrainingPair
from retarget_bench.errors import FileError
from retarget_bench.files import atomic

_OPEN = 64
"""So many performances a process keeps mapped into memory."""
_NAME = "file"
"""Of the metadata: what it is of, since a file is mapped and not read as a whole."""
Tensors = dict[str, np.ndarray]
Facts = dict[str, str]


class Performance(Protocol):
    """able: names of the bodies that perform it. exact: see ``TrainingPair``."""

    clip: str
    kind: str
    exact: bool
    able: Sequence[str]

    def of(self, name: str) -> Performed: ...


class StoredPairs(Sequence[TrainingPair], ABC):
    """Every ordered pair of different bodies of every performance.

    performances: how many there are. troupe: the bodies that are asked for each. Where one of the two
    bodies of a pair is unable the next performs; where fewer than two are able, the next performance.
    """

    def __init__(self, performances: int, troupe: int) -> None:
        self._performances, self._troupe = performances, troupe
        self._numbers = range(performances * self.together)
        self._performance = lru_cache(maxsize=_OPEN)(self.performance)

    @abstractmethod
    def performance(self, number: int) -> Performance:
        """Read, or made and kept."""

    @property
    def together(self) -> int:
        return self._troupe * (self._troupe - 1)

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> TrainingPair: ...
    @overload
    def __getitem__(self, index: slice) -> list[TrainingPair]: ...
    def __getitem__(self, index: int | slice) -> TrainingPair | list[TrainingPair]:
        numbers = self._numbers[index]
        return [self._pair(each) for each in numbers] if isinstance(numbers, range) else self._pair(numbers)

    def _pair(self, index: int) -> TrainingPair:
        number, place = divmod(index, self.together)
        for later in range(self._performances):
            performance = self._performance((number + later) % self._performances)
            able = performance.able
            if len(able) > 1:
                first, second = divmod(place, self._troupe - 1)
                source = first % len(able)
                target = (source + 1 + second % (len(able) - 1)) % len(able)
                both = performance.of(able[source]), performance.of(able[target])
                return TrainingPair(performance.clip, performance.kind, *both, exact=performance.exact)
        raise IndexError("no performance is done by two bodies")


def stored(path: Path, make: Callable[[], tuple[Tensors, Facts]]) -> Any:
    """A file of tensors, mapped into memory (``get_tensor``, ``get_slice``, ``metadata``): as it is there,
    or made; anew where it is cut or another's, by its metadata. Where it cannot be written its tensors stay
    in memory."""
    try:
        return _mapped(path)
    except (OSError, ValueError):
        tensors, facts = make()
    try:
        _write(path, tensors, facts | {_NAME: _name(path)})
        return _mapped(path)
    except (FileError, OSError, ValueError):
        return _Held(tensors, facts)


def _name(path: Path) -> str:
    """The content of the file, wherever the cache lies."""
    return f"{path.parent.name}/{path.name}"


class _Held:
    """Tensors in memory, read like those of a file."""

    def __init__(self, tensors: Mapping[str, np.ndarray], facts: Facts) -> None:
        self.get_tensor = self.get_slice = tensors.__getitem__
        self.metadata = lambda: facts


def _mapped(path: Path) -> Any:
    from safetensors import SafetensorError, safe_open

    try:
        file: Any = safe_open(path, framework="numpy")
    except SafetensorError as error:
        raise ValueError(str(error)) from error
    if (file.metadata() or {}).get(_NAME) != _name(path):
        raise ValueError(f"{path} is the file of something else")
    return file


def _write(path: Path, tensors: Mapping[str, np.ndarray], facts: Facts) -> None:
    """Raises FileError."""
    from safetensors.numpy import save

    with atomic(path) as temporary:
        temporary.write_bytes(
            save({k: np.ascontiguousarray(a) for k, a in tensors.items()}, metadata=facts)
        )


def unit(rotations: np.ndarray) -> np.ndarray:
    """Quaternions that were kept in single precision, of length one in double precision."""
    values = np.asarray(rotations, dtype=np.float64)
    return np.asarray(values / np.sqrt((values * values).sum(axis=-1, keepdims=True)))
