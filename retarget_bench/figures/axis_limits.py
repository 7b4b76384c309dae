"""Ends of axes and colour scales: far worse results lie beyond them, and are marked at the edge."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from retarget_bench.results.header import DeclaredValue

if TYPE_CHECKING:
    from retarget_bench.analysis.summary import Mean

ROOM = 2.5
"""A chart's axis ends at so many times the median method's number where some method is farther off."""
CUT = ("lower", "target")
"""Values of which what is far above most is worse; all other axes show everything."""
MARGIN = 0.03
"""Of an axis, what is left free beyond the last mark."""


def top(highest: Sequence[float], decimals: int = 2) -> float:
    """The end of an axis, from the highest number of every method; far worse ones are left out.

    decimals: with which the numbers are written; methods that have nothing but zeros then do not count.
    """
    numbers = [each for each in highest if np.isfinite(each) and each >= 0.5 * 10.0**-decimals]
    return float(min(max(numbers), ROOM * float(np.median(numbers)))) if numbers else 10.0**-decimals


def limits(
    means: Mapping[str, Iterable[Mean]],
    declared: DeclaredValue,
    *,
    bands: bool = False,
    from_zero: bool = True,
) -> tuple[float, float]:
    """The least and the highest number of an axis; what is far worse than the median method lies beyond.

    The axis is up to twice as long where intervals of what lies within need it, but not for bands, which
    may run out.

    means: label -> what the axis is to show of it. declared: the value, as results declare it. from_zero:
    whether the axis reaches down to 0.
    """
    shown = {label: listed for label, each in means.items() if (listed := list(each))}
    every = [mean for each in shown.values() for mean in each]
    highs = [mean.value if mean.interval is None else max(mean.value, mean.interval.high) for mean in every]
    lows = [mean.value if mean.interval is None else min(mean.value, mean.interval.low) for mean in every]
    highest, least = max(highs, default=1.0), min(lows, default=0.0)
    end = math.inf
    if declared.better in CUT and shown:
        own = [max(mean.value for mean in each) for each in shown.values()]
        size = max(own)
        end = top(own, 3 - math.floor(math.log10(size)) if size > 0 else 2)
        end = max(end, float(declared.goal)) if declared.better == "target" else end
        inner = (mean.interval.high for mean in every if mean.interval is not None and mean.value <= end)
        end = end if bands else max(end, min(2.0 * end, max(inner, default=end)))
    cut = highest > end
    first = min(0.0, least) if from_zero else least
    room = MARGIN * ((end if cut else highest) - first) or MARGIN * max(abs(first), 1.0)
    return first - room, end if cut else highest + room


def colour_end(numbers: Mapping[str, Sequence[float]], share: float) -> float:
    """The end of a colour scale: this share of the numbers is below, and it is no more than ``ROOM`` times
    the highest number of the median method.

    numbers: label -> what is drawn of it.
    """
    among = [each for each in numbers.values() if each]
    numbers_sorted = sorted(number for each in among for number in each)
    if not numbers_sorted:
        return 1.0
    median = float(np.median([max(each) for each in among]))
    return max(min(numbers_sorted[int(share * (len(numbers_sorted) - 1))], ROOM * median), 1e-9)
