"""Real motion made worse in known ways, to see whether a distance to real motion notices.

Every function takes positions of a body and gives positions; how much is a number that 0 leaves unchanged.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import TWO_LEGS, CaseFeatures, CaseInfo, Prediction, Sample, Stretches
from retarget_bench.evaluation.set_metrics.draw import Draw, draw
from retarget_bench.metrics.fid import SHIPPED as PEOPLE
from retarget_bench.metrics.fid import Fid
from retarget_bench.metrics.fid_structure import SHIPPED
from retarget_bench.metrics.fid_structure.frechet import frechet
from retarget_bench.metrics.fid_structure.pairs import Fits, Kid
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions
from retarget_bench.training.features import network, windows

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


def swap(motion: Positions, name: str, amount: float) -> Positions:
    """In a share ``amount`` of the stretches of 64 frames left joints stand for right ones and back."""
    positions = motion.positions.copy()
    for stretch in _hit(motion, name, "swap", amount):
        positions[stretch] = positions[stretch][:, _other_side(motion.character)]
    return _with(motion, positions)


def warp(motion: Positions, name: str, amount: float) -> Positions:
    """Time runs faster and slower by turns, about once a second, by a share ``amount`` at most."""
    turn = 2 * np.pi * np.arange(motion.frames) / motion.fps + _random(name, "warp").uniform(0, 2 * np.pi)
    places = np.arange(motion.frames) + amount * motion.fps / (2 * np.pi) * np.sin(turn)
    places = np.clip(places, 0, motion.frames - 1)
    low = np.floor(places).astype(int)
    return motion.between(low, places - low, motion.fps)


def _other_side(body: Character) -> list[int]:
    """Per joint the one of the other side, by role, or by name where joints have none."""
    by_name = {name: joint for joint, name in enumerate(body.skeleton.names)}
    others = []
    for joint, (role, name) in enumerate(zip(body.roles, body.skeleton.names, strict=True)):
        other = body.joint_of.get(_swapped(role)) if role else by_name.get(_swapped(name))
        others.append(joint if other is None else other)
    return others


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
MORE_HARMS: dict[str, tuple[Corruption, tuple[float, ...]]] = {
    "warp": (warp, (0.25, 0.5, 0.75, 1.0)),
    "swap": (swap, (0.1, 0.25, 0.5, 1.0)),
}
"""Likewise: shares of the speed, shares of the stretches."""


class Crowd:
    """Real motion of two-legged bodies as one set, made worse, as the metric ``fid`` sees it.

    motions: clip -> real motion. stretches: what halves are made of; None: of whole clips.
    """

    def __init__(self, motions: Mapping[str, Positions]) -> None:
        self.metric = Fid()
        self.stretches: Stretches | None = self.metric.stretches
        self.network = network.find(PEOPLE, TWO_LEGS)
        self.motions = dict(motions)
        self.real = {clip: self.network.features(motion) for clip, motion in motions.items()}
        self.infos = {clip: CaseInfo(clip, "retarget", "intra", "a", "b", clip) for clip in motions}

    def sets(self, harm: Corruption | None = None, amount: float = 0.0) -> Draw:
        """The halves of the real motion and of the harmed one."""
        features = {}
        for clip, motion in self.motions.items():
            real, speed = self.real[clip]
            generated = self.network.features(harm(motion, clip, amount))[0] if harm else real
            features[clip] = CaseFeatures(generated, real, speed)
        return draw(features, self.infos, self.stretches)

    def notice(self, harm: Corruption | None = None, amount: float = 0.0) -> float:
        """FID of harmed motion; without a harm, the floor."""
        (a, b), (p, q) = (sets := self.sets(harm, amount)).real, sets.generated
        return (self.metric.value("fid", a, q) + self.metric.value("fid", b, p)) / 2


def seen(motion: Prediction) -> Positions:
    """A motion known by positions only."""
    return Positions(motion.character, motion.positions, motion.fps)


def people_in(folder: Path, seconds: int = 12, most: int = 4) -> Crowd:
    """The two-legged takes of a folder of BVH files: of each at most so many pieces of some seconds."""
    motions = {}
    for path in sorted(folder.glob("*.bvh")):
        motion = importer.load(path).motion
        if network.stranger(motion.character):
            continue
        shown = seen(motion).resample(windows.RATE)
        long = int(seconds * windows.RATE)
        for at in range(0, min(shown.frames - long // 4, most * long), long):
            motions[f"{path.stem} {at}"] = shown.at(slice(at, at + long))
    return Crowd(motions)


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
        self._noticed: dict[tuple[Corruption | None, float], Noticed] = {}

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
        if (harm, amount) not in self._noticed:
            self._noticed[harm, amount] = self._measured(harm, amount)
        return self._noticed[harm, amount]

    def _measured(self, harm: Corruption | None, amount: float) -> Noticed:
        measured = []
        for half, (real, clips) in enumerate(self.real):
            generated, other = self._features(1 - half, harm, amount)
            pair = Sample(real, clips), Sample(generated, other)
            measured.append((frechet(real, generated), Kid()(*pair), *Fits()(*pair)))
        return Noticed(min(len(clips) for _, clips in self.real), *np.mean(measured, axis=0).tolist())
