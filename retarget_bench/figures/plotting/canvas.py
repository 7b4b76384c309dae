"""Charts as files, in the sizes of papers, with titles and legends."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import BenchError
from retarget_bench.figures import palette
from retarget_bench.figures.data.model import BEYOND, Chart
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
def notes(charts: Sequence[Chart]) -> list[str]:
    """How charts are read."""
    shown = [(chart.value, each) for chart in charts for each in chart.series]
    needed = {
        "whiskers: 95 %": any(mark.mean.interval is not None for _, each in shown for mark in each.marks),
        "hollow: not ranked": any(each.unranked for _, each in shown),
        "arrowheads: off the scale": any(each.groups(axis).keys() & {*BEYOND} for axis, each in shown),
    }
    return [note for note, is_needed in needed.items() if is_needed]


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


def shortened(name: str, most: int) -> str:
    """A name in so many letters; what is left out is in the middle, for parameters stand at the end."""
    text = drawable(name)
    return text if len(text) <= most else f"{text[: most - most // 2 - 1]}…{text[-(most // 2) :]}"


def errors_map() -> Any:
    """The colour scale of errors."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(palette.shades(), "errors")
