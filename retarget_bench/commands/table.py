"""``bench table``: results as a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from retarget_bench.errors import BenchError

FORMATS = ("text", "md", "tex", "html", "csv")
BREAKDOWNS = ("pair", "clip", "kind", "joint", "part", "seen")


@click.command("table")
@click.argument("roots", nargs=-1, metavar="[RESULTS]...", type=click.Path(path_type=Path))
@click.option("--columns", metavar="ID,ID", help="Value ids to show (bench info METRIC lists them).")
@click.option("--all", "everything", is_flag=True, help="Show every value.")
@click.option(
    "--by",
    type=click.Choice(BREAKDOWNS),
    help="Break values down: a line per pair, clip, kind of performance, joint, part of the body, or by "
    "what was seen in training. Without --columns: the first value that there is.",
)
@click.option("--intervals", is_flag=True, help="Show 95 % intervals in text and md; the others always do.")
@click.option("-f", "--format", "form", type=click.Choice(FORMATS), default="text", show_default=True)
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to this file.")
@click.option("-d", "--dataset", help="Only results of this data set (a folder name under RESULTS).")
def command(
    roots: tuple[Path, ...],
    columns: str | None,
    everything: bool,
    by: Any,
    intervals: bool,
    form: str,
    output: Path | None,
    dataset: str | None,
) -> None:
    """Print the table of finished results. RESULTS: folders written by `bench run`. [default: runs]"""
    from retarget_bench import files, records, summary, table
    from retarget_bench.rendering import RENDERERS, WITH_INTERVALS

    roots = roots or (Path("runs"),)
    places = [place for root in roots for place in records.find_results(root)]
    places = [place for place in places if dataset in (None, place.dataset)]
    if not places:
        raise BenchError(f"no results in {', '.join(map(str, roots))}; bench run makes some")
    found = summary.sections(places, by)
    wanted: tuple[str, ...] = table.FIRST_SIGHT
    if everything:
        wanted = tuple(table.all_columns(found))
    elif columns is not None:
        wanted = tuple(column.strip() for column in columns.split(",") if column.strip())
    renderers = WITH_INTERVALS if intervals else RENDERERS
    written = renderers[form](table.tables(found, wanted, by or ""))
    if output is None:
        click.echo(written, nl=False)
    else:
        files.write_text(output, written)
        click.echo(f"wrote {output}")
