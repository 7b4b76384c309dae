"""``bench report``: results, charts and motion as one page."""

from pathlib import Path

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo


@click.command("report")
@options.roots_argument
@click.option(
    "-o",
    "--output",
    default="report.html",
    show_default=True,
    type=options.FILE,
    help="Write to this file.",
)
@click.option("--title", help="The heading of the page.")
@click.option(
    "--clips",
    type=click.IntRange(0),
    metavar="N",
    help="How many cases can be seen in motion: the worst, median and best ones, of many kinds and pairs. "
    "[default: all, or as many as fit 4 MB]",
)
@click.option("--case", "cases", multiple=True, metavar="ID", help="This case in motion, too.")
@click.option("--no-player", is_flag=True, help="Leave the motion out: tables and charts alone.")
@click.option(
    "--columns",
    metavar="ID,ID",
    help="Values in the tables (bench info METRIC lists them). [default: usual ones, and those of sets]",
)
@click.option("--skins", is_flag=True, help="Skinned meshes in motion, where bodies have one; larger.")
@click.option("-m", "--methods", multiple=True, metavar="METHOD", help="Only this method; may be repeated.")
@options.only_dataset_option
@click.option("--task", type=options.TaskChoice(), help="Only results of this task.")
@options.root_option
def command(
    roots: tuple[Path, ...],
    output: Path,
    title: str | None,
    clips: int | None,
    cases: tuple[str, ...],
    no_player: bool,
    skins: bool,
    columns: str | None,
    methods: tuple[str, ...],
    dataset: str | None,
    task: str | None,
    root: str | None,
) -> None:
    """Make one page of results that opens from disk: tables, charts, and the motion behind every number.

    RESULTS: folders written by `bench run` and `bench task`. [default: runs]
    """
    from retarget_bench.report import writing
    from retarget_bench.tables.model import count

    shown = writing.write(
        output,
        roots or (Path(defaults.OUT),),
        task=task,
        dataset=dataset,
        methods=methods,
        data=root,
        columns=options.ids(columns or ""),
        title=title,
        clips=clips,
        motion=not no_player,
        cases=cases,
        skins=skins,
    )
    told = f", with {count(len(shown.scenes), 'case')} in motion" if shown.scenes else ""
    echo(f"wrote {output} ({output.stat().st_size / 1e6:.1f} MB{told})")
    for note in shown.notes:
        echo(f"- {note}")
