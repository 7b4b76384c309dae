"""Arms and legs in a tree of joints without names: pairs of like branches, and two long bones in each.

A limb's two long bones are about as long. Joints inside them (twist bones) do not fold; where no motion
shows that, because limbs are straight at rest, they divide the bone evenly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise, product
from typing import Literal

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.skeleton import Skeleton

Line = list[int]
"""Joints below each other."""
Pair = tuple[Line, Line]
"""Lines of as many joints on both sides, bone by bone about as long."""
Kind = Literal["arm", "leg"]

_ALIKE, _SLACK = 0.2, 0.01
"""Share by which the bones of a pair may differ in length, and of the longest way from the root."""
_UNLIKE = (3.0, 0.25)
"""Weights of differences between the bones of a pair, and between its longest ways down."""
_BRANCHES, _LONGEST = 16, 50
"""Branches from one joint, and joints of a line, that are compared."""
_ASIDE = (0.3, 0.1)
"""Sine by which a bone in the plane of symmetry may lean out of it, without a twin and with one."""
_INNER = 3
"""Most joints inside one long bone."""
_STRAIGHT = np.radians(15.0)
"""Radians that a joint inside a long bone may fold."""
_EVEN, _RATIO = 0.4, 0.3
"""Least ratio of the two long bones, and its power in what a limb scores."""
_SHOWN, _EVENLY, _BRANCHED = 0.95, 0.9, 0.6
"""Factors for a joint inside a long bone: where motion shows that it does not fold; where none does, times
how evenly it divides the bone; and where other joints hang from it."""
_FINGERS, _LAST = 1.3, 1.15
"""Factors for a limb that ends where it branches, and for an arm that ends with its line."""
_NO_COLLAR, _NONE_BUT_TWISTS, _DEEP = 0.85, 0.6, 0.7
"""Factors for an arm that begins its line, for one with joints inside besides, and for each bone but one
that it has above."""
_LATE = 0.6
"""Factor for a leg behind a bone that could be one of its long ones."""


@dataclass(frozen=True)
class Limb:
    """A pair of limbs: both lines, and where in these the first long bone starts, where the second one
    starts (elbows, knees) and where it ends (wrists, ankles).

    score:  metres of both bones, less for what speaks against it.
    margin: share by which it is better than the next best joints of the same lines.
    """

    lines: Pair
    start: int
    bend: int
    end: int
    score: float
    margin: float = 1.0

    @property
    def joints(self) -> Line:
        """All joints of both lines."""
        return [*self.lines[0], *self.lines[1]]


class Tree:
    """A skeleton in poses, with its pairs of like branches.

    places: ``(frames, joints, 3)`` of any poses. reach: ``(joints,)`` metres of the longest way down.
    """

    def __init__(self, skeleton: Skeleton, places: np.ndarray) -> None:
        self.skeleton, self.places = skeleton, places
        self.reach = np.zeros(len(skeleton))
        for joint in range(len(skeleton) - 1, 0, -1):
            parent = int(skeleton.parents[joint])
            self.reach[parent] = max(self.reach[parent], self.way(joint))
        self.pairs = [pair for joint in range(len(skeleton)) for pair in self._twins(joint)]
        self._paired = {line[0] for pair in self.pairs for line in pair}

    def way(self, joint: int) -> float:
        """Metres from a joint's parent to the farthest joint below it."""
        return float(self.skeleton.bone_lengths[joint] + self.reach[joint])

    def parent(self, pair: Pair) -> int:
        """The joint that both lines of a pair hang from."""
        return int(self.skeleton.parents[pair[0][0]])

    def single(self, joint: int) -> Line:
        """A joint and those below it, up to the first that has not one child alone."""
        line = [joint]
        while len(below := self.skeleton.children[line[-1]]) == 1:
            line.append(below[0])
        return line

    # ------------------------------------------------------------------------------------------- pairs
    def _twins(self, joint: int) -> Iterator[Pair]:
        """Pairs of like lines from a joint on, the longest and likest first, each child in one of them."""
        pairs = [self._down(a, b) for a, b in combinations(self._branches(joint), 2) if self._alike(a, b)]
        paired: set[int] = set()
        for left, right in sorted(pairs, key=self._likeness, reverse=True):
            if not paired.intersection((left[0], right[0])):
                paired |= {left[0], right[0]}
                yield left, right

    def _likeness(self, pair: Pair) -> float:
        """Metres of a pair's lines, less for differences of their bones and of what hangs from them."""
        lengths = self.skeleton.bone_lengths[np.array(pair)]
        ways = abs(self.way(pair[0][0]) - self.way(pair[1][0]))
        return float(
            lengths.min(axis=0).sum() - _UNLIKE[0] * np.ptp(lengths, axis=0).sum() - _UNLIKE[1] * ways
        )

    def _branches(self, joint: int) -> list[int]:
        """The children of a joint with the longest ways down, in joint order."""
        children = self.skeleton.children[joint]
        return sorted(sorted(children, key=self.way)[-_BRANCHES:])

    def _alike(self, a: int, b: int) -> bool:
        """Whether the bones that end in two joints are about as long."""
        lengths = self.skeleton.bone_lengths[[a, b]]
        return bool(np.ptp(lengths) <= _ALIKE * lengths.max() + _SLACK * self.reach[0])

    def _down(self, a: int, b: int) -> Pair:
        """The longest like lines from two joints on, without what one of them alone carries, as a prop."""
        lines: Pair = ([a], [b])
        while len(lines[0]) < _LONGEST:
            below = product(*(self._branches(line[-1]) for line in lines))
            both = [pair for pair in below if self._alike(*pair)]
            if not both:
                break
            ways = [(self.way(c), self.way(d)) for c, d in both]
            best = max(range(len(both)), key=lambda k: (min(ways[k]), -max(ways[k])))
            for line, joint in zip(lines, both[best], strict=True):
                line.append(joint)
        return lines

    def in_the_middle(self, joint: int, limb: Limb) -> bool:
        """Whether a joint lies in the plane that a pair of limbs is mirrored at, seen from its parent."""
        if joint in (limb.lines[0][0], limb.lines[1][0]):
            return False
        bone = self.places[:, joint] - self.places[:, int(self.skeleton.parents[joint])]
        aside = np.abs((bone * self.across(limb)).sum(axis=1)).mean()
        return bool(aside <= _ASIDE[joint in self._paired] * self.skeleton.bone_lengths[joint])

    def across(self, limb: Limb) -> np.ndarray:
        """``(frames, 3)`` unit vectors from the second limb of a pair to the first."""
        collar = self.collar(limb)
        return rotation.unit(self._apart(limb, limb.start if collar is None else collar))

    def collar(self, limb: Limb) -> int | None:
        """Where in the lines of a pair of limbs the first joint beside its twin is, above their start."""
        far = _SLACK * self.reach[0]
        gaps = (np.linalg.norm(self._apart(limb, k), axis=1).mean() for k in range(limb.start))
        return next((k for k, gap in enumerate(gaps) if gap > far), None)

    def _apart(self, limb: Limb, number: int) -> np.ndarray:
        first, second = (self.places[:, line[number]] for line in limb.lines)
        return first - second

    # ------------------------------------------------------------------------------------------- limbs
    def limb(self, pair: Pair, kind: Kind) -> Limb | None:
        """The pair as arms or legs; None where no two of its bones are even enough."""
        lengths = self.skeleton.bone_lengths[np.array(pair)].mean(axis=0)
        turns = [self._folds([self.parent(pair), *line])[:, 1:] for line in pair]
        folds, moves = np.max(turns, axis=(0, 1)), np.ptp(turns, axis=1).max(axis=0)
        children = np.array([[len(self.skeleton.children[joint]) for joint in line] for line in pair])
        shape = _Shape(lengths, folds, moves, children.min(axis=0) > 1)
        found = [(score, *each) for each in _triples(len(lengths)) if (score := shape.score(kind, *each))]
        if not found:
            return None
        best, *others = sorted(found, reverse=True)
        margin = 1.0 - others[0][0] / best[0] if others else 1.0
        return Limb(pair, *best[1:], score=best[0], margin=margin)

    def _folds(self, line: Line) -> np.ndarray:
        """``(frames, joints)`` radians by which a line turns at each joint; 0 at its ends."""
        bones = [rotation.unit(self.places[:, low] - self.places[:, high]) for high, low in pairwise(line)]
        none = np.zeros(len(self.places))
        turns = [
            np.arccos(np.clip((upper * lower).sum(axis=1), -1, 1)) if upper.any() and lower.any() else none
            for upper, lower in pairwise(bones)
        ]
        return np.stack([none, *turns, none], axis=1)


