"""Lists of people and dogs that go the same ways, for methods between two and four legs.

There are no pairs between them: nobody can say what a dog's trot is as a jog. Such methods are trained on
both without pairs and judged by distributions, so what both do should be alike in kind, speed and
heading, and no kind should outweigh another. The two performances of a match form no case.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal, overload

import numpy as np

from ...contract import Clips, Training
from ..conventions import FPS
from ..performances.dogs.following import PARTNERS, follow, speeds
from ..performances.score import Score
from ..randomness import Stream
from .clip_solver import ClipSolver
from .clips import SIZES, Clip
from .families import Family, bodies_of, families

LOCOMOTION: Mapping[str, tuple[str, ...]] = {
    "idle": ("stand",),
    "walk": ("walk", "arc", "march", "sneak"),
    "jog": ("jog",),
    "run": ("run",),
}
"""Ways of locomotion that are matched, equally often and long, and a person's kinds of each."""

_NUMBERS = {"tiny": {"train": 6, "test": 4}, "default": {"train": 40, "test": 15}}
_NUMBERS["large"] = {"train": 400, "test": _NUMBERS["default"]["test"]}
_NUMBERS["kinds"] = _NUMBERS["tiny"]
"""Matches of each locomotion for a pair of structures; ``large`` is tested as ``default`` is."""

Pair = tuple[str, str]
"""Structure on two legs, structure on four."""
Performance = tuple[Clip, str]
"""A clip and the body that performs it."""


@dataclass(frozen=True)
class Follower(Clip):
    """A dog's clip that goes the way of a person's."""

    leader: Clip

    def score(self) -> Score:
        return follow(Stream("puppets", self.seed, self.name), self.leader.score())


@dataclass(frozen=True)
class Match:
    """locomotion: idle, walk, jog or run."""

    locomotion: str
    biped: Performance
    dog: Performance


@dataclass(frozen=True, eq=False)
class LocomotionLabels:
    """Labels of every frame ``(frames,)``: kind; speed forward, leg lengths a second; heading, radians from
    +Z to the left. Of a match's two clips only the kinds differ."""

    kind: np.ndarray
    speed: np.ndarray
    heading: np.ndarray


def locomotion_labels(clip: Clip) -> LocomotionLabels:
    """The labels of a clip of either family."""
    score = clip.score()
    kinds = np.concatenate([np.full(act.end - act.first, act.kind) for act in score.stretches()])
    return LocomotionLabels(kinds, speeds(score), np.array(score.heading))


class Matches(Sequence[Match]):
    """The matches of a pair of structures, in a fixed order."""

    def __init__(self, solver: ClipSolver, listed: Sequence[Match]) -> None:
        self._solver, self._listed = solver, tuple(listed)

    def __len__(self) -> int:
        return len(self._listed)

    @overload
    def __getitem__(self, index: int) -> Match: ...
    @overload
    def __getitem__(self, index: slice) -> Matches: ...
    def __getitem__(self, index: int | slice) -> Match | Matches:
        if isinstance(index, slice):
            return Matches(self._solver, self._listed[index])
        return self._listed[index]

    def clips(self) -> Training:
        """Structure -> character -> its clips, with no trace of who follows whom."""
        by_structure: dict[str, dict[str, list[Clip]]] = {}
        for match in self:
            for clip, body in (match.biped, match.dog):
                structure = clip.family.bodies[body].structure.name
                by_structure.setdefault(structure, {}).setdefault(body, []).append(clip)
        return {
            structure: {body: Clips(body, listed, self._solver.motion) for body, listed in each.items()}
            for structure, each in by_structure.items()
        }


def matched(
    solver: ClipSolver, size: str, seed: int, part: Literal["train", "test"]
) -> Mapping[Pair, Matches]:
    """Pair of structures -> its matches."""
    return {pair: Matches(solver, listed) for pair, listed in _listed(size, seed, part).items()}


@cache
def _listed(size: str, seed: int, part: Literal["train", "test"]) -> Mapping[Pair, tuple[Match, ...]]:
    people, dogs = families()
    followers = _by_structure(dogs, part)
    return {
        (two, four): _matches(names, others, size, seed, part)
        for two, names in _by_structure(people, part).items()
        for four, others in followers.items()
    }


def _by_structure(family: Family, part: Literal["train", "test"]) -> Mapping[str, list[str]]:
    by_structure: dict[str, list[str]] = {}
    for name in bodies_of(family, part):
        by_structure.setdefault(family.bodies[name].structure.name, []).append(name)
    return by_structure


def _matches(
    people: Sequence[str], dogs: Sequence[str], size: str, seed: int, part: Literal["train", "test"]
) -> tuple[Match, ...]:
    """Bodies and dogs take turns with ever other partners; the four of one number last equally long."""
    make = SIZES["default" if part == "test" and size == "large" else size]
    seconds = make.training_seconds if part == "train" else make.seconds
    used: Counter[tuple[str, ...]] = Counter()
    matches = []
    for number in range(_NUMBERS[size][part]):
        length = Stream("puppets", seed, "matched", part, make.numbers[2] + number).uniform(*seconds)
        for locomotion, kinds in LOCOMOTION.items():
            body = _least(people, used, locomotion)
            dog = _least(dogs, used, locomotion, body)
            kind = kinds[number % len(kinds)]
            name = f"{kind}-{body}-led-{part}-{make.numbers[2] + number:04d}"
            leader, partner = Clip(name, kind, round(length * FPS), seed), PARTNERS[kind]
            follower = Follower(f"{partner}-{dog}-after-{name}", partner, leader.frames, seed, leader)
            matches.append(Match(locomotion, (leader, body), (follower, dog)))
    return tuple(matches)


def _least(names: Sequence[str], used: Counter[tuple[str, ...]], *with_whom: str) -> str:
    """The name with the fewest turns so far, then the fewest with each of ``with_whom``; then the first."""
    chosen = min(names, key=lambda name: (used[name,], *(used[name, each] for each in with_whom)))
    used.update([(chosen,), *((chosen, each) for each in with_whom)])
    return chosen
