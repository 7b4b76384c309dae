"""Colours of a report: methods by their rank, for light and for dark paper, and a scale for errors."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping, Sequence

from retarget_bench.figures import method_order, palette
from retarget_bench.report.chapters import Chapter
from retarget_bench.report.charts import SHADES, ChartStyle, look
from retarget_bench.results.header import ResultHeader

LIGHTEST, DARKEST = (0.953, 0.925, 0.835), (0.290, 0.043, 0.122)
"""The ends of the scale of errors, sand and wine; between them lightness falls evenly."""
MIDDLE = (0.871, 0.510, 0.255)
LIFT = 0.45
"""How far colours are moved towards white on dark paper."""


def looks(chapters: Sequence[Chapter], ranked: Mapping[str, ResultHeader]) -> dict[str, ChartStyle]:
    """Label -> its look, the same on the whole page; controls are grey.

    ranked: label -> a header, of all methods that there are results of, in the order of ``placing.ranked``,
    so that a method has its colour on every page and picture of these results.
    """
    found = {
        label: look(0, place) if control else look(place)
        for label, (place, control) in method_order.seats(ranked).items()
    }
    return {label: found[label] for chapter in chapters for label in chapter.labels}


def colours(shown: Mapping[str, ChartStyle]) -> dict[str, str]:
    """Label -> ``#rrggbb`` on light paper, as in the player and all other pictures."""
    return {label: _colour(each) for label, each in shown.items()}


def style(shown: Mapping[str, ChartStyle]) -> str:
    """Rules for the classes of methods and of the scale of errors, light and dark."""
    light = [f".{each.name}{{--c:{_colour(each)}}}" for each in shown.values()]
    dark = [f".{each.name}{{--c:{_lifted(_colour(each))}}}" for each in shown.values()]
    steps = [_step(k / (SHADES - 1)) for k in range(SHADES)]
    light += [_shade(k, colour) for k, colour in enumerate(steps)]
    dark += [_shade(k, colour) for k, colour in enumerate(steps)]
    return "".join(light) + "@media screen and (prefers-color-scheme:dark){" + "".join(dark) + "}"


def _colour(shown: ChartStyle) -> str:
    index = int(shown.name[1:])
    return palette.control(index) if shown.name.startswith("c") else palette.colour(index)


def _lifted(colour: str) -> str:
    """Lighter, for dark paper: its hue and its place among the others stay."""
    rgb = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    hue, light, full = colorsys.rgb_to_hls(*rgb)
    return _hex(colorsys.hls_to_rgb(hue, light + LIFT * (1 - light), full))


def _step(share: float) -> tuple[float, float, float]:
    low, high, part = (LIGHTEST, MIDDLE, 2 * share) if share < 0.5 else (MIDDLE, DARKEST, 2 * share - 1)
    red, green, blue = (a + part * (b - a) for a, b in zip(low, high, strict=True))
    return red, green, blue


def _shade(index: int, rgb: tuple[float, float, float]) -> str:
    """A step, and ink that can be read on it."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb]
    luminance = sum(k * c for k, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
    ink = "#000" if luminance > 0.179 else "#fff"
    return f".s{index}{{--c:{_hex(rgb)};--on:{ink}}}"


def _hex(rgb: Sequence[float]) -> str:
    return "#" + "".join(f"{round(255 * each):02x}" for each in rgb)
