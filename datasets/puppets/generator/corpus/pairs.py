"""Exact pairs to train on: performances that many training bodies do.

A performance is solved when one of its pairs is first asked for, and kept in the cache folder; its file is
mapped into memory, so that reading any pairs in any order takes no more than the two motions.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from retarget_bench.api import Contacts, Performed
from retarget_bench.files import cache_folder, slug
from retarget_bench.training.stored_pairs import Facts, StoredPairs, Tensors, stored, unit

from ..conventions import FPS
from ..randomness import Stream
from .clip_solver import ClipSolver, own_rests, self_touches
from .clips import SIZES, Clip
from .families import bodies_of, families, family_of_structure, kinds_of

TROUPE = 8
"""Bodies that do one performance."""
SECONDS = (2.0, 4.0)
_UNPAIRED = ("stairs_up",)
"""Kinds that are done on other than flat ground."""


class Pairs(StoredPairs):
    """Every ordered pair of different bodies of every performance."""

    def __init__(self, solver: ClipSolver, size: str, seed: int) -> None:
        super().__init__(SIZES[size].pairs, TROUPE)
        self._solver, self._size, self._seed = solver, size, seed
        self._everybody = {family.name: list(bodies_of(family, "train")) for family in families()}
        for name, body in solver.drawn.items():
            self._everybody[family_of_structure(body.structure.name).name].append(name)
        kinds = (kind for family in families() for kind in kinds_of(family, "train"))
        self._kinds = [kind for kind in kinds if kind not in _UNPAIRED]

    def clip(self, number: int) -> Clip:
        """The performance of a number."""
        kind = self._kinds[number % len(self._kinds)]
        name = f"{kind}-pair-{SIZES[self._size].numbers[2] + number:05d}"
        length = Stream("puppets", self._seed, name, "length").uniform(*SECONDS)
        return Clip(name, kind, round(length * FPS), self._seed)

    def troupe(self, number: int) -> tuple[str, ...]:
        """The bodies of a performance: any of its family, all as likely as each other."""
        clip = self.clip(number)
        free = list(self._everybody[clip.family.name])
        stream = Stream("puppets", self._seed, clip.name, "troupe")
        return tuple(free.pop(int(stream.uniform(0.0, len(free)))) for _ in range(min(TROUPE, len(free))))

    def performance(self, number: int) -> _Performance:
        clip, solver = self.clip(number), self._solver
        corpus = f"{solver.identity}{solver.drawn_identity}, {len(solver.drawn)} drawn, pairs {self._size}"
        path = cache_folder() / "puppets" / slug(corpus) / f"{slug(clip.name)}.safetensors"
        return _Performance(solver, clip, stored(path, lambda: self._solved(clip, self.troupe(number))))

    def _solved(self, clip: Clip, names: Sequence[str]) -> tuple[Tensors, Facts]:
        rests = own_rests(self._solver.score(clip))
        tensors: Tensors = {}
        able = []
        for name in names:
            arrays = self._solver.solved(clip, name)
            if not float(arrays.pop("short")):
                able.append(name)
                arrays["root"] = arrays["root"].astype(np.float32)
                tensors |= {f"{name} {key}": array for key, array in arrays.items()}
        rested = [f"{side} {place}" for side, place in rests]
        tensors |= {f"rests {place}": rests[key] for place, key in zip(rested, rests, strict=True)}
        return tensors, {"able": json.dumps(able), "rests": json.dumps(rested)}


class _Performance:
    """One performance by the bodies that are able to do it."""

    exact = True

    def __init__(self, solver: ClipSolver, clip: Clip, tensors: Any) -> None:
        self._solver, self.clip, self.kind, self._tensors = solver, clip.name, clip.kind, tensors
        facts = tensors.metadata()
        self.able: Sequence[str] = json.loads(facts["able"])
        rested = [place.split(" ", 1) for place in json.loads(facts["rests"])]
        self._rests = {(side, place): tensors.get_tensor(f"rests {side} {place}") for side, place in rested}

    def of(self, name: str) -> Performed:
        get, body = self._tensors.get_tensor, self._solver.bodies[name]
        motion = self._solver.cast[name].motion(unit(get(f"{name} rotations")), get(f"{name} root"), FPS)
        contacts = Contacts(body.structure.labelled, get(f"{name} planted"), get(f"{name} pivoting"))
        return Performed(motion, contacts, self_touches(self._rests, body))
