"""Root rules: the ratios by which a source's root path is scaled for a smaller or larger body.

Paths are scaled about the world's origin, by one ratio level and by one in height, which all rules but
``mixamo`` take of the same length. So the floor (y = 0) stays the floor and turning the source about the
vertical axis turns the result. A source that stands on another height gives a target that stands on that
height times the ratio: steps and boxes shrink with the body.
"""

import math
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Literal, get_args

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import Measures

SIZES: dict[str, Callable[[Measures], tuple[float, float]]] = {
    "height": lambda size: (size.height, size.height),
    "root_offset": lambda size: (size.root_offset, size.root_offset),
    "hip_height": lambda size: (size.hip_height, size.hip_height),
    "leg_length": lambda size: (size.leg_length, size.leg_length),
    "hip_height_width": lambda size: (_height_and_width(size), _height_and_width(size)),
    "mixamo": lambda size: (_height_and_width(size), size.hip_height),
}
"""Rule -> the lengths of a body that its ratios are taken of, metres: of the level path and of the height.

``mixamo`` is named after the data that it describes: Adobe's service moves characters over the ground
nearly in proportion to the height plus 0.6 times the width of the hips. The 0.6 was fitted on the
characters of SAN's data and on nothing else; on motion that was retargeted elsewhere the rule is no better
than ``hip_height``.
"""


def _height_and_width(size: Measures) -> float:
    return size.hip_height + 0.6 * size.hip_width


ScalingRule = Literal[
    "none", "height", "root_offset", "hip_height", "leg_length", "hip_height_width", "mixamo"
]
"""``none`` copies the path unscaled."""

RootRule = ScalingRule | Literal["reference"]
"""``reference`` takes the right answer's own path (privileged)."""

PathKind = Literal["integrated", "relative"]
"""The path of predicted movements: their sum, or the source's scaled path plus the ``fading`` sum of what
they differ by from its own."""

MEMORY = 0.25
"""Seconds in which a deviation from the source's path fades to 1/e. Of 0.06 to 2 s on the puppets'
validation part: shorter ones make answers jerkier, longer ones errors larger and contacts fewer."""

SCALING_RULES: tuple[str, ...] = get_args(ScalingRule)
ROOT_RULES = (*SCALING_RULES, "reference")


def check(rule: str, rules: Sequence[str] = ROOT_RULES) -> str:
    """``rule`` itself; raises NotSupported, with the known rules, when there is none of that name."""
    if rule not in rules:
        raise NotSupported(f"no root rule {rule!r}; rules are {', '.join(rules)}")
    return rule


def reason(rule: str, source: Character, target: Character) -> str | None:
    """None, or why ``rule`` does not apply to this pair, as a sentence."""
    if rule in SIZES:
        for body in (source, target):
            length = min(SIZES[rule](body.measures))
            if not (math.isfinite(length) and length > 1e-6):
                needed = "hip height" if rule == "mixamo" else rule.replace("_", " ")
                return (
                    f"root rule {rule} needs a positive {needed}, "
                    f"and {body.name}'s is {length:.3g} m{_lacking(body)}"
                )
    return None


def _lacking(body: Character) -> str:
    """The sentence on a body without feet."""
    if any(role.endswith("_foot") for role in body.joint_of):
        return ""
    return ", since none of its joints is known as a foot; say which are (roles=FILE), if it has any"


def ratios(rule: str, source: Character, target: Character) -> np.ndarray:
    """``(3,)`` target over source along x, y (height) and z; 1 for ``none`` and ``reference``.

    Raises NotSupported where a length is missing (a root offset of zero, a body without legs).
    """
    if (why := reason(check(rule), source, target)) is not None:
        raise NotSupported(why)
    if rule not in SIZES:
        return np.ones(3)
    level, height = np.divide(SIZES[rule](target.measures), SIZES[rule](source.measures))
    return np.array([level, height, level])


def fading(steps: np.ndarray, fps: float, before: np.ndarray | float = 0.0) -> np.ndarray:
    """Sums of steps ``(frames, ...)`` up to each frame, which fade to 1/e within ``MEMORY`` seconds: a
    constant step adds up to that of so many seconds and no more.

    before: ``(...)`` the sum before the first step. Chunks give exactly what the whole gives.
    """
    keep = math.exp(-1.0 / (fps * MEMORY))
    start = np.broadcast_to(before, steps.shape[1:])
    return np.stack([*accumulate(steps, lambda total, step: keep * total + step, initial=start)][1:])


def relative(path: np.ndarray, lead: np.ndarray, fps: float) -> np.ndarray:
    """The path ``lead`` ``(frames, ...)`` plus the ``fading`` sum of what the steps of ``path`` differ by
    from its own."""
    astray = path - lead
    return lead + fading(np.diff(astray, axis=0, prepend=astray[:1]), fps)
