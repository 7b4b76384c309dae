"""Elements of inline SVG: shapes, scales and axes, with words for screen readers.

Colours are the page's own, by class (``m0``, ``m1``, ...), so that they follow light and dark; lines
differ in dashes and marks in shape too. A mark that can be clicked is a ``pick``: what it stands for is in
its data attributes, and the page's script finds the cases behind it.
"""

from __future__ import annotations

import colorsys
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup, escape

from retarget_bench.errors import printable
from retarget_bench.figures import palette
from retarget_bench.figures.data.model import Axis
from retarget_bench.figures.palette import MethodStyle

MARKS = (
    "M0-4A4 4 0 1 1 0 4A4 4 0 1 1 0-4Z",
    "M-3.5-3.5H3.5V3.5H-3.5Z",
    "M0-5L5 0L0 5L-5 0Z",
    "M0-4.6L4.4 3.4H-4.4Z",
    "M0 4.6L4.4-3.4H-4.4Z",
    "M-1.4-4.4H1.4V-1.4H4.4V1.4H1.4V4.4H-1.4V1.4H-4.4V-1.4H-1.4Z",
    "M-4.2-2.6L-2.6-4.2L0-1.6L2.6-4.2L4.2-2.6L1.6 0L4.2 2.6L2.6 4.2L0 1.6L-2.6 4.2L-4.2 2.6L-1.6 0Z",
    "M0-5L1.5-1.6L5-1.5L2.2.8L3.1 4.4L0 2.4L-3.1 4.4L-2.2.8L-5-1.5L-1.5-1.6Z",
)
"""Outlines about the origin, some ten units across, by the shape of a style."""
LONGEST = 19
"""Letters of a name that fit beside a chart."""
LETTER = 6.2
"""Units that a letter of a name takes, rather too much than too little."""
Box = tuple[float, float, float, float]
"""Left, top, right and bottom."""
DASHES = {"full": None, "dashed": "5 4", "dotted": "1.5 4", "dash-dot": "9 3 2 3", "long": "14 4"}


# -------------------------------------------------------------------------------------------- elements
def tag(name: str, *children: Any, **attributes: Any) -> Markup:
    """An element. ``_`` in names of attributes is ``-``; None leaves one out; all text is escaped."""
    text = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_text(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{text}>{Markup().join(map(_text, children))}</{name}>")


def _text(value: Any) -> Markup:
    if isinstance(value, float):
        return Markup(f"{value:.1f}".removesuffix(".0"))
    return Markup(value) if isinstance(value, Markup) else Markup(escape(printable(str(value))))


def svg(width: float, height: float, label: str, *children: Any) -> Markup:
    """A chart of so many units; label: what it shows, in words."""
    view, style = f"0 0 {width:g} {height:g}", f"max-width:{1.45 * width:.0f}px"
    return tag("svg", *children, viewBox=view, role="group", aria_label=label, class_="chart", style=style)


def pick(label: str, *children: Any, **data: Any) -> Markup:
    """A mark that leads to its cases. label: what it says, in words; data: what it stands for."""
    attributes = {f"data_{key}": value for key, value in data.items()}
    return tag("g", *children, class_="pick", role="button", tabindex="-1", aria_label=label, **attributes)


def words(x: float, y: float, text: Any, anchor: str = "middle", **more: Any) -> Markup:
    """Text at a place."""
    return tag("text", text, x=x, y=y, text_anchor=anchor, **more)


def short(name: str, most: int) -> str:
    """A name in so many letters; what is left out is in the middle, for parameters stand at the end."""
    name = printable(name)
    return name if len(name) <= most else f"{name[: most - most // 2 - 1]}…{name[-(most // 2) :]}"


def heading(name: str, most: int) -> tuple[Markup, int]:
    """A method's name at the top left of a chart; of one with more letters, the parameters are below it.

    Returns it and its number of lines.
    """
    name = printable(name)
    name_part, bracket, rest = name.partition("[")
    lines = [name] if len(name) <= most or not bracket else [name_part, bracket + rest]
    parts = [
        words(2.0, 13.0 * (k + 1), short(each, most), "start", class_="title")
        for k, each in enumerate(lines)
    ]
    return tag("g", *parts, class_="axes", aria_hidden="true"), len(lines)


def mark(x: float, y: float, style: MethodStyle, scale: float = 1.0, *, hollow: bool = False) -> Markup:
    """A method's mark."""
    size = "" if scale == 1.0 else f" scale({scale:g})"
    kind = f"dot hollow {style.name}" if hollow else f"dot {style.name}"
    return tag("path", d=MARKS[style.shape], transform=f"translate({x:.1f} {y:.1f}){size}", class_=kind)


def names_beside(
    places: Sequence[tuple[float, float]],
    names: Sequence[str],
    room: Box,
    whiskers: Iterable[tuple[float, float, float]] = (),
) -> list[Markup]:
    """The names of marks, each where it covers no mark and no other; one without such a place is left out.

    room: where names may stand. whiskers: upright strokes to keep free, as x, top and bottom.
    """
    occupied: list[Box] = [(x - 6, y - 6, x + 6, y + 6) for x, y in places]
    occupied += [(x - 1, top, x + 1, bottom) for x, top, bottom in whiskers]
    boxes = []
    for (x, y), name in zip(places, names, strict=True):
        long = LETTER * len(name)
        for dx, dy in ((9.0, 3.5), (-9.0 - long, 3.5), (-long / 2, -9.0), (-long / 2, 17.0)):
            box = (x + dx, y + dy - 9, x + dx + long, y + dy + 2)
            inside = all((box[0] >= room[0], box[1] >= room[1], box[2] <= room[2], box[3] <= room[3]))
            if inside and not any(_meet(box, other) for other in occupied):
                occupied.append(box)
                boxes.append(words(x + dx, y + dy, name, "start", class_="name", aria_hidden="true"))
                break
    return boxes


def _meet(a: Box, b: Box) -> bool:
    """True if two boxes overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def line(points: Iterable[tuple[float, float]], style: MethodStyle, dash: str = "") -> Markup:
    """A method's line through points, in their order; dash: instead of its own."""
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return tag("path", d=path, class_=f"line {style.name}", stroke_dasharray=DASHES[dash or style.dash])


def band(
    low: Sequence[tuple[float, float]], high: Sequence[tuple[float, float]], style: MethodStyle
) -> Markup:
    """The area between two lines over the same places."""
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in [*low, *reversed(high)]) + "Z"
    return tag("path", d=path, class_=f"band {style.name}")


