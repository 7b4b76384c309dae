"""``bench submit``: make a submission, check one, and draw the leaderboard of many."""

from pathlib import Path

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError


@click.command("submit")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--make", metavar="METHOD", help="Write a submission of this method's results into DIR.")
@click.option("--check", "checked", is_flag=True, help="Check the submission in DIR.")
@click.option("--board", is_flag=True, help="Draw the leaderboard of the submissions in DIR.")
@click.option(
    "--results",
    metavar="DIR",
    default="runs",
    show_default=True,
    type=click.Path(path_type=Path),
    help="With --make: where the results lie.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    default="leaderboard.html",
    show_default=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="With --board: the page, or a .md, .tex or .csv file.",
)
@options.plugin_option
def command(
    folder: Path,
    make: str | None,
    checked: bool,
    board: bool,
    results: Path,
    output: Path,
) -> int:
    """Make (--make), check (--check) or show (--board) submissions to a leaderboard.

    A submission is a folder with submission.toml (who, what data, what cost), CARD.md, and the rows under
    results/, or motions under predictions/ that --check scores. --check exits 1 where something is wrong.
    """
    if (make is not None) + checked + board != 1:
        raise BenchError("say one of --make METHOD, --check and --board")
    if make is not None:
        return _make(folder, results, make)
    return _check(folder) if checked else _board(folder, output)


def _make(folder: Path, results: Path, label: str) -> int:
    from retarget_bench.exchange.submission.making import make

    left = make(folder, results, label)
    click.echo(f"wrote {folder}. To be filled in, then checked with bench submit --check {folder}:")
    for each in left:
        click.echo(f"  {each}")
    return 0


def _check(folder: Path) -> int:
    from retarget_bench.exchange.submission.checking import check

    found = check(folder)
    for finding in found:
        click.echo(str(finding))
    wrong = sum(finding.level == "error" for finding in found)
    click.echo(f"{folder}: " + (f"{wrong} errors" if wrong else "can be submitted"))
    return int(wrong > 0)


def _board(folder: Path, output: Path) -> int:
    from retarget_bench import files
    from retarget_bench.exchange.submission.board import board
    from retarget_bench.tables.rendering import WITH_INTERVALS

    form = output.suffix.lower().lstrip(".")
    if form not in ("html", "md", "tex", "csv"):
        raise BenchError(f"{output}: name a page that ends in .html, .md, .tex or .csv")
    tables, left_out = board(folder)
    for sentence in left_out:
        click.echo(sentence, err=True)
    files.write_text(output, WITH_INTERVALS[form](tables))
    click.echo(f"wrote {output}")
    return 0
