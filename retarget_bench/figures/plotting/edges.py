"""Where axes end when some method is far worse than most, and what stands beyond, with its number."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from retarget_bench.figures import axis_limits
from retarget_bench.figures.plotting import canvas
from retarget_bench.results.header import DeclaredValue, ResultHeader

if TYPE_CHECKING:
    from retarget_bench.analysis.summary import Mean

CUT = ("lower", "target")
"""Values of which what is far above most is worse; all other axes show everything."""
BELOW = 0.03
"""Of the axis, what is left free below the least mark."""
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
TOLD = "; outside the frame: off the scale"


@dataclass
class Edge:
    """The far end of the axis of values, of one panel or of several that share it.

    low, end: of the axis; infinite where it shows everything. far: (place along the other axis, number,
    look) of what stands beyond.
    """

    low: float = -math.inf
    end: float = math.inf
    far: list[tuple[float, float, Mapping[str, Any]]] = field(default_factory=list)

    def keep(self, place: float, mean: Mean, look: Mapping[str, Any]) -> None:
        """Note a mark that the end of the axis cuts off; all others are left alone."""
        if mean.value > self.end:
            self.far.append((place, mean.value, look))

    @property
    def ends(self) -> tuple[float, float] | None:
        """Both, for an axis that is cut; None for others."""
        return None if math.isinf(self.end) else (self.low, self.end)


def edge(
    means: Mapping[str, Iterable[Mean]],
    headers: Mapping[str, ResultHeader],
    declared: DeclaredValue,
    *,
    bands: bool = False,
) -> Edge:
    """The edge of an axis, by the rule of reports: controls lengthen it as far as the methods allow, and
    what is far worse than the median method stands beyond. It is up to twice as long where intervals of
    what stands within need it, but for bands, which may run out.

    means: label -> all that is drawn of it. headers: label -> the header of its results. declared: the
    value, as results declare it.
    """
    shown = {label: found for label, each in means.items() if (found := list(each))}
    if declared.better not in CUT or not shown:
        return Edge()
    highest = {label: max(mean.value for mean in each) for label, each in shown.items()}
    own = [number for label, number in highest.items() if not headers[label].method.control]
    counted = own or list(highest.values())
    size = max(counted)
    end = axis_limits.top(
        counted, 3 - math.floor(math.log10(size)) if size > 0 else 2, list(highest.values())
    )
    if declared.better == "target":
        end = max(end, float(declared.goal))
    every = [mean for each in shown.values() for mean in each]
    spans = [mean.interval for mean in every if mean.interval is not None and mean.value <= end]
    if not bands:
        end = max(end, min(2.0 * end, max((span.high for span in spans), default=end)))
    highs = [mean.value if mean.interval is None else mean.interval.high for mean in every]
    if max(highs) <= end:
        return Edge()
    low = min([*(mean.value for mean in every), *(span.low for span in spans)])
    return Edge(low - BELOW * (end - low), end)


def told(edges: Iterable[Edge]) -> str:
    """What a title says of what stands beyond; nothing where nothing does."""
    return TOLD if any(edge.far for edge in edges) else ""


# ---------------------------------------------------------------------------------------------- drawing
def beside(panel: Any, edge: Edge) -> float:
    """Draw what is beyond at the right of the panel, the farthest first, one behind the other in each row;
    of more than ``NUMBERS`` only the first has its number.

    Returns how many points it takes at most.
    """
    longest = 0.0
    for row in {round(place) for place, _, _ in edge.far}:
        here = sorted((each for each in edge.far if round(each[0]) == row), key=lambda each: -each[1])
        out = 0.5 * MARK
        for place, (_, number, look) in enumerate(here):
            text = canvas.short(number) if place == 0 or len(here) <= NUMBERS else ""
            _mark(panel, panel.get_yaxis_transform(), (1.0, row), (out, 0.0), text, look)
            out += _wide(text)
        longest = max(longest, out)
    return longest


def above(panels: Iterable[Any], found: Iterable[Edge]) -> None:
    """Draw what is beyond above each panel, in rows where marks would overlap; titles give way."""
    both = list(zip(panels, found, strict=False))
    most = max((_above(panel, edge) for panel, edge in both), default=0)
    for panel, _ in both if most else ():
        panel.set_title(panel.get_title(), pad=LINE * (most + 0.6))


def _above(panel: Any, edge: Edge) -> int:
    """How many rows it takes."""
    along = panel.get_xaxis_transform()
    rows: list[list[tuple[float, float]]] = []
    for place, number, look in sorted(edge.far, key=lambda each: (each[0], each[1])):
        text = canvas.short(number)
        at = float(along.transform((place, 1.0))[0])
        left = at > panel.bbox.x0 + 0.5 * panel.bbox.width
        middle = 72.0 * at / panel.figure.dpi
        low, high = (-_wide(text), MARK) if left else (-MARK, _wide(text))
        span = middle + low, middle + high
        free = (k for k, row in enumerate(rows) if all(span[1] < a or b < span[0] for a, b in row))
        row = next(free, len(rows))
        rows += [[]] if row == len(rows) else []
        rows[row].append(span)
        _mark(panel, along, (place, 1.0), (0.0, LINE * (row + 0.6)), text, look, left=left)
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
