"""Colours and line styles of methods and motions, and the colour scale of errors.

Nine colours that stay apart for people who are colour-blind, of which any two that follow each other
differ in grey too, each dark enough for a thin line on white (a contrast of 3). Beyond nine they start
again: marks and dashes tell methods apart then. What a colour says is always said by something else as
well.
"""

from dataclasses import dataclass

COLOURS = (
    "#0a4d9b",
    "#c85800",
    "#6600ff",
    "#01a875",
    "#7a2a56",
    "#c870a4",
    "#5b4301",
    "#3f79f4",
    "#555d3e",
)
"""Of methods, by their rank in the table."""
CONTROLS = ("#444444", "#757575", "#949494")
"""Of rows that bound the scale, and of variants of methods."""
SOURCE = "#808080"
REFERENCE = "#1a1a1a"
SHAPES = 8
"""Shapes of marks that every backend has: circle, square, diamond, two triangles, plus, cross, star."""
DASHES = ("full", "dash-dot", "long")
"""Lines of methods; every eight methods the next. Those of controls and variants are dashed, of methods
that see more than others dotted."""

SHADES = 12
"""Steps of the colour scale of errors, from pale to dark."""
LIGHTEST, MIDDLE, DARKEST = (0.953, 0.925, 0.835), (0.871, 0.510, 0.255), (0.290, 0.043, 0.122)
"""Sand, orange and wine; between them lightness falls evenly, so that the scale says the same in grey."""


@dataclass(frozen=True)
class MethodStyle:
    """The colour, mark and line of a method.

    name: ``m3``, ``c0`` of a control or variant: its place, and the class of its marks on a page. shape: of
    its marks, below ``SHAPES``. dash: of its lines: full, dashed, dotted, dash-dot or long.
    quiet: whether charts show it only when asked to.
    """

    name: str
    colour: str
    shape: int
    dash: str
    quiet: bool = False


def method_style(place: int, *, quiet: bool = False, privileged: bool = False) -> MethodStyle:
    """The style of the method at a place among the methods, or, quiet, of the control or variant among
    these.

    Colours, marks and dashes turn at different paces, so that no two of the first 24 are alike.
    """
    again, shape = divmod(place, SHAPES)
    if quiet:
        return MethodStyle(f"c{place}", CONTROLS[place % len(CONTROLS)], shape, "dashed", True)
    dash = "dotted" if privileged else DASHES[again % len(DASHES)]
    return MethodStyle(f"m{place}", COLOURS[place % len(COLOURS)], shape, dash)


# ------------------------------------------------------------------------------------------ colour scale
def shade(share: float) -> int:
    """The step of the scale of errors, for a share from 0 (none) to 1 (as bad as it is drawn)."""
    return int(min(1.0, max(0.0, share)) * (SHADES - 1e-9))


def shades() -> list[tuple[float, float, float]]:
    """Red, green and blue of every step, from 0 to 1."""
    return [_between(k / (SHADES - 1)) for k in range(SHADES)]


def _between(share: float) -> tuple[float, float, float]:
    low, high, part = (LIGHTEST, MIDDLE, 2 * share) if share < 0.5 else (MIDDLE, DARKEST, 2 * share - 1)
    red, green, blue = (a + part * (b - a) for a, b in zip(low, high, strict=True))
    return red, green, blue
