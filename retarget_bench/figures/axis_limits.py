"""Where the axes of charts end: those of reports and of pictures leave out what is far worse."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

ROOM = 2.5
"""A chart's axis ends at so many times the median method's number where some method is farther off."""


def top(highest: Sequence[float], decimals: int = 2, others: Sequence[float] = ()) -> float:
    """Where an axis ends, from the highest number of every method: what is far worse is left out.

    decimals: with which the numbers are written; methods that have nothing but zeros then do not count.
    others: numbers that the axis reaches to as well, such as controls', but that do not count as methods.
    """
    known = [each for each in highest if np.isfinite(each) and each >= 0.5 * 10.0**-decimals]
    if not known:
        return 10.0**-decimals
    longest = max([*known, *(each for each in others if np.isfinite(each))])
    return float(min(longest, ROOM * float(np.median(known))))
