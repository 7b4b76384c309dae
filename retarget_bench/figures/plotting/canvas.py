"""Shared parts of charts in files: figures in the sizes of papers, legends, and formats."""

from __future__ import annotations

import math
import textwrap
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order, palette
from retarget_bench.files import atomic
from retarget_bench.results.header import ResultHeader

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from retarget_bench.figures.data import model

ENDINGS = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
"""Kind of file -> what else it would say of the time or program that made it."""
WIDTHS = {"column": 3.25, "page": 6.75}
"""Inches: a column and both columns of the narrowest two-column papers, so that 8 points stay 8 points."""
MARKS = "osD^vPX*"
DASHES = {"full": "-", "dashed": "--", "dotted": ":", "dash-dot": "-.", "long": (0, (10, 3))}
LETTER = 0.056
"""Inches that a letter of the legend takes on average, rather too much than too little."""
HEADING = 0.14
"""Inches of another line of a name above a panel."""
LONGEST = 60
BEYOND = "outside: off the scale"
RC_PARAMS: dict[str, Any] = {
    "font.size": 8, "axes.titlesize": 8, "axes.labelsize": 8, "figure.titlesize": 8, "figure.labelsize": 8,
    "xtick.labelsize": 7, "ytick.labelsize": 7, "legend.fontsize": 7,
    "axes.grid": True, "grid.alpha": 0.3, "grid.linewidth": 0.5, "axes.linewidth": 0.6,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42, "svg.fonttype": "none", "svg.hashsalt": "retarget-bench",
    "text.parse_math": False, "text.usetex": False,
}  # fmt: skip
"""PDFs embed fonts as TrueType, which publishers ask for; SVG has words as text. Names are
drawn as they are, whatever signs they have."""


@dataclass(frozen=True)
class Page:
    """The size of a picture. width: in inches. titled: whether it has a title, like a caption.

    ranked: label -> a header, of all methods that there are results of, in the order of
    ``method_order.ranked``: a method keeps its colour, whichever of them a picture shows.
    """

    width: float = WIDTHS["page"]
    titled: bool = True
    ranked: Mapping[str, ResultHeader] = field(default_factory=dict)

    def across(self, width: float) -> int:
        """Number of panels of so many inches side by side: one at least."""
        return max(1, int(self.width / width))


PAGE = Page()
MarkStyles = Mapping[str, Mapping[str, Any]]
"""Label -> matplotlib properties of its lines and marks."""


def ending(path: Path) -> str:
    """``.png``, ``.pdf`` or ``.svg``. Raises BenchError for a file of another kind."""
    if path.suffix.lower() not in ENDINGS:
        raise BenchError(f"{path}: pictures are written as {', '.join(ENDINGS)}; end the name in one")
    return path.suffix.lower()


