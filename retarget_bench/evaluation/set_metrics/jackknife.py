"""Delete-a-group jackknife over source clips: how uncertain a value of a set is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

GROUPS = 10
CLIPS = 10
"""Below so many clips no interval is given."""
LEVEL = 0.95


def groups_of(clips: Mapping[str, int], number: int = GROUPS) -> dict[str, int]:
    """Clip -> group, dealt out by size there and back, so that the groups are about equally large.

    clips: clip -> windows.
    """
    ordered = sorted(clips, key=lambda clip: (-clips[clip], clip))
    there_and_back = [*range(number), *reversed(range(number))]
    return {clip: there_and_back[rank % len(there_and_back)] for rank, clip in enumerate(ordered)}


def deviation(without: Sequence[float]) -> float:
    """The standard error from the values without each group: sqrt((G - 1) / G sum (v_g - mean v)^2)."""
    values = np.asarray(without, dtype=float)
    return float(np.sqrt((len(values) - 1) / len(values) * ((values - values.mean()) ** 2).sum()))


def interval(value: float, without: Sequence[float]) -> tuple[float, float] | None:
    """Value -+ t(G - 1) times the jackknife's standard error; None where a value is undefined.

    without: the values without each of the G groups.
    """
    from scipy.special import stdtrit  # type: ignore[import-untyped]

    if not np.isfinite(without).all():
        return None
    reach = float(stdtrit(len(without) - 1, 0.5 + LEVEL / 2)) * deviation(without)
    return value - reach, value + reach
