"""Clips solved for bodies when they are first asked for, and kept."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.api import Contacts
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion

from . import rigs
from .bodies import Body
from .cache import Arrays, kept
from .casting import everybody
from .clips import Clip
from .families import Family
from .score import Score

USUAL, SECOND = "usual", "second"
"""Manners: the reference's, and that of the other right answer."""

_HELD = 48


def _score(clip: Clip) -> Score:
    return clip.score()


class Studio:
    """The bodies as characters, and what they perform.

    identity: of everything that decides a motion beside the clip's and the body's names.
    """

    def __init__(self, identity: str) -> None:
        self.identity = identity
        self._arrays = lru_cache(maxsize=_HELD)(self._kept)
        # whatever kind of clip it is
        self.score = lru_cache(maxsize=8)(_score)

    @cached_property
    def families(self) -> Mapping[str, Family]:
        """Body -> its family."""
        return everybody()

    @cached_property
    def cast(self) -> dict[str, Character]:
        return {name: rigs.character(family.bodies[name]) for name, family in self.families.items()}

    def motion(self, clip: Clip, name: str, manner: str = USUAL) -> Motion:
        arrays = self._arrays(clip, name, manner)
        return rigs.motion(arrays["rotations"], arrays["root"], self.cast[name])

    def contacts(self, clip: Clip, name: str) -> Contacts:
        arrays = self._arrays(clip, name, USUAL)
        roles = rigs.contact_roles(self.families[name].bodies[name])
        return Contacts(roles, arrays["planted"], arrays["pivoting"])

    def _kept(self, clip: Clip, name: str, manner: str) -> Arrays:
        arrays = kept(
            f"{self.identity}, {clip.name}",
            f"{name}-{manner}",
            frozenset(("rotations", "root", "planted", "pivoting")),
            lambda: self._solved(clip, name, manner),
        )
        # rotations are stored in single precision: a motion is off by less than a micrometre
        local = arrays["rotations"].astype(np.float64)
        local /= np.sqrt((local * local).sum(axis=-1, keepdims=True))
        return {**arrays, "rotations": local}

    def _solved(self, clip: Clip, name: str, manner: str) -> Arrays:
        family = self.families[name]
        body: Body = family.bodies[name]
        manners = {USUAL: (), SECOND: (family.second,)}
        solution = family.solve(self.score(clip), body, *manners[manner])
        pivoting = np.zeros_like(solution.planted) if solution.pivoting is None else solution.pivoting
        columns = list(body.structure.contacts)
        return {
            "rotations": rigs.rotations(solution, body, self.cast[name]).astype(np.float32),
            "root": solution.root,
            "planted": solution.planted[:, columns],
            "pivoting": pivoting[:, columns],
        }
