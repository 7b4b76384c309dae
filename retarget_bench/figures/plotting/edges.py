"""Marks beyond the end of an axis, drawn outside the frame with their numbers."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from retarget_bench.figures.data.model import Mark
from retarget_bench.figures.plotting import canvas

SIZE = 5.5
"""Points: letters of numbers at the edge."""
LETTER = 0.62
"""How wide a digit is, in heights of letters."""
MARK = 6.0
"""Points: a mark at the edge and the gap behind it."""
NUMBERS = 2
"""So many numbers stand beside a row."""
LINE = 7.0
"""Points between two rows of marks above a panel."""

Looks = Mapping[str, Mapping[str, Any]]


def filled(mark: Mark, looks: Looks) -> dict[str, Any]:
    """The matplotlib properties of a mark without a line."""
    hollow = {"markerfacecolor": "white"} if mark.hollow else {}
    return {**looks[mark.method], **hollow, "linestyle": "none"}


def beside(panel: Any, far: Sequence[Mark], looks: Looks) -> float:
    """Draw what is beyond at the right of the panel, the farthest first, one behind the other in each row;
    of more than ``NUMBERS`` only the first has its number.

    Returns how many points it takes at most.
    """
    longest = 0.0
    for row in {mark.at for mark in far}:
        here = sorted((mark for mark in far if mark.at == row), key=lambda mark: -mark.mean.value)
        out = 0.5 * MARK
        for place, mark in enumerate(here):
            text = canvas.short(mark.mean.value) if place == 0 or len(here) <= NUMBERS else ""
            _mark(panel, panel.get_yaxis_transform(), (1.0, row), (out, 0.0), text, filled(mark, looks))
            out += _wide(text)
        longest = max(longest, out)
    return longest


def above(panels: Iterable[Any], found: Iterable[Sequence[Mark]], looks: Looks) -> None:
    """Draw what is beyond above each panel, in rows where marks would overlap; titles give way."""
    both = list(zip(panels, found, strict=False))
    most = max((_above(panel, far, looks) for panel, far in both), default=0)
    for panel, _ in both if most else ():
        panel.set_title(panel.get_title(), pad=LINE * (most + 0.6))


def _above(panel: Any, far: Sequence[Mark], looks: Looks) -> int:
    """How many rows it takes."""
    along = panel.get_xaxis_transform()
    rows: list[list[tuple[float, float]]] = []
    for mark in sorted(far, key=lambda mark: (mark.at, mark.mean.value)):
        text = canvas.short(mark.mean.value)
        at = float(along.transform((mark.at, 1.0))[0])
        left = at > panel.bbox.x0 + 0.5 * panel.bbox.width
        middle = 72.0 * at / panel.figure.dpi
        low, high = (-_wide(text), MARK) if left else (-MARK, _wide(text))
        span = middle + low, middle + high
        free = (k for k, row in enumerate(rows) if all(span[1] < a or b < span[0] for a, b in row))
        row = next(free, len(rows))
        rows += [[]] if row == len(rows) else []
        rows[row].append(span)
        _mark(panel, along, (mark.at, 1.0), (0.0, LINE * (row + 0.6)), text, filled(mark, looks), left=left)
    return len(rows)


def _wide(text: str) -> float:
    return MARK + LETTER * SIZE * len(text)


def _mark(
    panel: Any,
    along: Any,
    at: tuple[float, float],
    out: tuple[float, float],
    text: str,
    look: Mapping[str, Any],
    *,
    left: bool = False,
) -> None:
    """A mark so many points outside the panel, and its number at its right or left."""
    from matplotlib.transforms import ScaledTranslation

    moved = along + ScaledTranslation(out[0] / 72.0, out[1] / 72.0, panel.figure.dpi_scale_trans)
    plain = {**look, "linestyle": "none", "markersize": min(3.5, look["markersize"])}
    panel.plot(*([each] for each in at), transform=moved, clip_on=False, **plain)
    panel.annotate(
        text, at, (out[0] + (-0.6 if left else 0.6) * MARK, out[1]), xycoords=along, fontsize=SIZE,
        textcoords="offset points", va="center", ha="right" if left else "left", annotation_clip=False,
    )  # fmt: skip
