"""Exact pairs to train on: performances that many training bodies do, one file each.

A performance is solved when one of its pairs is first asked for, and kept in the cache folder; its file is
mapped into memory, so that reading any pairs in any order takes no more than the two motions.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, overload

import numpy as np

from retarget_bench.api import Contacts, Performed, TrainingPair
from retarget_bench.errors import FileError
from retarget_bench.files import atomic, cache_folder, slug

from ..conventions import FPS
from ..randomness import Stream
from .clips import SIZES, Clip
from .families import bodies_of, families, kinds_of
from .studio import Studio, hand_rests, self_touches

TROUPE = 8
"""Bodies that do one performance."""
SECONDS = (2.0, 4.0)
_UNPAIRED = ("stairs_up",)
"""Kinds that are done on other than flat ground."""
_OPEN = 64
"""So many files a process keeps mapped."""


class Pairs(Sequence[TrainingPair]):
    """Every ordered pair of different bodies of every performance."""

    together = TROUPE * (TROUPE - 1)

    def __init__(self, studio: Studio, size: str, seed: int) -> None:
        self._studio, self._size, self._seed = studio, size, seed
        self._numbers = range(SIZES[size].pairs * self.together)
        self._everybody = {
            family.name: (
                *bodies_of(family, "train"),
                *(
                    n
                    for n, b in studio.drawn.items()
                    if (b.structure.name == "dog21") == (family.name == "dogs")
                ),
            )
            for family in families()
        }
        kinds = (kind for family in families() for kind in kinds_of(family, "train"))
        self._kinds = [kind for kind in kinds if kind not in _UNPAIRED]
        self._performance = lru_cache(maxsize=_OPEN)(self._opened)

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> TrainingPair: ...
    @overload
    def __getitem__(self, index: slice) -> list[TrainingPair]: ...
    def __getitem__(self, index: int | slice) -> TrainingPair | list[TrainingPair]:
        numbers = self._numbers[index]
        return (
            [self._pair(number) for number in numbers]
            if isinstance(numbers, range)
            else self._pair(numbers)
        )

    def clip(self, number: int) -> Clip:
        """The performance of a number."""
        kind = self._kinds[number % len(self._kinds)]
        name = f"{kind}-pair-{SIZES[self._size].numbers[2] + number:05d}"
        length = Stream("puppets", self._seed, name, "length").uniform(*SECONDS)
        return Clip(name, kind, round(length * FPS), self._seed)

    def troupe(self, number: int) -> tuple[str, ...]:
        """The bodies that are asked for a performance: any of its family, all as likely as each other."""
        clip = self.clip(number)
        free = list(self._everybody[clip.family.name])
        stream = Stream("puppets", self._seed, clip.name, "troupe")
        return tuple(free.pop(int(stream.uniform(0.0, len(free)))) for _ in range(min(TROUPE, len(free))))

    def _pair(self, index: int) -> TrainingPair:
        """Where one of the two bodies cannot do it, the next does; where fewer than two can, the next
        performance is taken."""
        number, place = divmod(index, self.together)
        for later in range(len(self._numbers)):
            performance = self._performance((number + later) % SIZES[self._size].pairs)
            able = performance.able
            if len(able) > 1:
                first, second = divmod(place, TROUPE - 1)
                source = first % len(able)
                target = (source + 1 + second % (len(able) - 1)) % len(able)
                return TrainingPair(
                    performance.clip.name,
                    performance.clip.kind,
                    performance.of(able[source]),
                    performance.of(able[target]),
                )
        raise AssertionError("no performance can be done by two bodies")

    def _opened(self, number: int) -> _Performance:
        clip, names = self.clip(number), self.troupe(number)
        studio = self._studio
        corpus = f"{studio.identity}{studio.drawn_identity}, {len(studio.drawn)} drawn, pairs {self._size}"
        path = cache_folder() / "puppets" / slug(corpus) / f"{slug(clip.name)}.safetensors"
        try:
            return _Performance(studio, clip, _mapped(path))
        except (OSError, ValueError, KeyError):
            tensors, facts = self._solved(clip, names)
        try:
            _write(path, tensors, facts)
            return _Performance(studio, clip, _mapped(path))
        except (FileError, OSError, ValueError, KeyError):
            return _Performance(studio, clip, _Held(tensors, facts))

    def _solved(self, clip: Clip, names: Sequence[str]) -> tuple[dict[str, np.ndarray], dict[str, str]]:
        rests = hand_rests(self._studio.score(clip))
        tensors: dict[str, np.ndarray] = {}
        able = []
        for name in names:
            arrays = self._studio.solved(clip, name)
            if not float(arrays.pop("short")):
                able.append(name)
                arrays["root"] = arrays["root"].astype(np.float32)
                tensors |= {f"{name} {key}": array for key, array in arrays.items()}
        told = [f"{side} {place}" for side, place in rests]
        tensors |= {f"rests {place}": rests[key] for place, key in zip(told, rests, strict=True)}
        return tensors, {"able": json.dumps(able), "rests": json.dumps(told)}


class _Held:
    """Tensors in memory, where the cache folder cannot be written."""

    def __init__(self, tensors: Mapping[str, np.ndarray], facts: Mapping[str, str]) -> None:
        self.get_tensor, self.metadata = tensors.__getitem__, lambda: facts


class _Performance:
    """One performance by the bodies that are able to do it."""

    def __init__(self, studio: Studio, clip: Clip, stored: Any) -> None:
        self._studio, self.clip, self._stored = studio, clip, stored
        facts = stored.metadata()
        self.able: Sequence[str] = json.loads(facts["able"])
        told = [place.split(" ", 1) for place in json.loads(facts["rests"])]
        self._rests = {(side, place): stored.get_tensor(f"rests {side} {place}") for side, place in told}

    def of(self, name: str) -> Performed:
        get, body = self._stored.get_tensor, self._studio.bodies[name]
        rotations = get(f"{name} rotations").astype(np.float64)
        rotations /= np.sqrt((rotations * rotations).sum(axis=-1, keepdims=True))
        motion = self._studio.cast[name].motion(rotations, get(f"{name} root"), FPS)
        contacts = Contacts(body.structure.labelled, get(f"{name} planted"), get(f"{name} pivoting"))
        return Performed(motion, contacts, self_touches(self._rests, body))


def _mapped(path: Path) -> Any:
    from safetensors import SafetensorError, safe_open

    try:
        return safe_open(path, framework="numpy")
    except SafetensorError as error:
        raise ValueError(str(error)) from error


def _write(path: Path, tensors: Mapping[str, np.ndarray], facts: dict[str, str]) -> None:
    """Raises FileError."""
    from safetensors.numpy import save

    with atomic(path) as temporary:
        temporary.write_bytes(
            save({k: np.ascontiguousarray(a) for k, a in tensors.items()}, metadata=facts)
        )
