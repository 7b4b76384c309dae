"""Skeletons as SAN's networks see them: edges, which of them are near each other, and how they are pooled.

An edge leads from a joint to one that hangs from it; that of the child c is c - 1. Slots are the edges and,
last, the root's movement (Aberman et al., Skeleton-Aware Networks, SIGGRAPH 2020).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Self

import numpy as np

from retarget_bench.motion.roles import body_part
from retarget_bench.training.layers.skeletal.layout import Layout

Neighbours = Literal["fixed", "released"]
Slots = tuple[tuple[int, ...], ...]
OUTSIDE = -1
"""The joint that the root's slot comes from, if it is taken for an edge that leads to the root."""


@dataclass(frozen=True)
class Edges:
    """A tree as edges (from joint, to joint), parents before children; joint 0 is the root."""

    pairs: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, parents: Sequence[int]) -> Self:
        """parents: of the joints, the root's first, whatever it is."""
        return cls(tuple((parent, joint) for joint, parent in enumerate(parents) if joint))

    @property
    def slots(self) -> int:
        return len(self.pairs) + 1

    def neighbours(self, distance: int, rule: Neighbours) -> Slots:
        """The slots that each slot sees, itself included: those at most ``distance`` away. Edges that share
        a joint are at distance 1.

        rule: ``fixed`` takes the root's slot for an edge that ends at the root joint. ``released``: as in
        the authors' code, which calls it a bug (issue 30 of its repository), the root's slot sees what the
        first edge sees and is seen by these, but does not see itself.
        """
        if rule == "fixed":
            sees = _within((*self.pairs, (OUTSIDE, 0)), distance)
        else:
            sees = np.pad(_within(self.pairs, distance), (0, 1))
            sees[-1], sees[:, -1] = sees[0], sees[0]
        return tuple(tuple(np.flatnonzero(row).tolist()) for row in sees)

    @cached_property
    def chains(self) -> Slots:
        """The edges between two joints at which the tree begins, forks or ends, from the root outwards."""
        leaving: dict[int, list[int]] = {}
        for edge, (joint, _) in enumerate(self.pairs):
            leaving.setdefault(joint, []).append(edge)
        chains: list[tuple[int, ...]] = []
        waiting: list[tuple[int, tuple[int, ...]]] = [(0, ())]
        while waiting:
            joint, chain = waiting.pop()
            onwards = leaving.get(joint, [])
            if chain and len(onwards) != 1:
                chains.append(chain)
                chain = ()
            waiting += [(self.pairs[edge][1], (*chain, edge)) for edge in reversed(onwards)]
        return tuple(chains)

    def pooled(self, entire: bool = False) -> tuple[Slots, Edges]:
        """The slots that become one, and the tree that is left (skeletal pooling).

        Along a chain these are pairs of edges; of an odd number the first stays alone. entire: each chain
        becomes one edge. The root's slot stays.
        """
        groups: list[tuple[int, ...]] = []
        for chain in self.chains:
            odd = len(chain) if entire else len(chain) % 2
            groups += [chain[:odd]] * bool(odd)
            groups += [chain[first : first + 2] for first in range(odd, len(chain), 2)]
        left = Edges(tuple((self.pairs[group[0]][0], self.pairs[group[-1]][1]) for group in groups))
        return (*groups, (len(self.pairs),)), left


def _within(pairs: Sequence[tuple[int, int]], distance: int) -> np.ndarray:
    """``(edges, edges)`` bool."""
    share = np.array([[bool({*one} & {*other}) for other in pairs] for one in pairs])
    return np.asarray(np.linalg.matrix_power(share.astype(np.int64), distance) > 0)


def layout_of(parents: Sequence[int], roles: Sequence[str | None]) -> Layout:
    """A tree as a layout whose parts are its chains.

    A chain is named after the body parts in which the body ends below it: the spine is
    ``head+left_arm+right_arm``. So chains of two structures correspond in whatever order files have them.
    """
    edges = Edges.of(parents)
    ends: dict[int, set[str]] = {}
    for joint in sorted(set(range(len(parents))) - set(parents), reverse=True):
        above, label = joint, _label(joint, parents, roles)
        while above >= 0:
            ends.setdefault(above, set()).add(label)
            above = parents[above] if above else -1
    counts: Counter[str] = Counter()
    names = []
    for chain in edges.chains:
        name = "+".join(sorted(ends[edges.pairs[chain[-1]][1]]))
        counts[name] += 1
        names.append(name if counts[name] == 1 else f"{name}_{counts[name]}")
    return Layout((-1, *parents[1:]), tuple(roles), tuple(names), edges.chains)


def _label(joint: int, parents: Sequence[int], roles: Sequence[str | None]) -> str:
    """The body part of a joint, or of the first above it that has a role; else the joint's number."""
    above = joint
    while above > 0:
        if role := roles[above]:
            return body_part(role)
        above = parents[above]
    return f"end {joint}"


@dataclass(frozen=True)
class Levels:
    """A tree, what it becomes by pooling pairs, and the groups of both poolings.

    first: pooling of the tree's slots. pairs, chains: poolings of what is then left, by pairs (as in
    discriminators) and of whole chains (as in encoders). neighbours: of the slots of both trees.
    """

    first: Slots
    pairs: Slots
    chains: Slots
    neighbours: tuple[Slots, Slots]

    @classmethod
    def of(cls, parents: Sequence[int], distance: int, rule: Neighbours) -> Self:
        edges = Edges.of(parents)
        first, left = edges.pooled()
        sees = edges.neighbours(distance, rule), left.neighbours(distance, rule)
        return cls(first, left.pooled()[0], left.pooled(entire=True)[0], sees)
