"""Tables, comparisons and players as objects that print as text and that notebooks show."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Sequence
from functools import cache, cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import pandas as pd

from retarget_bench import files
from retarget_bench.analysis.pairwise import PairwiseComparison
from retarget_bench.errors import BenchError
from retarget_bench.python.arguments import checked
from retarget_bench.tables import rendering
from retarget_bench.tables.model import Cell, Column, Group, Row, Table
from retarget_bench.tables.rendering import as_html, pairwise_text
from retarget_bench.viewer import player
from retarget_bench.viewer.packing import packed
from retarget_bench.viewer.scene import Scene

ENDINGS = {".txt": "text", ".md": "md", ".tex": "tex", ".html": "html", ".csv": "csv", ".json": "json"}
"""Ending of a file -> the format that a table is written to it in."""


class ListFrame(pd.DataFrame):
    """A data frame that shows its rows and texts whole."""

    @property
    def _constructor(self) -> type[ListFrame]:
        return ListFrame

    def __repr__(self) -> str:
        texts = self.select_dtypes(["object", "str"])
        widths = {str(name): max(map(len, texts[name].map(str)), default=0) for name in texts}
        left: dict[str, Callable[..., str]] = {
            each: f"{{:<{width}}}".format for each, width in widths.items()
        }
        return self.to_string(formatters=left, justify="left")

    def _repr_html_(self) -> str:
        left = "<style>.rb-list :is(th, td) { text-align: left !important; }</style>"
        with pd.option_context("display.max_colwidth", None):
            return left + self.to_html(classes="rb-list")


class TableView:
    """The tables of some results: text by ``str``, rich in notebooks, numbers in ``frame``.

    make: format -> the tables of the data sets as ``bench table`` lays them out for it.
    """

    def __init__(self, make: Callable[[str], Sequence[Table]]) -> None:
        self._tables = cache(make)

    def __str__(self) -> str:
        return rendering.text(self._tables("text"))

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return as_html.fragment(self._tables("text"))

    @cached_property
    def frame(self) -> pd.DataFrame:
        """A row per cell: ``dataset``, ``split``, ``group`` (its title), ``method``, ``ranked``,
        ``value_id``, ``label``, ``unit``, ``value`` (not a number: missing, and ``reason`` says why),
        ``low`` and ``high`` (95 % interval), ``mark`` (``best``, ``tied`` or nothing), ``place`` (1: the
        best of the ranked), ``cases``, ``clips``. In a breakdown ``part`` is the line."""
        rows = [
            _facts(table, group, row, column, cell)
            for table in self._tables("csv")
            for group in table.groups
            for row in group.rows
            for column, cell in zip(group.columns, row.cells, strict=True)
        ]
        return pd.DataFrame(rows, columns=FACTS)

    def best(self) -> pd.DataFrame:
        """The best of the ranked methods: a line per value, a column per split.

        Methods tied with the best follow after ``=``; ``(not tested)`` stands where there are too few clips
        to tell. In a breakdown: of every part.
        """
        ranked = self.frame[self.frame["place"].notna()].sort_values("place", kind="stable")
        keys = ["dataset", "group", "part", "value_id", "split"]
        cells = [(*key, _best(each)) for key, each in ranked.groupby(keys, sort=False)]
        best = pd.DataFrame(cells, columns=[*keys, "best"])
        by = [each for each in ("dataset", "part") if best[each].nunique() > 1]
        shown = best.pivot(index=[*by, "value_id"], columns="split", values="best")
        order = {each: number for number, each in enumerate(self.frame["value_id"].unique())}
        shown = shown.sort_index(level="value_id", key=lambda ids: ids.map(order), sort_remaining=False)
        return ListFrame(shown[[each for each in self.frame["split"].unique() if each in shown]])

    @checked
    def save(self, path: str | PathLike[str]) -> Path:
        """Write the tables as .txt, .md, .tex (booktabs), .html, .csv or .json, and return the path."""
        path = Path(path)
        if (form := ENDINGS.get(path.suffix.lower())) is None:
            raise BenchError(f"{path}: tables are written as {', '.join(ENDINGS)}; end the name in one")
        files.write_text(path, rendering.RENDERERS[form](self._tables(form)))
        return path


def _best(ranked: pd.DataFrame) -> str:
    """The best of some methods, best first, and those tied with it."""
    if not ranked["mark"].any():
        return f"{ranked['method'].iloc[0]} (not tested)"
    return " = ".join(ranked.loc[ranked["mark"] != "", "method"])


FACTS = (
    *("dataset", "split", "group", "part", "method", "ranked", "value_id", "label", "unit", "value"),
    *("low", "high", "mark", "place", "cases", "clips", "reason"),
)


def _facts(table: Table, group: Group, row: Row, column: Column, cell: Cell) -> tuple[Any, ...]:
    low, high = (cell.interval.low, cell.interval.high) if cell.interval else (None, None)
    subject = next((each for each in table.subjects if each.id == group.subject), None)
    part, method = (row.label, column.label) if group.subject else ("", row.label)
    of = subject or column
    place = None if cell.place is None else cell.place + 1
    ranked = not (column.mark if group.subject else row.mark)
    return (
        *(table.title, group.split, group.title, part, method, ranked, of.id, of.label, of.unit),
        *(cell.value, low, high, cell.mark, place, cell.n, cell.clips, cell.reason),
    )


class Comparison:
    """Two methods compared value by value: text by ``str``, numbers in ``frame``.

    splits: the comparison of each split.
    """

    def __init__(self, comparisons: Sequence[PairwiseComparison]) -> None:
        self.splits = tuple(comparisons)

    def __str__(self) -> str:
        return pairwise_text.text(self.splits)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return f'<pre style="white-space: pre; overflow-x: auto;">{html.escape(str(self))}</pre>'

    @cached_property
    def frame(self) -> pd.DataFrame:
        """A row per split and value (of values of sets also per ``structure``): both means, their
        ``difference``, its 95 % interval (``low``, ``high``), ``p``, ``p_adjusted`` (see
        ``bench compare``), ``cases``, ``clips``, ``verdict``.
        """
        text = io.StringIO(pairwise_text.comma_separated(self.splits))
        return ListFrame(pd.read_csv(text, keep_default_na=False, na_values=[""], dtype=TEXTS))


TEXTS = dict.fromkeys(("dataset", "split", "first", "second", "value", "structure", "verdict"), "str")
"""Columns of a comparison that hold texts, whatever these look like."""


class Player:
    """Motion to look at: rich in notebooks; ``save`` writes a page that opens from disk.

    overlay: all figures in one picture. labels: of the figures that are shown at first; none: all.
    """

    def __init__(self, scene: Scene, overlay: bool = False, labels: Sequence[str] = ()) -> None:
        self.scene = scene
        self.options = {"overlay": overlay} | ({"labels": list(labels)} if labels else {})

    def __repr__(self) -> str:
        shown = ", ".join(figure.label for figure in self.scene.figures if figure.positions is not None)
        lasts = f"{self.scene.frames} frames, {self.scene.frames / self.scene.fps:.1f} s"
        return f"<Player of {self.scene.title}: {shown}; {lasts}; .save(FILE.html) writes it as a page>"

    @cached_property
    def html(self) -> str:
        """The page. Raises BenchError where positions are not finite."""
        return player.page(packed(self.scene), self.options)

    def _repr_html_(self) -> str:
        frame = 'style="width: 100%; height: 48rem; border: 0;"'
        return f'<iframe title="player" srcdoc="{html.escape(self.html)}" {frame}></iframe>'

    @checked
    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page, whose name ends in .html, and return its path."""
        path = Path(path)
        if path.suffix.lower() not in (".html", ".htm"):
            raise BenchError(f"{path}: a player is a page; end its name in .html")
        files.write_text(path, self.html)
        return path
