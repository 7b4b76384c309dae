"""Lists of clips for every size and part, and the bodies that are left out of a clip.

A body may be too short in the arm, or too thick, to put a hand where a performance wants it. Finding that
out takes solving, which is too slow for listing cases; so what was found for the published corpus is kept
in ``exclusions.json``. Whoever changes the generator runs ``tests/datasets/freeze_puppets.py``.
"""

import json
import multiprocessing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from ..conventions import FPS
from ..performances.score import Score
from ..randomness import Stream
from ..solver.reach import out_of_reach
from ..solver.solve import solve
from .families import Family, Part, bodies_of, families, family_of, family_of_structure, kinds_of

LONG = 60.0
"""Seconds of the long clips of the test, which are sequences of several kinds."""


@dataclass(frozen=True)
class Size:
    """seconds: shortest and longest ordinary clip. test: clips of the test; 0: of each kind one, or more
    while there is a case of each split for every clip. long: how many of them last a minute. cases,
    validation: the most cases of each split. troupe: how many bodies of a family perform one clip; 0: any.
    training: clips of each body. pairs: performances by many training bodies. numbers: the first of test,
    validation and training, so that a name stands for one clip only. group: clips of every kind but
    sequences, all by one pair of bodies in each split; 0: the numbers above hold."""

    seconds: tuple[float, float]
    training_seconds: tuple[float, float]
    test: int
    long: int
    cases: Mapping[str, int]
    validation: Mapping[str, int]
    troupe: int
    training: int
    pairs: int
    numbers: tuple[int, int, int]
    group: int = 0


_TINY = Size(
    seconds=(2.0, 4.0),
    training_seconds=(2.0, 4.0),
    test=0,
    long=0,
    cases={"self": 46, "intra": 52, "cross": 52},
    validation={"self": 42, "intra": 42, "cross": 42},
    troupe=0,
    training=4,
    pairs=40,
    numbers=(1, 51, 1),
)
_DEFAULT = Size(
    seconds=(3.0, 8.0),
    training_seconds=(3.0, 8.0),
    test=106,
    long=8,
    cases={"self": 420, "intra": 780, "cross": 780},
    validation={"self": 50, "intra": 100, "cross": 100},
    troupe=12,
    training=40,
    pairs=400,
    numbers=(101, 301, 1001),
)
_LARGE = replace(
    _DEFAULT,
    training_seconds=(4.0, 16.0),
    training=400,
    pairs=4000,
    numbers=(*_DEFAULT.numbers[:2], 10001),
)
_KINDS = replace(_TINY, numbers=(501, 601, _TINY.numbers[2]), group=4)
SIZES = {"tiny": _TINY, "default": _DEFAULT, "large": _LARGE, "kinds": _KINDS}
"""``large`` is tested on what ``default`` is tested on; only what there is to train on is more. ``kinds``
has the training of ``tiny``."""


@dataclass(frozen=True)
class Clip:
    """One performance: ``name`` also names its random numbers."""

    name: str
    kind: str
    frames: int
    seed: int

    @property
    def family(self) -> Family:
        return family_of(self.kind)

    @property
    def long(self) -> bool:
        return self.frames >= LONG * FPS

    def score(self) -> Score:
        return self.family.kinds[self.kind](Stream("puppets", self.seed, self.name), self.frames)


@cache
def clips(size: str, seed: int, part: Part = "test") -> tuple[Clip, ...]:
    """The clips of test or validation, kind by kind; the long ones first of theirs."""
    make = SIZES[size]
    first = make.numbers[0 if part == "test" else 1]
    listed = []
    for kind, (ordinary, long) in _counts(size, part).items():
        for number in range(long + ordinary):
            name = f"{kind}-{first + number:03d}"
            length = LONG if number < long else _length(name, seed, make.seconds)
            listed.append(Clip(name, kind, round(length * FPS), seed))
    return tuple(listed)


