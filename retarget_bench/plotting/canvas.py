"""What pictures share: a figure without a display, looks of methods, and a file by its ending."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from retarget_bench import palette
from retarget_bench.errors import BenchError
from retarget_bench.files import atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
"""Kind of file -> what else it would say of the time or program that made it."""
MARKS = "osD^vPX*"


def ending(path: Path) -> str:
    """``.png``, ``.pdf`` or ``.svg``. Raises BenchError for a file of another kind."""
    if path.suffix.lower() not in ENDINGS:
        raise BenchError(f"{path}: pictures are written as {', '.join(ENDINGS)}; end the name in one")
    return path.suffix.lower()


@contextmanager
def drawn(path: Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches, which is written to the file when it is done. Raises FileError.

    The same picture is the same file, byte for byte, whenever it is made.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    form = ending(path)
    look: Any = {"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "svg.hashsalt": "retarget-bench"}
    with mpl.rc_context(look):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        with atomic(path) as temporary:
            figure.savefig(temporary, dpi=150, format=form[1:], metadata=ENDINGS[form])


def looks(headers: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Label -> colour, line and mark, the same in every panel: controls grey and dashed, methods that see
    more than others dotted, all others in full lines.

    headers: label -> the header of its results.
    """
    found: dict[str, dict[str, Any]] = {}
    plain, controls = 0, 0
    for label, header in headers.items():
        if header["method"]["control"]:
            found[label] = {"color": palette.control(controls), "linestyle": "--"}
            controls += 1
        else:
            line = ":" if header["method"]["privileged"] else "-"
            found[label] = {"color": palette.colour(plain), "linestyle": line}
            plain += 1
        found[label] |= {"marker": MARKS[len(found) % len(MARKS)], "markersize": 4, "linewidth": 1.4}
    return found


def legend(figure: Figure, panels: Sequence[Any]) -> None:
    """One legend for all panels, at their right."""
    handles: dict[str, Any] = {}
    for panel in panels:
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        figure.legend(list(handles.values()), list(handles), loc="outside right upper", frameon=False)