@dataclass(frozen=True)
class _Shape:
    """What a pair of lines looks like, joint by joint: metres of the bone that ends there, radians by which
    it folds there at most, and by which that changes; and whether both lines branch there."""

    lengths: np.ndarray
    folds: np.ndarray
    moves: np.ndarray
    branched: np.ndarray

    def score(self, kind: Kind, start: int, bend: int, end: int) -> float:
        """Metres of the two long bones of a limb, less for what speaks against it; 0 of what is none."""
        lengths = self.lengths
        inner = [*range(start + 1, bend), *range(bend + 1, end)]
        upper, lower = lengths[start + 1 : bend + 1].sum(), lengths[bend + 1 : end + 1].sum()
        ratio = min(upper, lower) / max(upper, lower, 1e-12)
        if ratio < _EVEN or any(self.folds[inner] > _STRAIGHT):
            return 0.0
        score = (upper + lower) * ratio**_RATIO * (_FINGERS if self.branched[end] else 1.0)
        for j in inner:
            even = min(lengths[j : j + 2]) / max(*lengths[j : j + 2], 1e-12)
            score *= _SHOWN if self.moves[bend] > _STRAIGHT else _EVENLY * even
            score *= _BRANCHED if self.branched[j] else 1.0
        if kind == "leg":
            return float(score * _LATE ** (lengths[1 : start + 1] > _EVEN * upper).sum())
        above = (lengths[1 : start + 1] > 0).sum()
        score *= _DEEP ** (above - 1) if above else _NONE_BUT_TWISTS if inner else _NO_COLLAR
        return float(score * (_LAST if end == len(lengths) - 1 else 1.0))


def _triples(joints: int) -> Iterator[tuple[int, int, int]]:
    """Where the long bones of a limb may start, meet and end."""
    for start in range(joints - 2):
        for bend in range(start + 1, min(start + 2 + _INNER, joints - 1)):
            for end in range(bend + 1, min(bend + 2 + _INNER, joints)):
                yield start, bend, end