@cache
def training_clips(size: str, body: str, seed: int, drawn: int = 0) -> tuple[Clip, ...]:
    """Clips that one body alone performs for training: all kinds in turn.

    drawn: the number of bodies that train beside the cast's, among whom the clips are shared out.
    """
    make = SIZES[size]
    structure, place = _listed_at(body)
    family = family_of_structure(structure)
    offered = kinds_of(family, "train")
    cast = sum(len(bodies_of(each, "train")) for each in families())
    number = make.training if not drawn else max(-(-cast * make.training // (cast + drawn)), 2)
    listed = []
    for each in range(number):
        kind = offered[(7 * place + each) % len(offered)]
        name = f"{kind}-{body}-{make.numbers[2] + each:04d}"
        listed.append(Clip(name, kind, round(_length(name, seed, make.training_seconds) * FPS), seed))
    return tuple(listed)


def _listed_at(body: str) -> tuple[str, int]:
    """Structure of a training body, and its place among the bodies of its family, or among those drawn."""
    for family in families():
        if body in family.bodies:
            return family.bodies[body].structure.name, bodies_of(family, "validation").index(body)
    structure, place = body.rsplit("_", 1)
    return structure, int(place)


def _length(name: str, seed: int, seconds: tuple[float, float]) -> float:
    return Stream("puppets", seed, name, "length").uniform(*seconds)


def _counts(size: str, part: Part) -> dict[str, tuple[int, int]]:
    """Kind -> how many ordinary and how many long clips. Where the clips do not go round evenly the first
    kinds have one more."""
    make = SIZES[size]
    long: dict[str, int] = {}
    offered = [kind for family in families() for kind in kinds_of(family, part)]
    if make.group:
        strung = {family.sequence for family in families()}
        return {kind: (make.group, 0) for kind in offered if kind not in strung}
    if part != "test":
        return dict.fromkeys(offered, (1, 0))
    if not make.test:
        return dict.fromkeys(offered, (max(make.cases["intra"] // len(offered), 1), 0))
    for family in families():
        if family.sequence in family.kinds:
            share = make.long if not long else max(make.long // 4, 1)
            long[family.sequence] = share
    each, more = divmod(make.test - sum(long.values()), len(offered))
    return {kind: (each + (rank < more), long.get(kind, 0)) for rank, kind in enumerate(offered)}


EXCLUSIONS = Path(__file__).with_name("exclusions.json")


def unable(clip: Clip, names: tuple[str, ...]) -> Mapping[str, float]:
    """Body -> metres by which it falls short, of those among ``names`` that cannot do the clip."""
    if clip.seed == 0:
        return {name: gap for name, gap in _published().get(clip.name, {}).items() if name in names}
    return shortfalls(clip, names)


@cache
def shortfalls(clip: Clip, names: tuple[str, ...]) -> Mapping[str, float]:
    """Shortfalls found by solving the clip for these bodies: body -> metres."""
    score = clip.score()
    if score.stairs is None and not any(hand.touches or hand.contacts for hand in score.hands.values()):
        return {}
    short = {}
    for name in names:
        body = clip.family.bodies[name]
        if gaps := out_of_reach(score, body, solve(score, body)):
            short[name] = max(gaps.values())
    return short


@cache
def _published() -> Mapping[str, Mapping[str, float]]:
    table: Mapping[str, Mapping[str, float]] = json.loads(EXCLUSIONS.read_text(encoding="utf-8"))
    return table


def published_clips() -> Iterator[tuple[Clip, tuple[str, ...]]]:
    """Every clip of the published corpus, with the bodies that might perform it."""
    for size in ("tiny", "default", "kinds"):
        for part in ("test", "validation"):
            for clip in clips(size, 0, part):
                yield clip, bodies_of(clip.family, part)
    for size in SIZES:
        for family in families():
            for body in bodies_of(family, "train"):
                for clip in training_clips(size, body, 0):
                    yield clip, (body,)


def write_exclusions(processes: int = 2) -> None:
    """Find out anew who cannot do what in the published corpus."""
    jobs = list(published_clips())
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        outcomes = pool.starmap(shortfalls, jobs, chunksize=50)
    table = {clip.name: short for (clip, _), short in zip(jobs, outcomes, strict=True) if short}
    rounded = {
        clip: {name: round(gap, 3) for name, gap in sorted(short.items())}
        for clip, short in sorted(table.items())
    }
    rows = ",\n".join(f"  {json.dumps(clip)}: {json.dumps(short)}" for clip, short in rounded.items())
    EXCLUSIONS.write_text(f"{{\n{rows}\n}}\n" if rows else "{}\n", encoding="utf-8")
