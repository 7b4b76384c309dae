"""Root rules: the ratio by which a source's root path is scaled for a smaller or larger body.

Height and path are scaled by the same ratio about the world's origin, so the floor (y = 0) stays the floor
and turning the source about the vertical axis turns the result. A source that stands on another height
gives a target that stands on that height times the ratio: steps and boxes shrink with the body.
"""

import math
from collections.abc import Callable, Sequence
from typing import Literal, get_args

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

SCALING_RULES: tuple[str, ...] = get_args(ScalingRule)
ROOT_RULES = (*SCALING_RULES, "reference")


def check(rule: str, known: Sequence[str] = ROOT_RULES) -> str:
    """``rule`` itself; raises NotSupported, with the known rules, when there is none of that name."""
    if rule not in known:
        raise NotSupported(f"no root rule {rule!r}; rules are {', '.join(known)}")
    return rule


def reason(rule: str, source: Character, target: Character) -> str | None:
    """None, or why ``rule`` says nothing about this pair, as a sentence."""
    if rule in SIZES:
        for body in (source, target):
            length = SIZES[rule](body.measures)
            if not (math.isfinite(length) and length > 1e-6):
                return (
                    f"root rule {rule} needs a positive {rule.replace('_', ' ')}, "
                    f"and {body.name}'s is {length:.3g} m"
                )
    return None


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