# ---------------------------------------------------------------------------------------------- scales
FINE = (1, 2, 5), (1, 3), (1,)
"""Ticks in a power of ten."""


@dataclass(frozen=True)
class Scale:
    """From numbers to places: ``low`` is at ``start``, ``high`` at ``end``; beyond them, at the ends."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    @classmethod
    def of(cls, axis: Axis, start: float, end: float) -> Scale:
        return cls(axis.low, axis.high, start, end, axis.log)

    def __call__(self, number: float) -> float:
        share = (self._at(number) - self._at(self.low)) / (self._at(self.high) - self._at(self.low))
        return self.start + min(1.0, max(0.0, share)) * (self.end - self.start)

    def _at(self, number: float) -> float:
        return math.log10(max(number, 1e-12)) if self.log else number

    def ticks(self, most: int = 6) -> list[float]:
        """Round numbers within the scale, at most about so many."""
        if self.log:
            return next(ticks for fine in FINE if len(ticks := self._decades(fine)) <= most or fine == (1,))
        rough = (self.high - self.low) / most
        unit = 10.0 ** math.floor(math.log10(rough))
        step = next(m * unit for m in (1, 2, 5, 10) if m * unit >= rough * 0.999)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]

    def _decades(self, fine: Sequence[int]) -> list[float]:
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        ticks = (m * 10.0**p for p in powers for m in fine)
        return [each for each in ticks if self.low * 0.999 <= each <= self.high * 1.001]


def axes(x: Axis, y: Axis, across: Scale, up: Scale, title: str) -> Markup:
    """The grid, ticks and labels of a chart."""
    left, right, low, high = across.start, across.end, up.start, up.end
    parts = []
    for at, text in _ticks(y, up, 5):
        parts += [grid_line(left, up(at), right, up(at)), words(left - 5, up(at) + 3.5, text, "end")]
    parts += [*_below(x, across, low, high), words(left, high - 8, title, "start", class_="title")]
    turn = f"translate(11 {(low + high) / 2:.1f}) rotate(-90)"
    parts.append(words(0.0, 0.0, y.label, transform=turn, class_="label"))
    return tag("g", *parts, class_="axes", aria_hidden="true")


def row_axis(
    x: Axis, across: Scale, low: float, high: float, names: Sequence[str], title: str, room: float
) -> Markup:
    """A vertical grid with an axis below, and names of rows at the left, so many units before the chart."""
    parts = [*_below(x, across, low, high), words(2.0, 14.0, title, "start", class_="title")]
    step = (low - high) / max(1, len(names))
    for row, name in enumerate(names):
        y = high + step * (row + 0.5) + 3.5
        parts.append(words(across.start - room, y, short(name, LONGEST), "end"))
    return tag("g", *parts, class_="axes", aria_hidden="true")


def _below(axis: Axis, scale: Scale, low: float, high: float) -> list[Markup]:
    """Vertical lines between two heights, with the ticks and the label of an axis below."""
    parts = []
    for at, text in _ticks(axis, scale, 6):
        parts += [grid_line(scale(at), low, scale(at), high), words(scale(at), low + 14, text)]
    return [*parts, words((scale.start + scale.end) / 2, low + 30, axis.label, class_="label")]


def _ticks(axis: Axis, scale: Scale, most: int) -> list[tuple[float, str]]:
    return list(axis.ticks) or [(each, f"{each:,.10g}") for each in scale.ticks(most)]


def grid_line(x1: float, y1: float, x2: float, y2: float, kind: str | None = None) -> Markup:
    return tag("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=kind)


def shade(share: float) -> Markup:
    """The class of a place on the scale of errors, from 0 (none) to 1 (as bad as it is drawn)."""
    return Markup(f"s{palette.shade(share)}")


# ------------------------------------------------------------------------------------------------ style
LIFT = 0.45
"""Share by which colours move towards white on dark paper."""


def rules(styles: Iterable[MethodStyle]) -> str:
    """CSS for the classes of methods and of the colour scale of errors, light and dark."""
    styles = list(styles)
    light = "".join(f".{each.name}{{--c:{each.colour}}}" for each in styles)
    dark = "".join(f".{each.name}{{--c:{_lifted(each.colour)}}}" for each in styles)
    scale = "".join(
        f".s{step}{{--c:{_hex(rgb)};--on:{palette.ink(rgb)}}}" for step, rgb in enumerate(palette.shades())
    )
    return f"{light}{scale}@media screen and (prefers-color-scheme:dark){{{dark}}}"


def _lifted(colour: str) -> str:
    """Lighter, for dark paper: its hue and its place among the others stay."""
    rgb = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    hue, light, full = colorsys.rgb_to_hls(*rgb)
    return _hex(colorsys.hls_to_rgb(hue, light + LIFT * (1 - light), full))


def _hex(rgb: Sequence[float]) -> str:
    return "#" + "".join(f"{round(255 * each):02x}" for each in rgb)
