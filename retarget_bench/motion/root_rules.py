"""Root rules: the ratio by which a source's root path is scaled for a smaller or larger body.

Height and path are scaled by the same ratio about the world's origin, so the floor (y = 0) stays the floor
and turning the source about the vertical axis turns the result. A source that stands on another height
gives a target that stands on that height times the ratio: steps and boxes shrink with the body.
"""

import math
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Literal, get_args

import numpy as np

from retarget_bench.errors import NotSupported
from retarget_bench.motion.character import Character
from retarget_bench.motion.measures import Measures

SIZES: dict[str, Callable[[Measures], float]] = {
    "height": lambda size: size.height,
    "root_offset": lambda size: size.root_offset,
    "hip_height": lambda size: size.hip_height,
    "leg_length": lambda size: size.leg_length,
    # Fits the root paths of all Mixamo pairs at hand within 4 %: a fit, not a law.
    "hip_height_width": lambda size: size.hip_height + 0.6 * size.hip_width,
}
"""Rule -> the length of a body that its ratio is taken of, metres."""

ScalingRule = Literal["none", "height", "root_offset", "hip_height", "leg_length", "hip_height_width"]
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
            length = SIZES[rule](body.measures)
            if not (math.isfinite(length) and length > 1e-6):
                return (
                    f"root rule {rule} needs a positive {rule.replace('_', ' ')}, "
                    f"and {body.name}'s is {length:.3g} m{_lacking(body)}"
                )
    return None


def _lacking(body: Character) -> str:
    """The sentence on a body without feet."""
    if any(role.endswith("_foot") for role in body.joint_of):
        return ""
    return ", since none of its joints is known as a foot; say which are (roles=FILE), if it has any"


def ratio(rule: str, source: Character, target: Character) -> float:
    """Target over source, in the length that ``rule`` names; 1 for ``none`` and ``reference``.

    Raises NotSupported where that length is missing (a root offset of zero, a body without legs).
    """
    if (why := reason(check(rule), source, target)) is not None:
        raise NotSupported(why)
    if rule not in SIZES:
        return 1.0
    size = SIZES[rule]
    return size(target.measures) / size(source.measures)


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
