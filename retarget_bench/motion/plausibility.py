"""Numbers that no body's motion has: angles in radians, a path and bones in different units.

Thresholds lie far from all motion capture that was tried: there, joints turn by 20 degrees and more, and
the path is 0.3 to 4.5 times as long as the steps.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from retarget_bench.motion import rotation
from retarget_bench.motion.character import Motion

_RADIANS = (0.05, 12.0)
"""Degrees by which the joint turns that turns most, where these are radians: at most a whole turn about
each axis, which is 11."""
_MOVED = 0.25
"""Share of the height from which a body moves through the world, or steps."""
_SHORT, _LONG = 6.0, 4.0
"""How many times as long as the path steps may be, and as steps a path."""
_FACTORS = (10.0, 100.0, 1000.0, 1.0 / 0.0254)
"""Ratios of units that are in use."""


def doubts(motion: Motion) -> Iterator[str]:
    """Sentences on angles and lengths that look wrong, with what to do."""
    height = motion.character.height
    moved = float(np.linalg.norm(np.ptp(motion.root, axis=0)))
    turned = np.degrees(rotation.angle(motion.rotations[:, 1:], motion.rotations[:1, 1:]).max(initial=0.0))
    if _RADIANS[0] < turned < _RADIANS[1] and moved > _MOVED * height > 0:
        yield (
            f"no joint turns by more than {turned:.2g} degrees while the body moves by {moved:.2f} m: are "
            "the angles radians? Then multiply them by 57.3"
        )
    if factor := _between_units(motion):
        wrong, remedy = ("short", "multiply") if factor > 1 else ("long", "divide")
        yield (
            f"the path of the body is about {max(factor, 1 / factor):.4g} times too {wrong} for its steps, "
            f"as if places and bones had different units: {remedy} the places of the root by that"
        )


def _between_units(motion: Motion) -> float:
    """By what the root's path has to be multiplied to fit the body's steps; 0.0 where it fits, or none are
    seen.

    The lowest foot stands, so that the root moves, level and up and down, as it does against that foot.
    Both directions have to say so: a walk on a treadmill has a short path alone.
    """
    feet = motion.character.joints(("left_foot", "right_foot"))
    if len(feet) < 2 or motion.frames < 2:
        return 0.0
    against = motion.root[:, None] - motion.positions[:, feet]
    lowest = against[..., 1].argmax(axis=1)
    frames = np.arange(motion.frames - 1)[lowest[1:] == lowest[:-1]]
    steps = against[frames + 1, lowest[frames]] - against[frames, lowest[frames]]
    path = motion.root[frames + 1] - motion.root[frames]
    level = [float(np.linalg.norm(each[:, [0, 2]], axis=1).sum()) for each in (steps, path)]
    upright = [float(np.abs(each[:, 1]).sum()) for each in (steps, path)]
    if level[0] < _MOVED * motion.character.height or min(*level, *upright) <= 0.0:
        return 0.0
    ratios = np.array([level[0] / level[1], upright[0] / upright[1]])
    if not (ratios.min() > _SHORT or ratios.max() < 1.0 / _LONG):
        return 0.0
    factors = np.array([*_FACTORS, *(1.0 / each for each in _FACTORS)])
    apart = np.abs(np.log(factors / np.sqrt(ratios.prod())))
    # a root that rests but for rounding is in the ratio of no two units
    return float(factors[apart.argmin()]) if apart.min() < np.log(_SHORT) else 0.0
