"""``bench table``: results as a table."""

from __future__ import annotations

from pathlib import Path

import click

from retarget_bench.errors import BenchError

FORMATS = ("text", "md", "csv")


@click.command("table")
@click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=click.Path(path_type=Path))
@click.option("--columns", metavar="ID,ID", help="Value ids to show (bench info METRIC lists them).")
@click.option("--all", "everything", is_flag=True, help="Show every value.")
@click.option("-f", "--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to this file.")
@click.option("-d", "--dataset", help="Only results of this data set (a folder name under RESULTS).")
def command(
    roots: tuple[Path, ...],
    columns: str | None,
    everything: bool,
    form: str,
    output: Path | None,
    dataset: str | None,
) -> None:
    """Print the table of finished results. RESULTS: folders written by `bench run`. [default: runs]"""
    from retarget_bench import files, records, summary, table
    from retarget_bench.render import RENDERERS

    roots = roots or (Path("runs"),)
    places = [place for root in roots for place in records.find_results(root)]
    places = [place for place in places if dataset in (None, place.dataset)]
    if not places:
        raise BenchError(f"no results in {', '.join(map(str, roots))}; bench run makes some")
    found = summary.sections(places)
    wanted: tuple[str, ...] = table.FIRST_SIGHT
    if everything:
        wanted = tuple(table.all_columns(found))
    elif columns is not None:
        wanted = tuple(column.strip() for column in columns.split(",") if column.strip())
    written = "\n".join(RENDERERS[form](each) for each in table.tables(found, wanted))
    if output is None:
        click.echo(written)
    else:
        files.write_text(output, written)
        click.echo(f"wrote {output}")
