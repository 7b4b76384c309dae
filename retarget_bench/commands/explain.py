"""``bench explain``: the same predictions under every position protocol, and the factors between them."""

from pathlib import Path

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError


@click.command("explain")
@click.argument("root", metavar="[RESULTS]", default="runs", type=options.PATH)
@click.option("-m", "--method", help="Only this method (its name in the table). [default: every one]")
@click.option("-s", "--split", help="Only this split. [default: every one]")
@options.only_dataset_option
@click.option("--between", metavar="ID,ID", default="", help="Only the factors between these protocols.")
@click.option("--all", "every", is_flag=True, help="The factor between each pair, not from the first only.")
@options.format_option("text", "md")
@options.output_option
def command(
    root: Path,
    method: str | None,
    split: str | None,
    dataset: str | None,
    between: str,
    every: bool,
    form: str,
    output: Path | None,
) -> None:
    """Show what every position protocol says of the same predictions, and why they differ.

    RESULTS is a folder written by `bench run`. For each method and split: the number under every protocol,
    the factor between protocols as measured case by case, and its reasons (squared or not, height, axes,
    joints, alignment, self pairs, unit). A factor that is not the same in every case cannot turn one
    published number into another.
    """
    from retarget_bench.analysis import protocol_factors
    from retarget_bench.results.result_matrix import result_matrices
    from retarget_bench.tables import rendering

    found = [
        (matrix, row) for matrix in result_matrices(options.results([root], dataset)) for row in matrix.rows
    ]
    wanted = [
        (matrix, row, seed)
        for matrix, row in found
        if method in (None, row.label) and split in (None, matrix.split)
        for seed in range(len(row.runs))
    ]
    if not wanted:
        there = sorted({f"{row.label} on {matrix.split}" for matrix, row in found})
        raise BenchError(f"no such result in {root}; there are {', '.join(there)}")
    asked = options.ids(between)
    width = options.screen_width() if output is None else rendering.WIDTH
    pages, refused = [], []
    for each in wanted:
        try:
            page = protocol_factors.explain(*each)
            factors = protocol_factors.chosen(page, asked, every=every)
            pages.append(
                protocol_factors.markdown(page, factors)
                if form == "md"
                else protocol_factors.text(page, factors, width)
            )
        except BenchError as error:
            refused.append(error)
    if not pages:
        raise refused[0]
    options.write_out("\n".join(pages), output)
