"""Clips solved for bodies on demand, with their labels, and the training set made of them."""

from collections.abc import Mapping
from functools import lru_cache, partial

import numpy as np

from retarget_bench.api import Contacts, Touch
from retarget_bench.errors import Unusable
from retarget_bench.motion.motion import Motion

from ...contract import USUAL, Cast, Clips, Labels, Manner, Surface, Training, Version, in_double
from ..bodies import rigs
from ..bodies.structures import Body
from ..cache import Arrays, cached
from ..conventions import FPS
from ..performances.natural import natural
from ..performances.score import Score
from ..randomness import Stream
from ..solver.hands import contact_rests
from ..solver.reach import out_of_reach
from ..solver.solve import solve
from ..solver.touch_points import touch_point, touching
from .clips import Clip, training_clips, unable
from .families import bodies_of, everybody, families


def labels(score: Score, contacts: Contacts) -> Labels:
    kind = np.concatenate([np.full(act.end - act.first, act.kind) for act in score.stretches()])
    return Labels(kind, np.asarray(score.phases(), dtype=np.float64), contacts, touches(score))


FLOOR, HELD = "floor", "held thing"
"""Places on which a hand rests that are none of the own body."""
Rests = Mapping[tuple[str, str], np.ndarray]
"""Side of a hand and place -> ``(frames,)`` bool: the hand rests there in full."""


def rests(score: Score) -> Rests:
    """Frames in which a hand rests, of places where one ever does."""
    rested: dict[tuple[str, str], np.ndarray] = {}
    for side, hand in score.hands.items():
        full = [(touch.place, touch.weight == 1.0) for touch in hand.touches]
        places = [(place, frames) for place, frames in full if frames.any()]
        for stay in hand.contacts:
            places.append((HELD if stay.level > 0.0 else FLOOR, contact_rests(stay, score.frames)))
        for place, frames in places:
            rested[side, place] = rested.get((side, place), False) | frames
    return rested


def touches(score: Score) -> dict[str, np.ndarray]:
    """The same by labels: "left hand on right_knee"."""
    return {f"{side} hand on {place}": frames for (side, place), frames in rests(score).items()}


def own_rests(score: Score) -> Rests:
    """Those on the own body."""
    return {
        (side, place): full for (side, place), full in rests(score).items() if place not in (FLOOR, HELD)
    }


def self_touches(rests: Rests, body: Body) -> tuple[Touch, ...]:
    """The same hands on places of a body, as touches of cases: those whose joints the rig has."""
    roles = dict(zip(body.structure.parts, body.structure.roles, strict=False))
    touches = []
    for (side, name), full in rests.items():
        spot, end = touch_point(name, body), roles.get(f"{side}_hand")
        bearing = roles.get(spot.part)
        if end and bearing:
            touches.append(Touch(end, touching(spot, side, body.proportions), bearing, spot.at, full))
    return tuple(touches)


_HELD = 64


def _score(version: Version, clip: Clip) -> Score:
    score = clip.score()
    if version == "1.0":
        return score
    return natural(score, Stream("puppets", clip.seed, clip.name, "natural"))


class ClipSolver:
    """The motions of bodies in clips, solved on demand and kept in a cache.

    identity: of everything that decides a motion beside the clip's and the body's names.
    drawn:    training bodies beside the cast's (``training_bodies.py``), and drawn_identity: of these.
    surface:  of all characters; it changes no motion.
    version:  of the performances.
    """

    def __init__(
        self,
        identity: str,
        drawn: Mapping[str, Body] | None = None,
        drawn_identity: str = "",
        surface: Surface = "bare",
        version: Version = "1.0",
    ) -> None:
        self.identity, self.drawn = identity, drawn or {}
        self.drawn_identity = drawn_identity
        self.bodies: Mapping[str, Body] = {**everybody(), **self.drawn}
        self.cast = Cast(self.bodies, lambda name: rigs.character(self.bodies[name], surface))
        self._arrays = lru_cache(maxsize=_HELD)(self._cached)
        # whatever kind of clip it is
        self.score = lru_cache(maxsize=_HELD)(partial(_score, version))

    def motion(self, clip: Clip, name: str, manner: Manner = USUAL) -> Motion:
        """Raises Unusable where a drawn body cannot do the clip."""
        arrays = self._arrays(clip, name, manner)
        if float(arrays.get("short", 0.0)):
            raise Unusable(clip.name, f"{name} cannot reach what it has to touch")
        return self.cast[name].motion(arrays["rotations"], arrays["root"], FPS)

    def contacts(self, clip: Clip, name: str) -> Contacts:
        arrays = self._arrays(clip, name, USUAL)
        return Contacts(self.bodies[name].structure.labelled, arrays["planted"], arrays["pivoting"])

    def _cached(self, clip: Clip, name: str, manner: Manner) -> Arrays:
        names, drawn = {"rotations", "root", "planted", "pivoting"}, name in self.drawn
        arrays = cached(
            f"{self.identity}{self.drawn_identity if drawn else ''}, {clip.name}",
            f"{name}-{manner}",
            frozenset(names | {"short"} if drawn else names),
            lambda: self.solved(clip, name, manner, measured=drawn),
        )
        return {**arrays, "rotations": in_double(arrays["rotations"])}

    def solved(
        self, clip: Clip, name: str, manner: Manner = USUAL, *, measured: bool = True
    ) -> dict[str, np.ndarray]:
        """The arrays of a motion, solved anew. measured: with ``short``, metres by which the body misses
        what it has to touch; the published corpus has a list of that."""
        body, score = self.bodies[name], self.score(clip)
        solution = solve(score, body, manner)
        columns = list(body.structure.contacts)
        arrays = {
            "rotations": rigs.rotations(solution.orientations, body, self.cast[name]).astype(np.float32),
            "root": solution.root,
            "planted": solution.planted[:, columns],
            "pivoting": solution.pivoting[:, columns],
        }
        if measured:
            gaps = out_of_reach(score, body, solution)
            arrays["short"] = np.array(max(gaps.values(), default=0.0))
        return arrays


def training(solver: ClipSolver, size: str, seed: int) -> Training:
    """Every training character with what it is able to do; held-out bodies, structures and kinds are
    absent, and so are ``VALIDATION_BODIES``.

    With drawn bodies there is as much motion as without: all do equally many clips, the cast's the first
    of those that they do otherwise.
    """
    cast: dict[str, dict[str, Clips]] = {}
    for family in families():
        for name in bodies_of(family, "train"):
            clips = training_clips(size, name, seed, len(solver.drawn))
            able = [clip for clip in clips if not unable(clip, (name,))]
            structure = family.bodies[name].structure.name
            cast.setdefault(structure, {})[name] = Clips(name, able, solver.motion)
    for name, body in solver.drawn.items():
        clips = training_clips(size, name, seed, len(solver.drawn))
        cast.setdefault(body.structure.name, {})[name] = Clips(name, clips, solver.motion)
    return cast
