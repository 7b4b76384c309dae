"""Real motion made worse in known ways, to see whether a distance to real motion notices.

Every function takes positions of a body and gives positions; how much is a number that 0 leaves unchanged.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from retarget_bench.api import Sample
from retarget_bench.metrics.fid import SHIPPED
from retarget_bench.metrics.fid.frechet import frechet
from retarget_bench.metrics.fid.pairs import Fits, Kid
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.training.features import network

FRAMES, LONGEST = 64, 240
Corruption = Callable[[Positions, str, float], Positions]


def _random(name: str, what: str) -> np.random.Generator:
    return np.random.default_rng(int(hashlib.sha256(f"{what} {name}".encode()).hexdigest()[:15], 16))


def _rank(name: str, what: str) -> float:
    """Between 0 and 1, by the name alone."""
    return int(hashlib.sha256(f"{what} {name}".encode()).hexdigest()[:12], 16) / 16**12


def jitter(motion: Positions, name: str, amount: float) -> Positions:
    """Every joint trembles: noise of ``amount`` heights in every coordinate and frame."""
    noise = _random(name, "jitter").normal(size=motion.positions.shape)
    return _with(motion, motion.positions + amount * motion.character.height * noise)


def slide(motion: Positions, name: str, amount: float) -> Positions:
    """The whole body glides over the floor, in a direction of its own, at ``amount`` heights a second."""
    angle = _random(name, "slide").uniform(0, 2 * np.pi)
    step = amount * motion.character.height / motion.fps * np.array([np.sin(angle), 0.0, np.cos(angle)])
    return _with(motion, motion.positions + np.arange(motion.frames)[:, None, None] * step)


def freeze(motion: Positions, name: str, amount: float) -> Positions:
    """A share ``amount`` of the stretches of 64 frames stands still as in its first frame."""
    frames = np.arange(motion.frames)
    for stretch in _hit(motion, name, "freeze", amount):
        frames[stretch] = stretch.start
    return motion.at(frames)


def shuffle(motion: Positions, name: str, amount: float) -> Positions:
    """A share ``amount`` of the stretches of 64 frames has its frames in a random order."""
    frames = np.arange(motion.frames)
    for stretch in _hit(motion, name, "shuffle", amount):
        frames[stretch] = _random(f"{name} {stretch.start}", "order").permutation(frames[stretch])
    return motion.at(frames)


def _hit(motion: Positions, name: str, what: str, amount: float) -> list[slice]:
    """Stretches in an order of their own, so that a larger share includes those of a smaller one."""
    starts = range(0, motion.frames, FRAMES)
    return [slice(at, at + FRAMES) for at in starts if _rank(f"{name} {at}", what) < amount]


def reverse(motion: Positions, name: str = "", amount: float = 1.0) -> Positions:
    """Time runs backwards."""
    return motion.at(slice(None, None, -1)) if amount else motion


def mirror(motion: Positions, name: str = "", amount: float = 1.0) -> Positions:
    """Left and right change sides."""
    if not amount:
        return motion
    swapped = motion.positions[:, _other_side(motion.character)]
    return _with(motion, swapped * (-1.0, 1.0, 1.0))


def _other_side(body: Character) -> list[int]:
    """Per joint the one of the other side, by role, or by name where joints have none."""
    by_name = {name: joint for joint, name in enumerate(body.skeleton.names)}
    found = []
    for joint, (role, name) in enumerate(zip(body.roles, body.skeleton.names, strict=True)):
        other = body.joint_of.get(_swapped(role)) if role else by_name.get(_swapped(name))
        found.append(joint if other is None else other)
    return found


def _swapped(word: str) -> str:
    for a, b in (("left", "right"), ("Left", "Right")):
        if a in word:
            return word.replace(a, b)
        if b in word:
            return word.replace(b, a)
    return word


def _with(motion: Positions, positions: np.ndarray) -> Positions:
    return Positions(motion.character, positions, motion.fps)


HARMS: dict[str, tuple[Corruption, tuple[float, ...]]] = {
    "jitter": (jitter, (0.002, 0.005, 0.01, 0.02)),
    "slide": (slide, (0.05, 0.1, 0.2, 0.4)),
    "freeze": (freeze, (0.1, 0.25, 0.5, 1.0)),
    "shuffle": (shuffle, (0.1, 0.25, 0.5, 1.0)),
}
"""Corruption -> growing amounts: heights, heights a second, shares of the stretches."""


# ------------------------------------------------------------------------------------------------- a study
@dataclass(frozen=True)
class Noticed:
    """What the distances say of either half against real motion of the other, on average.

    n: windows in the smaller half. Both ways are needed: the halves differ anyway, and a little harm brings
    one of them nearer to the other as often as not; then it takes the other one away.
    """

    n: int
    fid: float
    kid: float
    coverage: float
    density: float


class Study:
    """Real motion of one structure of a data set, dealt into two halves, made worse.

    The halves are of performances, clip by clip in turn, so that both hold much the same: whether a network
    sees a fault is asked, and not how far apart clips lie (a dozen of them, for the dogs).

    performances: how many (clip, body) at most. chosen: keeps those whose positions it says True of.
    """

    def __init__(
        self,
        puppets: Any,
        structure: str,
        performances: int,
        chosen: Callable[[Positions], bool] = lambda motion: True,
    ) -> None:
        self.network = network.find(SHIPPED, structure)
        cast = puppets.characters()
        offered = [
            (clip, name)
            for clip, names in puppets.performers().items()
            for name in names
            if cast[name].structure == structure
        ]
        offered.sort(key=lambda pair: _rank(" ".join(pair), "performance"))
        self.motions: dict[tuple[str, str], Positions] = {}
        for clip, name in offered:
            motion = puppets.motion(clip, name)
            # of minute-long sequences the beginning, so that no clip makes up most of a half
            known_by_places = Positions(cast[name], motion.positions[:LONGEST], motion.fps)
            if motion.frames >= FRAMES and chosen(known_by_places):
                self.motions[clip, name] = known_by_places
            if len(self.motions) == performances:
                break
        self.half = {pair: number % 2 for number, pair in enumerate(sorted(self.motions))}
        self.begin()

    def begin(self) -> None:
        """Take the motions as they are now for real."""
        self.real = [self._features(half) for half in (0, 1)]

    def _features(
        self, half: int, harm: Corruption | None = None, amount: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        parts, clips = [], []
        for (clip, name), motion in self.motions.items():
            if self.half[clip, name] == half:
                shown = harm(motion, f"{clip} {name}", amount) if harm else motion
                parts.append(self.network.features(shown)[0])
                clips += [clip] * len(parts[-1])
        return np.concatenate(parts).astype(np.float64), np.array(clips)

    def notice(self, harm: Corruption | None = None, amount: float = 0.0) -> Noticed:
        """The distances of harmed motion; without a harm, the floor."""
        found = []
        for half, (real, clips) in enumerate(self.real):
            made, other = self._features(1 - half, harm, amount)
            pair = Sample(real, clips), Sample(made, other)
            found.append((frechet(real, made), Kid()(*pair), *Fits()(*pair)))
        return Noticed(min(len(clips) for _, clips in self.real), *np.mean(found, axis=0).tolist())
