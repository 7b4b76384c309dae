"""Real motion made worse in known ways, to see whether a distance to real motion notices.

Every function takes positions of a body and gives positions; how much is a number that 0 leaves unchanged.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d  # type: ignore[import-untyped]

from retarget_bench.api import CaseFeatures, CaseInfo, Prediction, Stretches
from retarget_bench.evaluation.set_metrics import evaluate
from retarget_bench.evaluation.set_metrics.draw import Draw, draw
from retarget_bench.metrics.fid import Fid, features
from retarget_bench.metrics.fid_structure import FidStructure
from retarget_bench.motion import importer
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions

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


def wobble(motion: Positions, name: str, amount: float) -> Positions:
    """Each foot goes round in circles of ``amount`` heights, twice a second, a toe with its foot."""
    positions = motion.positions.copy()
    turns = 2 * 2 * np.pi * np.arange(motion.frames) / motion.fps
    starts = _random(name, "wobble").uniform(0, 2 * np.pi, 2)
    for side, start in zip(("left", "right"), starts, strict=True):
        circle = np.stack([np.sin(turns + start), 0.0 * turns, np.cos(turns + start)], axis=1)
        for joint, role in enumerate(motion.character.roles):
            if role and role.startswith((f"{side}_foot", f"{side}_toe")):
                positions[:, joint] += amount * motion.character.height * circle
    return _with(motion, positions)


def pace(motion: Positions, name: str, amount: float) -> Positions:
    """All is done ``amount`` times as fast: a slower clip is cut at its old length."""
    places = np.arange(0.0, motion.frames - 1, amount)[: motion.frames]
    low = np.floor(places).astype(int)
    return motion.between(low, places - low, motion.fps)


def exchange(motion: Positions, name: str, amount: float) -> Positions:
    """Left joints stand for right ones and back, all the time."""
    return _with(motion, motion.positions[:, _other_side(motion.character)]) if amount else motion


def longer_arms(motion: Positions, name: str, amount: float) -> Positions:
    """Both arms ``amount`` times as long, in the same directions."""
    return _with(motion, _longer(motion, "arm", amount))


def longer_legs(motion: Positions, name: str, amount: float) -> Positions:
    """Both legs ``amount`` times as long; the body is lifted, and the lower foot as high as it was."""
    grown = _longer(motion, "up_leg", amount)
    feet = [motion.character.joint_of[role] for role in ("left_foot", "right_foot")]
    grown[..., 1] += (motion.positions[:, feet, 1].min(axis=1) - grown[:, feet, 1].min(axis=1))[:, None]
    return _with(motion, grown)


def _longer(motion: Positions, start: str, amount: float) -> np.ndarray:
    positions, joint_of = motion.positions, motion.character.joint_of
    grown, parents = positions.copy(), motion.character.skeleton.parents
    limb = {joint_of[f"{side}_{start}"] for side in ("left", "right")}
    for joint, parent in enumerate(parents):
        if parent in limb:
            limb.add(joint)
            grown[:, joint] = grown[:, parent] + amount * (positions[:, joint] - positions[:, parent])
        elif parent >= 0:
            grown[:, joint] = grown[:, parent] + positions[:, joint] - positions[:, parent]
    return grown


def lift(motion: Positions, name: str, amount: float) -> Positions:
    """Everything ``amount`` heights higher."""
    return _with(motion, motion.positions + amount * motion.character.height * np.array([0.0, 1.0, 0.0]))


def smooth(motion: Positions, name: str, amount: float) -> Positions:
    """Places averaged over time by a Gaussian with a standard deviation of ``amount`` frames."""
    return _with(motion, gaussian_filter1d(motion.positions, amount, axis=0, mode="nearest"))


def late(motion: Positions, name: str, amount: float) -> Positions:
    """Everything ``amount`` seconds later; until then the body stands as in its first frame."""
    return motion.at(np.maximum(np.arange(motion.frames) - round(amount * motion.fps), 0))


def knees_back(motion: Positions, name: str, amount: float) -> Positions:
    """Knees as far behind the lines from hip to ankle as they were before them."""
    positions, at = motion.positions.copy(), motion.character.joint_of
    for side in ("left", "right"):
        hip, knee, ankle = (at[f"{side}_{joint}"] for joint in ("up_leg", "leg", "foot"))
        line = motion.positions[:, ankle] - motion.positions[:, hip]
        along = np.einsum("fc,fc->f", motion.positions[:, knee] - motion.positions[:, hip], line)
        along = along / np.maximum(np.einsum("fc,fc->f", line, line), 1e-12)
        foot = motion.positions[:, hip] + along[:, None] * line
        positions[:, knee] = (1 + amount) * foot - amount * motion.positions[:, knee]
    return _with(motion, positions)


def leap(motion: Positions, name: str, amount: float) -> Positions:
    """The left foot is ``amount`` heights higher in a single frame."""
    positions = motion.positions.copy()
    frame = _random(name, "leap").integers(motion.frames)
    positions[frame, motion.character.joint_of["left_foot"], 1] += amount * motion.character.height
    return _with(motion, positions)


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
    "jitter, heights": (jitter, (0.0002, 0.0005, 0.001, 0.002, 0.005, 0.02)),
    "gliding, heights a second": (slide, (0.02, 0.05, 0.1, 0.2, 0.4)),
    "feet wobbling, heights": (wobble, (0.005, 0.01, 0.02, 0.05)),
    "frozen, share": (freeze, (0.1, 0.25, 0.5, 1.0)),
    "shuffled frames, share": (shuffle, (0.1, 0.25, 0.5, 1.0)),
    "left and right swapped, share": (swap, (0.1, 0.25, 0.5, 1.0)),
    "times warped, share of the speed": (warp, (0.5, 0.75, 1.0)),
    "slower, times": (pace, (0.75, 0.5)),
    "faster, times": (pace, (1.25, 1.5)),
    "backwards": (reverse, (1.0,)),
    "left and right exchanged": (exchange, (1.0,)),
    "mirrored": (mirror, (1.0,)),
    "arms longer, times": (longer_arms, (1.1, 1.2)),
    "legs longer, times": (longer_legs, (1.1, 1.2)),
    "lifted, heights": (lift, (0.02, 0.05, 0.1)),
    "sunk, heights": (lift, (-0.02, -0.05, -0.1)),
    "smoothed, frames": (smooth, (1.0, 2.0, 4.0, 8.0)),
    "knees bent backwards": (knees_back, (1.0,)),
    "late, seconds": (late, (0.25, 0.5, 1.0, 2.0)),
    "a foot leaps, heights": (leap, (0.1,)),
}
"""Corruption -> amounts, from little harm to much."""


class Crowd:
    """Real motion of bodies as one set, made worse, as a metric of sets sees it.

    motions: (clip, body) -> real motion. stretches: what halves are made of; None: of whole clips.
    """

    def __init__(self, motions: Mapping[tuple[str, str], Positions], metric: Fid | None = None) -> None:
        self.metric = metric or Fid()
        self.stretches: Stretches | None = self.metric.stretches
        self.motions = {" ".join(key): motion for key, motion in motions.items()}
        self.infos = {
            " ".join((clip, body)): CaseInfo(" ".join((clip, body)), "retarget", "intra", "a", body, clip)
            for clip, body in motions
        }
        self.real = {name: features.features(motion) for name, motion in self.motions.items()}

    def sets(self, harm: Corruption | None = None, amount: float = 0.0) -> Draw:
        """The halves of the real motion and of the harmed one, of the windows that both have."""
        shown = {}
        for name, motion in self.motions.items():
            real, speed = self.real[name]
            made = features.features(harm(motion, name, amount))[0] if harm else real
            shown[name] = CaseFeatures(made[: len(real)], real[: len(made)], speed[: len(made)])
        return draw(shown, self.infos, self.stretches)

    def other_clip(self, motion: Positions, name: str, amount: float) -> Positions:
        """The right motion of another clip: the one half a set further on."""
        names = list(self.motions)
        return self.motions[names[(names.index(name) + len(names) // 2) % len(names)]] if amount else motion

    def notice(self, harm: Corruption | None = None, amount: float = 0.0, value: str = "fid") -> float:
        """A value of harmed motion; without a harm, the floor."""
        return self.times(harm, amount, value)[0]

    def times(self, harm: Corruption | None, amount: float, value: str = "fid") -> tuple[float, float]:
        """A value of harmed motion, and the floor of the same windows."""
        sets = self.sets(harm, amount)
        return evaluate._measured(self.metric, value, sets, sets.real, sets.generated, sets.whole)


def seen(motion: Prediction) -> Positions:
    """A motion known by positions only."""
    return Positions(motion.character, motion.positions, motion.fps)


def people_in(folder: Path, seconds: int = 12, most: int = 4) -> Crowd:
    """The two-legged takes of a folder of BVH files: of each at most so many pieces of some seconds."""
    motions = {}
    for path in sorted(folder.glob("*.bvh")):
        motion = importer.load(path).motion
        if motion.character.four_legged or features.unfit(motion.character):
            continue
        shown = seen(motion).resample(features.RATE)
        long = int(seconds * features.RATE)
        for at in range(0, min(shown.frames - long // 4, most * long), long):
            motions[f"{path.stem} {at}", ""] = shown.at(slice(at, at + long))
    return Crowd(motions)


def structure_in(
    puppets: Any, structure: str, most: int, chosen: Callable[[Positions], bool] = lambda motion: True
) -> Crowd:
    """At most so many performances (clip, body) of a structure of the puppets, of those that are chosen."""
    cast = puppets.characters()
    offered = [
        (clip, name)
        for clip, names in puppets.performers().items()
        for name in names
        if cast[name].structure == structure
    ]
    motions: dict[tuple[str, str], Positions] = {}
    for clip, name in sorted(offered, key=lambda pair: _rank(" ".join(pair), "performance")):
        motion = puppets.motion(clip, name)
        # of minute-long sequences the beginning, so that no clip makes up most of a half
        known_by_places = Positions(cast[name], motion.positions[:LONGEST], motion.fps)
        if motion.frames >= FRAMES and chosen(known_by_places):
            motions[clip, name] = known_by_places
        if len(motions) == most:
            break
    return Crowd(motions, FidStructure())
