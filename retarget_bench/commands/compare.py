"""``bench compare``: two methods, or one method in two folders of results, value by value."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError

if TYPE_CHECKING:
    from retarget_bench.analysis.pairwise import PairwiseComparison
    from retarget_bench.results.result_matrix import ResultMatrix

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
    everything: bool,
    form: str,
    output: Path | None,
) -> None:
    """Compare two methods case by case: difference, interval, p-value and a verdict for every value.

    FIRST and SECOND are methods as tables call them, or two folders of results: then every method that
    is in both is compared with itself, as after a change.
    """
    from retarget_bench.analysis import pairwise
    from retarget_bench.results import store
    from retarget_bench.tables.rendering.pairwise_text import RENDERERS

    folders = [Path(name) for name in (first, second)]
    wanted = None if columns is None else options.ids(columns)
    by_folder = all(folder.is_dir() and store.find_results(folder) for folder in folders)
    names = () if by_folder else (first, second)
    matrices = _matrices(folders if by_folder else roots or (Path("runs"),), dataset, splits, names)
    asked = _checked(matrices, wanted)
    found: list[PairwiseComparison] = []
    for name in names:
        if not any(pairwise.find(matrix, name) for matrix in matrices):
            raise pairwise.unknown([row.label for matrix in matrices for row in matrix.rows], name)
    for matrix in matrices:
        values = _values(matrix, asked, everything)
        pairs = [(pairwise.find(matrix, first), pairwise.find(matrix, second))]
        if by_folder:
            one, two = (
                {row.header.method.label: row for row in matrix.rows if row.paths.root == folder}
                for folder in folders
            )
            pairs = [(row, two.get(label)) for label, row in one.items()]
        found += [pairwise.compare(matrix, a, b, values) for a, b in pairs if a and b]
    if not (found := [each for each in found if each.differences]):
        raise BenchError(f"{first} and {second} have no case in common that both have a number for")
    options.write_out(RENDERERS[form](found), output)


def _matrices(
    roots: Sequence[Path], dataset: str | None, splits: Sequence[str], names: Sequence[str]
) -> list[ResultMatrix]:
    """The results under the roots; only those of the named methods are read, where each has some.

    Self pairs are read whatever the splits: some values of other splits pool them.
    """
    from retarget_bench.analysis import pairwise
    from retarget_bench.results import result_matrix as matrix
    from retarget_bench.results import store

    places = [p for p in options.results(roots, dataset) if p.split in (*splits, "self")]
    labels = [store.read_header(place.header).method.label for place in places]
    wanted = {pairwise.label_of(name, labels) for name in names}
    if wanted and None not in wanted:
        places = [place for place, label in zip(places, labels, strict=True) if label in wanted]
    return [each for each in matrix.result_matrices(places) if each.split in splits]


def _checked(matrices: Sequence[ResultMatrix], wanted: list[str] | None) -> list[str] | None:
    """The values asked for; raises BenchError for one that no result has, or that is a curve."""
    declared = {key: value for matrix in matrices for key, value in matrix.values.items()}
    known = sorted(key for key, value in declared.items() if not value.index)
    for key in wanted or []:
        if key not in known:
            kind = "is a curve" if key in declared else "is a value of no result"
            raise BenchError(f"{key!r} {kind}; there are {', '.join(known)}")
    if wanted == []:
        raise BenchError(f"name at least one value; there are {', '.join(known)}")
    return wanted


def _values(matrix: ResultMatrix, wanted: list[str] | None, everything: bool) -> list[str]:
    """Value ids to compare on a split: those asked for, all, or the columns of a table."""
    from retarget_bench.tables.builder import DEFAULT_COLUMNS, stand_in

    there = list(dict.fromkeys(value for value, index in matrix.keys if not index))
    if everything:
        return there
    if wanted is not None:
        return wanted
    shown = (stand_in(key, there) for key in DEFAULT_COLUMNS)
    return [key for key in shown if key in there]
