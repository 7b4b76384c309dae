"""``bench compare``: two methods, or one method in two folders of results, value by value."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench import defaults
from retarget_bench.commands import options

if TYPE_CHECKING:
    from retarget_bench.results.result_matrix import ResultMatrix
    from retarget_bench.tables.comparing import Pair

FORMATS = ("text", "md", "csv")


@click.command("compare")
@click.argument("first")
@click.argument("second")
@click.option(
    "--results",
    "roots",
    multiple=True,
    metavar="DIR",
    type=options.FOLDER,
    help="A folder written by `bench run`; may be repeated. [default: runs]",
)
@options.only_dataset_option
@options.split_option
@click.option("--columns", metavar="ID,ID", help="Values to compare. [default: those of bench table]")
@options.bodies_option
@click.option("--all", "everything", is_flag=True, help="Compare every value.")
@options.format_option(*FORMATS)
@options.output_option
def command(
    first: str,
    second: str,
    roots: tuple[Path, ...],
    dataset: str | None,
    splits: tuple[str, ...],
    columns: str | None,
    bodies: str | None,
    everything: bool,
    form: str,
    output: Path | None,
) -> None:
    """Compare two methods case by case: difference, interval, p-value and a verdict for every value.

    FIRST and SECOND are methods as tables call them, or two folders of results: then every method that
    is in both is compared with itself, as after a change.
    """
    from retarget_bench.analysis.selection import of_bodies
    from retarget_bench.results import store
    from retarget_bench.tables import comparing
    from retarget_bench.tables.rendering.pairwise_text import RENDERERS, text

    folders = [Path(name) for name in (first, second)]
    wanted = None if columns is None else options.ids(columns)
    if all(folder.is_dir() and store.find_results(folder) for folder in folders):
        matrices = of_bodies(_matrices(folders, dataset, splits), bodies or "")
        both = [(matrix, _pairs(matrix, *folders)) for matrix in matrices]
        if not (found := comparing.compared(both, wanted, everything)):
            rows = [row for _, pairs in both for pair in pairs for row in pair if row]
            raise comparing.nothing_common(first, second, rows)
    else:
        matrices = _matrices(roots or (Path(defaults.OUT),), dataset, splits)
        found = comparing.compare(of_bodies(matrices, bodies or ""), first, second, wanted, everything)
    if form == "text" and output is None:
        options.write_out(text(found, options.screen_width()), output)
    else:
        options.write_out(RENDERERS[form](found), output)


def _pairs(matrix: ResultMatrix, first: Path, second: Path) -> list[Pair]:
    """Every method that has results in both folders, with itself."""
    one, two = (
        {row.header.method.label: row for row in matrix.rows if row.paths.root == folder}
        for folder in (first, second)
    )
    return [(row, two.get(label)) for label, row in one.items()]


def _matrices(roots: Sequence[Path], dataset: str | None, splits: Sequence[str]) -> list[ResultMatrix]:
    """The results under the roots, of all methods that tables rank.

    Self pairs are read whatever the splits: some values of other splits pool them.
    """
    from retarget_bench.analysis.selection import of_splits
    from retarget_bench.api import SELF
    from retarget_bench.results import result_matrix as matrix

    found = options.results(roots, dataset)
    chosen = {place.split for place in of_splits(found, splits)}
    places = [place for place in found if place.split in {*chosen, SELF}]
    return [each for each in matrix.result_matrices(places) if each.split in chosen]
