"""Colours of figures in pictures: roles, left and right, light and shadow."""

from collections.abc import Mapping
from functools import lru_cache
from itertools import cycle

from retarget_bench.figures import palette
from retarget_bench.viewer.scene import Figure, Scene

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

PAPER: Colour = (255, 255, 255)
STAGE: Colour = (244, 245, 247)
FLOOR: Colour = (232, 234, 238)
GRID: Colour = (196, 200, 208)
SHADOW: Colour = (205, 208, 214)
INK: Colour = (28, 30, 34)
FAINT: Colour = (96, 101, 110)
CONTACT: Colour = (255, 190, 0)
LIT: Colour = (255, 225, 0)
STRIPE: Colour = (20, 20, 20)
"""Self-penetration: lighter than every body, and striped, so that it shows without colours, too."""
TROUBLE: Colour = (170, 30, 30)
"""Words about what went wrong."""

LEFT, RIGHT = 0.42, 0.62
"""Share of white in the left of a body, and brightness of its right."""


def names(scene: Scene) -> list[str]:
    """``#rrggbb`` for every figure: methods' own where the scene knows them; else the palette's, in the
    order of the figures, those first that no method has."""
    roles = {"source": palette.SOURCE, "reference": palette.REFERENCE}
    own = {figure: _own(scene.colours, figure) for figure in scene.figures}
    used = {colour for colour in own.values() if colour}
    free = [colour for colour in palette.COLOURS if colour not in used]
    rest = cycle(free or palette.COLOURS)
    return [roles.get(figure.part) or own[figure] or next(rest) for figure in scene.figures]


def _own(colours: Mapping[str, str], figure: Figure) -> str | None:
    """The colour of a figure's method; all of its seeds have one."""
    method, seed, number = figure.label.rpartition(", seed ")
    return colours.get(figure.label) or (colours.get(method) if seed and number.isdecimal() else None)


def colours(scene: Scene) -> list[Colour]:
    """The same as numbers."""
    return [of_hex(each) for each in names(scene)]


def of_hex(colour: str) -> Colour:
    """``#rrggbb`` as numbers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def mixed(first: Colour, second: Colour, share: float) -> Colour:
    """The first with a share of the second in it."""
    a, b, c = (round(x + share * (y - x)) for x, y in zip(first, second, strict=True))
    return a, b, c


@lru_cache(maxsize=4096)
def shade(colour: Colour, bright: float) -> Colour:
    """Darker below 1, by mixing black in; lighter above, by mixing white in."""
    return (
        mixed((0, 0, 0), colour, bright) if bright <= 1.0 else mixed(colour, (255, 255, 255), bright - 1.0)
    )


def tints(colour: Colour) -> tuple[Colour, Colour, Colour]:
    """The middle, the left and the right of a body in a colour."""
    return colour, mixed(colour, (255, 255, 255), LEFT), shade(colour, RIGHT)
