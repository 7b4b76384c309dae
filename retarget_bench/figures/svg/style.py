"""CSS of charts in a page: colours of methods and errors, on light and dark paper."""

import colorsys
from collections.abc import Iterable, Sequence

from retarget_bench.figures import palette
from retarget_bench.figures.palette import MethodStyle

LIFT = 0.45
"""How far colours are moved towards white on dark paper."""


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