@contextmanager
def drawn(path: Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches, which is written to the file when it is done. Raises FileError.

    The same picture is the same file, byte for byte, whenever it is made, and whatever the user has set up.
    """
    from matplotlib import style
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    form = ending(path)
    with style.context(["default", RC_PARAMS]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # a letter that no font has is a box
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with atomic(path) as temporary:
            figure.savefig(temporary, dpi=200, format=form[1:], metadata=ENDINGS[form])


def drawable(name: str) -> str:
    """A name as it can be drawn: on one line, of a length that fits, not hidden for its first letter."""
    clean = "".join(c if c.isprintable() else " " for c in name.encode("utf-8", "replace").decode())
    clean = " ".join(clean.split())
    if len(clean) > LONGEST:
        clean = f"{clean[: LONGEST // 2]}…{clean[-LONGEST // 2 + 1 :]}"
    return f"\u200a{clean}" if clean.startswith("_") else clean or "(no name)"


def short(number: float) -> str:
    """Two decimals, or as many as four signs have room for."""
    decimals = 2 if abs(number) < 9.995 else 1 if abs(number) < 99.95 else 0
    return f"{number:.{decimals}f}"


def title(figure: Figure, page: Page, data: model.Figure) -> None:
    """Add the title of the charts above them, where the page has titles."""
    if page.titled:
        notes = "; ".join(note for note in (data.note, BEYOND if data.far else "") if note)
        text = f"{drawable(data.dataset)}: {drawable(data.title)}" + (f" ({notes})" if notes else "")
        figure.suptitle(wrapped(text, page.width))


def wrapped(text: str, width: float) -> str:
    """On as many lines as it needs within so many inches."""
    return "\n".join(textwrap.wrap(text, max(1, int(width / LETTER))))


def heading(name: str, width: float) -> str:
    """A method's name above a panel of so many inches: one that is too long has its parameters below it."""
    text = drawable(name)
    if LETTER * len(text) <= width:
        return text
    parts = text.replace("[", "\n[", 1).splitlines()
    return "\n".join(wrapped(part, 1.1 * width) for part in parts)  # panels stand a little apart


def headed(names: Sequence[str], width: float) -> float:
    """Inches that the names above panels take beyond one line each."""
    return HEADING * max(heading(name, width).count("\n") for name in names)


def mark_styles(headers: Mapping[str, ResultHeader], page: Page = PAGE) -> dict[str, dict[str, Any]]:
    """Label -> matplotlib properties of its lines and marks, the same in every panel.

    headers: label -> the header of its results. Colours are by rank where the page knows it, else in the
    order of the headers.
    """
    return {
        label: {
            "color": style.colour, "linestyle": DASHES[style.dash], "marker": MARKS[style.shape],
            "markersize": 3.5, "linewidth": 1.2,
        }
        for label, style in method_order.styles({**page.ranked, **headers}).items()
        if label in headers
    }  # fmt: skip


def errors_map() -> Any:
    """The colour scale of errors."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(palette.shades(), "errors")


def legend(figure: Figure, panels: Sequence[Any]) -> None:
    """One legend for all panels, below them; the figure grows by its height."""
    handles: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if not handles:
        return
    longest = max(len(line) for label in handles for line in label.splitlines())
    columns = min(len(handles), max(1, int(figure.get_figwidth() / (0.5 + LETTER * longest))))
    rows = math.ceil(len(handles) / columns)
    lines = max(label.count("\n") + 1 for label in handles)
    figure.set_figheight(figure.get_figheight() + 0.15 * rows * lines + 0.1)
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", frameon=False,
                  ncols=columns, handlelength=2.6)  # fmt: skip


# -------------------------------------------------------------------------- marks beyond the end of an axis
SIZE = 5.5
"""Points: letters of numbers at the edge."""
DIGIT = 0.62
"""Width of a digit, in heights of letters."""
MARK = 6.0
"""Points: a mark at the edge and the gap behind it."""
NUMBERS = 2
"""Most numbers beside a row."""
LINE = 7.0
"""Points between two rows of marks above a panel."""


def filled(mark: model.Mark, styles: MarkStyles) -> dict[str, Any]:
    """The matplotlib properties of a mark without a line."""
    hollow = {"markerfacecolor": "white"} if mark.hollow else {}
    return {**styles[mark.method], **hollow, "linestyle": "none"}


def far_beside(panel: Any, far: Sequence[model.Mark], styles: MarkStyles) -> float:
    """Draw marks beyond the axis at the right of the panel, the farthest first in each row; of more than
    ``NUMBERS`` only the first has its number. Returns the points that the longest row takes."""
    longest = 0.0
    for row in {mark.at for mark in far}:
        here = sorted((mark for mark in far if mark.at == row), key=lambda mark: -mark.mean.value)
        out = 0.5 * MARK
        for place, mark in enumerate(here):
            text = short(mark.mean.value) if place == 0 or len(here) <= NUMBERS else ""
            _mark(panel, panel.get_yaxis_transform(), (1.0, row), (out, 0.0), text, filled(mark, styles))
            out += _wide(text)
        longest = max(longest, out)
    return longest


def far_above(panels: Sequence[tuple[Any, Any]], styles: MarkStyles) -> None:
    """Draw the marks beyond the y axis above each panel of a chart, in rows where marks would overlap;
    titles give way."""
    most = max((_above(panel, chart.far, styles) for panel, chart in panels), default=0)
    for panel, _ in panels if most else ():
        panel.set_title(panel.get_title(), pad=LINE * (most + 0.6))


def _above(panel: Any, far: Sequence[model.Mark], styles: MarkStyles) -> int:
    """Draw the marks of one panel; returns the number of rows that they take."""
    along = panel.get_xaxis_transform()
    rows: list[list[tuple[float, float]]] = []
    for mark in sorted(far, key=lambda mark: (mark.at, mark.mean.value)):
        text = short(mark.mean.value)
        at = float(along.transform((mark.at, 1.0))[0])
        left = at > panel.bbox.x0 + 0.5 * panel.bbox.width
        middle = 72.0 * at / panel.figure.dpi
        low, high = (-_wide(text), MARK) if left else (-MARK, _wide(text))
        span = middle + low, middle + high
        free = (k for k, row in enumerate(rows) if all(span[1] < a or b < span[0] for a, b in row))
        row = next(free, len(rows))
        rows += [[]] if row == len(rows) else []
        rows[row].append(span)
        _mark(
            panel, along, (mark.at, 1.0), (0.0, LINE * (row + 0.6)), text, filled(mark, styles), left=left
        )
    return len(rows)


def _wide(text: str) -> float:
    return MARK + DIGIT * SIZE * len(text)


def _mark(
    panel: Any,
    along: Any,
    at: tuple[float, float],
    out: tuple[float, float],
    text: str,
    style: Mapping[str, Any],
    *,
    left: bool = False,
) -> None:
    """A mark so many points outside the panel, and its number at its right or left."""
    from matplotlib.transforms import ScaledTranslation

    moved = along + ScaledTranslation(out[0] / 72.0, out[1] / 72.0, panel.figure.dpi_scale_trans)
    plain = {**style, "linestyle": "none", "markersize": min(3.5, style["markersize"])}
    panel.plot(*([each] for each in at), transform=moved, clip_on=False, **plain)
    panel.annotate(
        text, at, (out[0] + (-0.6 if left else 0.6) * MARK, out[1]), xycoords=along, fontsize=SIZE,
        textcoords="offset points", va="center", ha="right" if left else "left", annotation_clip=False,
    )  # fmt: skip
