"""Real motion made worse in known ways, to see whether a distance to real motion notices.

Every function takes positions of a body and gives positions; how much is a number that 0 leaves unchanged.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np

from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions

Corruption = Callable[[Positions, str, float], Positions]


def _random(name: str, what: str) -> np.random.Generator:
    return np.random.default_rng(int(hashlib.sha256(f"{what} {name}".encode()).hexdigest()[:15], 16))


def _rank(name: str, what: str) -> float:
    """Between 0 and 1: clips are hit in this order, so that more of them include those hit before."""
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
    """A share ``amount`` of the clips stands as in its first frame."""
    if _rank(name, "freeze") >= amount:
        return motion
    return _with(motion, np.repeat(motion.positions[:1], motion.frames, axis=0))


def shuffle(motion: Positions, name: str, amount: float) -> Positions:
    """A share ``amount`` of the clips has its frames in a random order."""
    if _rank(name, "shuffle") >= amount:
        return motion
    return motion.at(_random(name, "order").permutation(motion.frames))


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
"""Corruption -> growing amounts: heights, heights a second, shares of the clips."""
