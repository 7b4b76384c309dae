"""Clips solved for bodies on demand, with their labels, and the training set made of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from retarget_bench.api import Contacts, Touch
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Motion
from retarget_bench.training.clips import LazyClips

from ..bodies import rigs
from ..bodies.structures import Body
from ..cache import Arrays, kept
from ..conventions import FPS, SIDES
from ..performances.score import Score
from ..solver.hands import plant_rests
from ..solver.touch_points import touch_point, touching
from .cases import family_by_body
from .clips import Clip, training_clips, unable
from .families import Family, bodies_of, families


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of one clip by one body.

    kind:     ``(frames,)`` text: what is done in each frame; sequences change.
    phase:    ``(frames,)`` 0 to 1 within what is done, or turns of its cycle.
    contacts: of the feet: planted, pivoting, or neither.
    touches:  "left hand on right_knee" -> ``(frames,)`` bool: the hand rests there.
    """

    kind: np.ndarray
    phase: np.ndarray
    contacts: Contacts
    touches: Mapping[str, np.ndarray]


def labels(score: Score, contacts: Contacts) -> Labels:
    kind = np.concatenate([np.full(act.end - act.first, act.kind) for act in score.stretches()])
    return Labels(kind, np.asarray(score.phases(), dtype=np.float64), contacts, touches(score))


def touches(score: Score) -> dict[str, np.ndarray]:
    """Hand and place -> the frames in which the hand rests there in full."""
    found: dict[str, np.ndarray] = {}
    for side in SIDES:
        for touch in score.hands[side].touches:
            name, full = f"{side} hand on {touch.place}", touch.weight == 1.0
            if full.any():
                found[name] = found.get(name, np.zeros(len(full), dtype=bool)) | full
        for plant in score.hands[side].plants:
            name = f"{side} hand on {'held thing' if plant.level > 0.0 else 'floor'}"
            found[name] = found.get(name, np.zeros(score.frames, dtype=bool)) | plant_rests(
                plant, score.frames
            )
    return found


def self_touches(score: Score, body: Body) -> tuple[Touch, ...]:
    """The same hands on places of the own body, as cases tell them: those whose joints the rig has."""
    roles = dict(zip(body.structure.parts, body.structure.roles, strict=False))
    found: dict[tuple[str, str], np.ndarray] = {}
    for side in SIDES:
        for touch in score.hands[side].touches:
            key, full = (side, touch.place), touch.weight == 1.0
            if full.any():
                found[key] = found[key] | full if key in found else full
    told = []
    for (side, name), full in found.items():
        spot, end = touch_point(name, body), roles.get(f"{side}_hand")
        bearing = roles.get(spot.part)
        if end and bearing:
            told.append(Touch(end, touching(spot, side, body.proportions), bearing, spot.at, full))
    return tuple(told)


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
        return family_by_body()

    @cached_property
    def cast(self) -> dict[str, Character]:
        return {name: rigs.character(family.bodies[name]) for name, family in self.families.items()}

    def motion(self, clip: Clip, name: str, manner: str = USUAL) -> Motion:
        arrays = self._arrays(clip, name, manner)
        return self.cast[name].motion(arrays["rotations"], arrays["root"], FPS)

    def contacts(self, clip: Clip, name: str) -> Contacts:
        arrays = self._arrays(clip, name, USUAL)
        roles = self.families[name].bodies[name].structure.labelled
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
        columns = list(body.structure.contacts)
        return {
            "rotations": rigs.rotations(solution.orientations, body, self.cast[name]).astype(np.float32),
            "root": solution.root,
            "planted": solution.planted[:, columns],
            "pivoting": solution.pivoting[:, columns],
        }


Training = Mapping[str, Mapping[str, "Clips"]]
"""Structure -> character -> its clips."""


class Clips(LazyClips[Clip]):
    """Motions of one character, each solved when it is first asked for."""

    def __init__(self, studio: Studio, character: str, listed: Sequence[Clip]) -> None:
        super().__init__(listed)
        self._studio, self.character = studio, character

    def made(self, each: Clip) -> Motion:
        return self._studio.motion(each, self.character)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(clip.name for clip in self.listed)

    @property
    def frames(self) -> int:
        """Number of frames of all clips together, known without solving any."""
        return sum(clip.frames for clip in self.listed)


def training(studio: Studio, size: str, seed: int) -> Training:
    """Every training character with what it is able to do; held-out bodies, structures and kinds are
    absent, and so are the bodies of ``held_out.ASIDE``."""
    found: dict[str, dict[str, Clips]] = {}
    for family in families():
        for name in bodies_of(family, "train"):
            mine = [clip for clip in training_clips(size, name, seed) if not unable(clip, (name,))]
            structure = family.bodies[name].structure.name
            found.setdefault(structure, {})[name] = Clips(studio, name, mine)
    return found
