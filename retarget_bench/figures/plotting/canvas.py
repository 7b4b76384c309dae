"""Charts as files, in the sizes of papers, with titles and legends."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import BenchError
from retarget_bench.figures import palette
from retarget_bench.files import atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure


ENDINGS = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
"""Kind of file -> what else it would say of the time or program that made it."""
WIDTHS = {"column": 3.25, "page": 6.75}
"""Inches: a column and both columns of the narrowest two-column papers, so that 8 points stay 8 points."""
LETTER = 0.056
"""Inches that a letter takes on average, rather too much than too little."""
LINE, HANDLE = 0.155, 0.65
"""Inches: of a line of words, and of a line beside a name in a legend."""
LONGEST = 60
BEYOND = "arrowheads: off the scale"
HOLLOW = "hollow: not ranked"
RC_PARAMS: dict[str, Any] = {
    "font.size": 8, "axes.titlesize": 8, "axes.labelsize": 8, "figure.titlesize": 8, "figure.labelsize": 8,
    "xtick.labelsize": 7, "ytick.labelsize": 7, "legend.fontsize": 7,
    "axes.grid": True, "grid.alpha": 0.3, "grid.linewidth": 0.5, "axes.linewidth": 0.6,
    "axes.axisbelow": True, "xtick.major.size": 0, "ytick.major.size": 0,
    "pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "retarget-bench",
    "text.parse_math": False, "text.usetex": False,
}  # fmt: skip
"""PDFs embed fonts as TrueType, which publishers ask for; SVG has words as text. Names are
drawn as they are, whatever signs they have."""


def ending(path: Path) -> str:
    """``.png``, ``.pdf`` or ``.svg``. Raises BenchError for a file of another kind."""
    if path.suffix.lower() not in ENDINGS:
        raise BenchError(f"{path}: pictures are written as {', '.join(ENDINGS)}; end the name in one")
    return path.suffix.lower()


@contextmanager
def styled() -> Iterator[None]:
    """Figures look alike in here, whatever the user has set up."""
    from matplotlib import style

    with style.context(["default", RC_PARAMS]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a letter that no font has is a box
        yield


@contextmanager
def drawn(path: Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches, which is written to the file when it is done. Raises FileError.

    The same picture is the same file, byte for byte, whenever it is made.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    form = ending(path)
    with styled():
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with atomic(path) as temporary:
            figure.savefig(temporary, dpi=200, format=form[1:], metadata=ENDINGS[form])


# ------------------------------------------------------------------------------------------------- words
def drawable(name: str) -> str:
    """A name as it can be drawn: on one line, of a length that fits, not hidden for its first letter."""
    clean = "".join(c if c.isprintable() else " " for c in name.encode("utf-8", "replace").decode())
    clean = " ".join(clean.split())
    if len(clean) > LONGEST:
        clean = f"{clean[: LONGEST // 2]}…{clean[-LONGEST // 2 + 1 :]}"
    return f"\u200a{clean}" if clean.startswith("_") else clean or "(no name)"


def wrapped(text: str, width: float) -> str:
    """On as many lines as it needs within so many inches."""
    return "\n".join(textwrap.wrap(text, max(1, int(width / LETTER))))


def heading(name: str, width: float) -> str:
    """A method's name above a panel of so many inches: one that is too long has its parameters below it."""
    text = drawable(name)
    if LETTER * len(text) <= width:
        return text
    return "\n".join(wrapped(part, width) for part in text.replace("[", "\n[", 1).splitlines())


def errors_map() -> Any:
    """The colour scale of errors."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(palette.shades(), "errors")
