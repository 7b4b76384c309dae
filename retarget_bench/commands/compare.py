"""``bench compare``: two methods, or one method in two folders of results, value by value."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from retarget_bench.commands import declared, options
from retarget_bench.options import listed, option
from retarget_bench.tables.comparing import PairOptions

if TYPE_CHECKING:
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.results.store import ResultPaths
    from retarget_bench.tables.comparing import Pair

FORMATS = ("text", "md", "csv")


class Options(options.ToFile, options.OfResults, PairOptions):
    """``bench compare``."""

    format: Literal["", "text", "md", "csv"] = option(
        "Format.", default="", shown="by the ending of -o, else text", letter="f"
    )


@click.command("compare")
@click.argument("first")
@click.argument("second")
@declared.takes(Options, "first", "second")
def command(options: Options) -> None:
    """Compare two methods case by case: difference, interval, p-value and a verdict for every value.

    FIRST and SECOND are methods as tables call them, or two folders of results: then every method that
    is in both is compared with itself, as after a change.
    """
    from retarget_bench.analysis.selection import of_bodies
    from retarget_bench.results import store
    from retarget_bench.tables import comparing
    from retarget_bench.tables.rendering.pairwise_text import RENDERERS

    form = options.form(options.format, FORMATS)
    first, second = options.first, options.second
    folders = [Path(name) for name in (first, second)]
    wanted, splits = listed(options.columns) if options.columns else None, listed(options.splits)
    if all(folder.is_dir() and store.find_results(folder) for folder in folders):
        places = options.of(folders).places()
        matrices = of_bodies(_matrices(places, splits), options.bodies)
        both = [(matrix, _pairs(matrix, *folders)) for matrix in matrices]
        found = comparing.compared(first, second, both, wanted, options.all)
    else:
        matrices = of_bodies(_matrices(options.places(), splits), options.bodies)
        found = comparing.compare(matrices, first, second, wanted, options.all)
    options.write(_text(found) if form == "text" and options.out is None else RENDERERS[form](found))


def _text(found: Sequence[object]) -> str:
    """The comparisons as wide as the terminal."""
    from retarget_bench.tables.rendering.pairwise_text import text

    return text(found, options.screen_width())  # type: ignore[arg-type]


def _pairs(matrix: ResultMatrix, first: Path, second: Path) -> list[Pair]:
    """Every method that has results in both folders, with itself."""
    one, two = (
        {row.header.method.label: row for row in matrix.rows if row.paths.root == folder}
        for folder in (first, second)
    )
    return [(row, two.get(label)) for label, row in one.items()]


def _matrices(places: Sequence[ResultPaths], splits: Sequence[str]) -> list[ResultMatrix]:
    """The results of all methods that tables rank.

    Self pairs are read whatever the splits: some values of other splits pool them.
    """
    from retarget_bench.analysis.selection import of_splits
    from retarget_bench.api import SELF
    from retarget_bench.results import result_matrix as matrix

    chosen = {place.split for place in of_splits(places, splits)}
    read = [place for place in places if place.split in {*chosen, SELF}]
    return [each for each in matrix.result_matrices(read) if each.split in chosen]
