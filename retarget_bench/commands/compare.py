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
    from retarget_bench.results.store import ResultPaths

FORMATS = ("text", "md", "csv")


@click.command("compare")
@click.argument("first")
@click.argument("second")
@click.option(
    "--results",
    "roots",
    multiple=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="A folder written by `bench run`; may be repeated. [default: runs]",
)
@options.only_dataset_option
@options.split_option
@click.option("--columns", metavar="ID,ID", help="Values to compare. [default: those of bench table]")
@click.option("--all", "everything", is_flag=True, help="Compare every value.")
@click.option("-f", "--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
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
    from retarget_bench.tables.rendering.pairwise_text import RENDERERS

    folders = [Path(name) for name in (first, second)]
    wanted = None if columns is None else [each.strip() for each in columns.split(",") if each.strip()]
    by_folder = all(folder.is_dir() and _places([folder], dataset, splits) for folder in folders)
    names = () if by_folder else (first, second)
    matrices = _panels(folders if by_folder else roots or (Path("runs"),), dataset, splits, names)
    asked = _checked(matrices, wanted)
    values = [_values(matrix, asked, everything) for matrix in matrices]
    if by_folder:
        found = _of_folders(matrices, folders, values)
    else:
        found = _of_labels(matrices, first, second, values)
    options.write_out(RENDERERS[form](found), output)


def _places(roots: Sequence[Path], dataset: str | None, splits: Sequence[str]) -> list[ResultPaths]:
    """Results under the roots, self pairs always among them: some values of other splits pool them."""
    from retarget_bench.results import store

    places = [place for root in roots for place in store.find_results(root)]
    return [p for p in places if dataset in (None, p.dataset) and p.split in (*splits, "self")]


def _panels(
    roots: Sequence[Path], dataset: str | None, splits: Sequence[str], names: Sequence[str]
) -> list[ResultMatrix]:
    """The results under the roots; only those of the named methods are read, where each has some."""
    from retarget_bench.analysis import pairwise
    from retarget_bench.results import result_matrix as matrix
    from retarget_bench.results import store

    if empty := [root for root in roots if not store.find_results(root)]:
        raise BenchError(f"no results in {empty[0]}; bench run makes some")
    places = _places(roots, dataset, splits)
    if not places:
        where = f" of {dataset}" if dataset else ""
        raise BenchError(f"no results{where} in {', '.join(map(str, roots))}; bench run makes some")
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
    if everything or wanted is not None:
        return there if everything else list(wanted or ())
    shown = (stand_in(key, there) for key in DEFAULT_COLUMNS)
    return [key for key in shown if key in there]


def _of_labels(
    matrices: Sequence[ResultMatrix], first: str, second: str, values: Sequence[Sequence[str]]
) -> list[PairwiseComparison]:
    from retarget_bench.analysis import pairwise

    for name in (first, second):
        if not any(pairwise.find(matrix, name) for matrix in matrices):
            raise pairwise.unknown(matrices, name)
    found = []
    for matrix, asked in zip(matrices, values, strict=True):
        one, two = pairwise.find(matrix, first), pairwise.find(matrix, second)
        if one and two:
            found.append(pairwise.compare(matrix, one, two, asked))
    return _filled(found, f"{first} and {second}")


def _of_folders(
    matrices: Sequence[ResultMatrix], folders: Sequence[Path], values: Sequence[Sequence[str]]
) -> list[PairwiseComparison]:
    from retarget_bench.analysis import pairwise

    found = []
    for matrix, asked in zip(matrices, values, strict=True):
        one, two = (
            {row.header.method.label: row for row in matrix.rows if row.paths.root == folder}
            for folder in folders
        )
        found += [pairwise.compare(matrix, one[label], two[label], asked) for label in one if label in two]
    return _filled(found, " and ".join(map(str, folders)))


def _filled(found: Sequence[PairwiseComparison], names: str) -> list[PairwiseComparison]:
    """Those with any difference to show."""
    filled = [each for each in found if each.differences]
    if not filled:
        raise BenchError(f"{names} have no case in common that both have a number for")
    return filled
