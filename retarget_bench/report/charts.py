"""Charts as inline SVG: a few shapes, scales and axes, with words for those who do not see them.

Colours are the page's own, by class (``m0``, ``m1``, ...), so that they follow light and dark; lines
differ in dashes and marks in shape too. A mark that can be clicked is a ``pick``: what it stands for is in
its data attributes, and the page's script finds the cases behind it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup, escape

from retarget_bench.figures.palette import COLOURS
from retarget_bench.tables.rendering.words import printable

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
"""Outlines about the origin, some ten units across."""
DASHES = ("", "7 3", "2 3", "9 3 2 3")
CONTROL_DASH = "1 4"


@dataclass(frozen=True)
class ChartStyle:
    """How a method is drawn: its class on the page, its mark's outline, its line's dashes."""

    name: str
    mark: str
    dash: str


def look(index: int, control: int | None = None) -> ChartStyle:
    """Of the method at a place, counted from 0; control: its place among the controls, for one of those.

    Colours, marks and dashes turn at different paces, so that no two of the first 24 are alike.
    """
    if control is not None:
        return ChartStyle(f"c{control}", MARKS[control % len(MARKS)], CONTROL_DASH)
    return ChartStyle(f"m{index}", MARKS[index % len(MARKS)], DASHES[index // len(COLOURS) % len(DASHES)])


# -------------------------------------------------------------------------------------------- elements
def tag(name: str, *children: Any, **attributes: Any) -> Markup:
    """An element. ``_`` in names of attributes is ``-``; None leaves one out; all text is escaped."""
    told = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_text(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{told}>{Markup().join(map(_text, children))}</{name}>")


def _text(value: Any) -> Markup:
    if isinstance(value, float):
        return Markup(f"{value:.1f}".removesuffix(".0"))
    return Markup(value) if isinstance(value, Markup) else Markup(escape(printable(str(value))))


def svg(width: float, height: float, label: str, *children: Any) -> Markup:
    """A chart of so many units; label: what it shows, in words."""
    return tag(
        "svg",
        *children,
        viewBox=f"0 0 {width:g} {height:g}",
        role="group",
        aria_label=label,
        class_="chart",
        style=f"max-width:{1.45 * width:.0f}px",
    )


def pick(label: str, *children: Any, **data: Any) -> Markup:
    """A mark that leads to its cases. label: what it says, in words; data: what it stands for."""
    told = {f"data_{key}": value for key, value in data.items()}
    title = tag("title", label)
    return tag("g", title, *children, class_="pick", role="button", tabindex="-1", aria_label=label, **told)


def words(x: float, y: float, text: Any, anchor: str = "middle", **more: Any) -> Markup:
    """Text at a place."""
    return tag("text", text, x=x, y=y, text_anchor=anchor, **more)


def short(name: str, most: int) -> str:
    """A name in so many letters; what is left out is in the middle, for parameters stand at the end."""
    name = printable(name)
    return name if len(name) <= most else f"{name[: most - most // 2 - 1]}…{name[-(most // 2) :]}"


def mark(x: float, y: float, shown: ChartStyle, scale: float = 1.0) -> Markup:
    """A method's mark, with a ring that shows where the keyboard is."""
    size = "" if scale == 1.0 else f" scale({scale:g})"
    return tag(
        "path", d=shown.mark, transform=f"translate({x:.1f} {y:.1f}){size}", class_=f"dot {shown.name}"
    )


def line(points: Iterable[tuple[float, float]], shown: ChartStyle) -> Markup:
    """A method's line through points, in their order."""
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return tag("path", d=path, class_=f"line {shown.name}", stroke_dasharray=shown.dash or None)


def band(
    low: Sequence[tuple[float, float]], high: Sequence[tuple[float, float]], shown: ChartStyle
) -> Markup:
    """The area between two lines over the same places."""
    path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in [*low, *reversed(high)]) + "Z"
    return tag("path", d=path, class_=f"band {shown.name}")


# ---------------------------------------------------------------------------------------------- scales
FINE = (1, 2, 5), (1, 3), (1,)
"""Where ticks stand in a power of ten."""


@dataclass(frozen=True)
class Scale:
    """From numbers to places: ``low`` is at ``start``, ``high`` at ``end``; beyond them, at the ends."""

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, number: float) -> float:
        share = (self._at(number) - self._at(self.low)) / (self._at(self.high) - self._at(self.low))
        return self.start + min(1.0, max(0.0, share)) * (self.end - self.start)

    def _at(self, number: float) -> float:
        return math.log10(max(number, 1e-12)) if self.log else number

    def ticks(self, most: int = 6) -> list[float]:
        """Round numbers within the scale, at most about so many."""
        if self.log:
            return next(found for fine in FINE if len(found := self._decades(fine)) <= most or fine == (1,))
        rough = (self.high - self.low) / most
        unit = 10.0 ** math.floor(math.log10(rough))
        step = next(m * unit for m in (1, 2, 5, 10) if m * unit >= rough * 0.999)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]

    def _decades(self, fine: Sequence[int]) -> list[float]:
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        found = (m * 10.0**p for p in powers for m in fine)
        return [each for each in found if self.low * 0.999 <= each <= self.high * 1.001]


@dataclass(frozen=True)
class Frame:
    """The box of a chart with two scales."""

    x: Scale
    y: Scale
    label_x: str = ""
    label_y: str = ""
    title: str = ""

    def drawn(self, names: Mapping[float, str] | None = None) -> Markup:
        """Grid, ticks, and labels. names: ticks of x and what they are called, where not by numbers."""
        left, right, low, high = self.x.start, self.x.end, self.y.start, self.y.end
        parts = []
        for each in self.y.ticks(5):
            at = self.y(each)
            parts += [_grid(left, at, right, at), words(left - 5, at + 3.5, f"{each:g}", "end")]
        for each in names or self.x.ticks():
            at = self.x(each)
            text = names[each] if names else f"{each:g}"
            parts += [_grid(at, low, at, high), words(at, low + 14, text)]
        middle = (left + right) / 2
        parts.append(words(middle, low + 30, self.label_x, class_="label"))
        turn = f"translate(11 {(low + high) / 2:.1f}) rotate(-90)"
        parts.append(words(0.0, 0.0, self.label_y, transform=turn, class_="label"))
        parts.append(words(left, high - 8, self.title, "start", class_="title"))
        return tag("g", *parts, class_="axes", aria_hidden="true")


def _grid(x1: float, y1: float, x2: float, y2: float) -> Markup:
    return tag("line", x1=x1, y1=y1, x2=x2, y2=y2)


# -------------------------------------------------------------------------------------------- colouring
def shade(share: float) -> Markup:
    """The class of a place on the scale of errors, from 0 (none) to 1 (as bad as it is drawn)."""
    return Markup(f"s{int(min(1.0, max(0.0, share)) * (SHADES - 1e-9))}")


SHADES = 12
"""Steps of the scale of errors, from pale to dark."""
