"""The content of a BVH file before any of it is interpreted."""

from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property

import numpy as np

from retarget_bench.motion.skeleton import EndSite

POSITIONS = ("Xposition", "Yposition", "Zposition")
ROTATIONS = ("Xrotation", "Yrotation", "Zrotation")

_COMMON_RATES = (10, 12, 15, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 100, 120, 144, 180, 200, 240, 250, 480)
_NTSC_RATES = tuple(rate / 1.001 for rate in (24, 30, 60, 120))


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """The joints of a file, in its own order, names and units.

    names:     one per joint; a file may use a name twice.
    parents:   ``(joints,)``, -1 for the root alone, every parent before its children.
    offsets:   ``(joints, 3)`` the OFFSET lines.
    channels:  per joint its channel names in file order (``Xposition``, ``Zrotation``, ...).
    end_sites: tips, in file order.
    """

    names: tuple[str, ...]
    parents: np.ndarray
    offsets: np.ndarray
    channels: tuple[tuple[str, ...], ...]
    end_sites: tuple[EndSite, ...]

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def first_columns(self) -> tuple[int, ...]:
        """Per joint the column of its first channel, and the number of all channels as last entry."""
        return tuple(np.cumsum([0, *map(len, self.channels)]).tolist())

    @property
    def columns(self) -> int:
        """Numbers per frame."""
        return self.first_columns[-1]

    @cached_property
    def groups(self) -> tuple[tuple[tuple[str, ...], list[int]], ...]:
        """Channel names, and the joints that have exactly these."""
        groups: dict[tuple[str, ...], list[int]] = {}
        for joint, channels in enumerate(self.channels):
            groups.setdefault(channels, []).append(joint)
        return tuple(groups.items())

    def children(self, joint: int) -> list[int]:
        """The joints right below ``joint``."""
        return np.flatnonzero(self.parents == joint).tolist()


@dataclass(frozen=True, eq=False)
class Header:
    """All of a file but its numbers: joints, number of frames, seconds per frame (0: it states none)."""

    hierarchy: Hierarchy
    frames: int
    frame_time: float

    @property
    def fps(self) -> float:
        return frame_rate(self.frame_time)


@dataclass(frozen=True, eq=False)
class Document:
    """A whole file: joints, seconds per frame (0: it states none), and ``values`` ``(frames, columns)`` as
    written.

    Angles are degrees; lengths are the file's own unit.
    """

    hierarchy: Hierarchy
    frame_time: float
    values: np.ndarray

    @property
    def frames(self) -> int:
        return self.values.shape[0]

    @property
    def fps(self) -> float:
        """Frames per second, freed of the rounding of the printed frame time."""
        return frame_rate(self.frame_time)


def frame_rate(frame_time: float) -> float:
    """The rate that is meant by a printed frame time: 60 for ``0.016667``, 120 for ``.0083333``.

    Of the rates whose frame time agrees within one unit of the last printed digit: an exact whole number,
    else the nearest rate in common use, else the nearest whole one; else the plain reciprocal.
    """
    exact = 1.0 / frame_time
    if round(exact) > 0 and abs(exact - round(exact)) < 1e-9 * exact:
        return float(round(exact))
    exponent = Decimal(repr(frame_time)).as_tuple().exponent
    last_digit = 10.0 ** int(exponent)
    for rates in ((*_COMMON_RATES, *_NTSC_RATES), (max(1, round(exact)),)):
        nearest = min(rates, key=lambda rate: abs(1.0 / rate - frame_time))
        if abs(1.0 / nearest - frame_time) <= last_digit:
            return float(nearest)
    return exact
