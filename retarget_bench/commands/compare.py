"""``bench compare``: two methods, or one method in two folders of results, value by value."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from retarget_bench.commands.options import OfResults, ToFile, plugin_names, takes
from retarget_bench.options import listed, option
from retarget_bench.tables.comparing import PairOptions

if TYPE_CHECKING:
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.tables.comparing import Pair


class Options(ToFile, OfResults, PairOptions):
    """``bench compare``."""

    format: Literal["", "text", "md", "csv"] = option(
        "Format.", default="", shown="by the ending of -o, else text", letter="f"
    )


@click.command("compare")
@click.argument("first", shell_complete=plugin_names("methods"))
@click.argument("second", shell_complete=plugin_names("methods"))
@takes(Options, "first", "second")
def command(options: Options) -> None:
    """Compare two methods case by case: difference, interval, p-value and a verdict for every value.

    FIRST and SECOND are methods as tables call them, or two folders of results: then every method that
    is in both is compared with itself, as after a change.
    """
    from retarget_bench.results import store
    from retarget_bench.tables import comparing
    from retarget_bench.tables.rendering import pairwise_text

    form = options.form
    first, second = options.first, options.second
    folders = [Path(name) for name in (first, second)]
    columns = listed(options.columns) if options.columns else None
    if all(folder.is_dir() and store.find_results(folder) for folder in folders):
        matrices = comparing.matrices_of(options.of(folders).places(), options)
        pairs = [(matrix, _pairs(matrix, *folders)) for matrix in matrices]
        comparisons = comparing.compared(first, second, pairs, columns, options.all)
    else:
        matrices = comparing.matrices_of(options.places(), options)
        comparisons = comparing.compare(matrices, first, second, columns, options.all)
    if form == "text":
        options.write(pairwise_text.text(comparisons, options.width))
    else:
        options.write(pairwise_text.RENDERERS[form](comparisons))


def _pairs(matrix: ResultMatrix, first: Path, second: Path) -> list[Pair]:
    """Every method that has results in both folders, with itself."""
    one, two = (
        {row.header.method.label: row for row in matrix.rows if row.paths.root == folder}
        for folder in (first, second)
    )
    return [(row, two.get(label)) for label, row in one.items()]
