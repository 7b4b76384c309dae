"""Shipped comparisons: where a method is known to be worse than the default one.

``methods/known.csv`` holds comparisons of ``bench compare``, people only. A comparison counts for the
versions and the weights that it was made with. ``methods/known_bodies.csv`` holds how the bodies of the
default data set are built, so that they are recognised without it. ``benchmarks/learned_methods.py``
writes both.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np

import retarget_bench
from retarget_bench import defaults
from retarget_bench.api import CROSS, INTRA, SELF
from retarget_bench.api.datasets import usual_split
from retarget_bench.motion.character import Character
from retarget_bench.motion.role_aliases import strip_prefix
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store

GENERATED, REAL = "generated bodies", "real rigs"
JOINTS = {SELF: ", each to itself", INTRA: " with the same joints", CROSS: " with other joints"}
PROPORTIONS = 1e-3
"""Bones whose shares in the length of all bones differ by less are as long."""


@dataclass(frozen=True)
class Comparison:
    """A method and the default one on one split of a data set, as a row of the file: texts.

    bodies: ``GENERATED`` or ``REAL``. method: its spec without ``weights``, which their hash stands for.
    mean, default_mean: MPJPE in % of height; low, high: 95 % interval of their difference.
    better: which of the two is significantly better; "": neither.
    """

    method: str
    version: str
    weights: str
    default: str
    default_version: str
    bodies: str
    split: str
    dataset: str
    cases: str
    clips: str
    mean: str
    default_mean: str
    low: str
    high: str
    p: str
    better: str

    @property
    def sentence(self) -> str:
        mean, default, p = (float(each) for each in (self.mean, self.default_mean, self.p))
        chance = "< 0.001" if p < 0.001 else f"= {p:.2g}"
        return (
            f"{self.method} is worse than {self.default}, the default, on {self.bodies}"
            f"{JOINTS[self.split]}: MPJPE {mean:.2f} against {default:.2f} % of height "
            f"({self.cases} cases of {self.clips} clips of {self.dataset}, p {chance})"
        )


FIELDS = tuple(each.name for each in fields(Comparison))


@dataclass(frozen=True)
class Build:
    """The proportions of a body, without its unit. topology: of its skeleton. shares: of its bones in the
    length of all, in the order of the joints."""

    topology: str
    shares: tuple[float, ...]

    @classmethod
    def of(cls, body: Character) -> Build:
        lengths = body.skeleton.bone_lengths
        return cls(body.skeleton.topology_id, tuple((lengths / lengths.sum()).tolist()))

    def same_as(self, other: Build) -> bool:
        """True for bodies of the same joints, in the same order, and proportions."""
        if self.topology != other.topology:
            return False
        return bool(np.allclose(self.shares, other.shares, rtol=0, atol=PROPORTIONS))


BUILD_FIELDS = tuple(each.name for each in fields(Build))


def shipped(name: str = "known.csv") -> Path:
    """A file that came with this package: inside it, or beside it in a checkout."""
    places = [Path(base) / "methods" / name for base in retarget_bench.__path__]
    return next((place for place in places if place.exists()), places[-1])


def identity(spec: Spec | str) -> tuple[str, str, str]:
    """A method's spec without ``weights``, its version and the hash of its weights."""
    canonical = registry.canonical("methods", spec)
    method = registry.create("methods", canonical)
    others = {name: value for name, value in canonical.parameters.items() if name != "weights"}
    label = str(Spec(canonical.name, others, canonical.posts))
    return label, method.card.version, method.weights_hash


def worse(spec: Spec | str) -> list[Comparison]:
    """The comparisons, valid for both current versions, in which a method is worse than the default one."""
    own, default = identity(spec), identity(defaults.METHOD)[:2]
    rows = store.read_csv(shipped(), FIELDS) if shipped().exists() else []
    return [
        each
        for each in (Comparison(*row) for row in rows)
        if (each.method, each.version, each.weights) == own
        and (each.default, each.default_version) == default
        and each.better == each.default
    ]


def caution(spec: Spec | str, source: Character, target: Character) -> str:
    """The sentence that warns of a method on bodies like these; "" where nothing is known."""
    if source.four_legged or target.four_legged:
        return ""
    alike = _joints(source) == _joints(target)
    split = usual_split(alike and Build.of(source).same_as(Build.of(target)), alike)
    comparisons = [each for each in worse(spec) if each.split == split]
    bodies = GENERATED if comparisons and _generated(source) and _generated(target) else REAL
    return next((each.sentence for each in comparisons if each.bodies == bodies), "")


def _joints(body: Character) -> set[tuple[str, str]]:
    """Every joint's name, without prefixes, with its parent's."""
    names = [strip_prefix(name) for name in body.skeleton.names]
    return {
        (name, names[p] if p >= 0 else "") for name, p in zip(names, body.skeleton.parents, strict=True)
    }


def _generated(body: Character) -> bool:
    """True for a body of the default data set, as files of its motions have it, too."""
    return any(Build.of(body).same_as(each) for each in _builds())


@cache
def _builds() -> tuple[Build, ...]:
    rows = store.read_csv(shipped("known_bodies.csv"), BUILD_FIELDS)
    return tuple(Build(topology, tuple(map(float, shares.split()))) for topology, shares in rows)
