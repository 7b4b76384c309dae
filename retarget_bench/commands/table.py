"""``bench table``: results as a table."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError

FORMATS = ("text", "md", "tex", "html", "csv")
BREAKDOWNS = (
    "pair", "clip", "kind", "structure", "level", "joint", "part", "seen", "second", "threshold",
)  # fmt: skip


@click.command("table")
@options.roots_argument
@click.option("--columns", metavar="ID,ID", help="Value ids to show (bench info METRIC lists them).")
@click.option("--all", "everything", is_flag=True, help="Show every value.")
@click.option(
    "--by",
    type=click.Choice(BREAKDOWNS),
    help="Break values down: a line per pair, clip, kind of performance, structure, level of a task, "
    "joint, part of the body, by what was seen in training, or per point of a curve. Without --columns: "
    "the first value that there is.",
)
@click.option(
    "--task",
    type=options.TaskChoice(),
    default="retarget",
    show_default=True,
    help="Results of this task, as bench task wrote them.",
)
@click.option(
    "--at-least", type=click.IntRange(1), metavar="SECONDS", help="Only clips this long or longer."
)
@click.option(
    "--paper",
    metavar="TABLE",
    help="Print a published table with these results beside it: humot-table2, -3, -4, -5, pan-table1, -3 "
    "or correspondence-free-table4.",
)
@click.option("--probes", is_flag=True, help="Show what bench probe found, every probe, and nothing else.")
@click.option("--intervals", is_flag=True, help="Show 95 % intervals in text and md; the others always do.")
@options.format_option(*FORMATS)
@options.output_option
@options.only_dataset_option
def command(
    roots: tuple[Path, ...],
    columns: str | None,
    everything: bool,
    by: Any,
    task: str,
    at_least: int | None,
    paper: str | None,
    probes: bool,
    intervals: bool,
    form: str,
    output: Path | None,
    dataset: str | None,
) -> None:
    """Print the table of finished results. RESULTS: folders written by `bench run`. [default: runs]

    What `bench probe` wrote beside them is a table of its own: --probes.
    """
    from retarget_bench.tables.rendering import RENDERERS, WITH_INTERVALS

    if paper is not None and (columns is not None or everything or by or at_least):
        raise BenchError(
            "--paper has columns of its own, and all cases; leave --columns, --all, --by and --at-least"
        )
    if paper is not None and probes:
        raise BenchError("published tables have no probes; give --paper or --probes")
    maker = "bench run" if task == "retarget" else f"bench task {options.task_name(task)}"
    if probes:
        task, maker = "probe", "bench probe METHOD"
    elif paper is not None:
        from retarget_bench.tables.published.published_tables import published

        if (wanted := published(paper).task) != "retarget":
            task, maker = wanted, f"bench task {wanted}"
    everything = everything or (probes and columns is None)
    what = "results of probes" if probes else "results"
    places = options.results(roots or (Path("runs"),), dataset, task, maker, what)
    renderers = WITH_INTERVALS if intervals else RENDERERS
    if paper is not None:
        made = _published(places, paper)
    else:
        made = _tables(places, task, columns, everything, by, at_least)
    options.write_out(renderers[form](made), output)


def _tables(
    places: Sequence[Any], task: str, columns: str | None, everything: bool, by: Any, at_least: int | None
) -> list[Any]:
    from retarget_bench.analysis import summary
    from retarget_bench.evaluation.tasks import DERIVED
    from retarget_bench.tables import builder
    from retarget_bench.tables.groups import FPS

    if task in DERIVED and columns is None and not everything and at_least is None:
        return builder.task_tables(places, task, by)
    if task in DERIVED and columns is not None and task != "reconstruct":
        by = by or builder.TASK_BREAKDOWN[task]
    found = summary.split_summaries(places, by, at_least)
    wanted: tuple[str, ...] = builder.DEFAULT_COLUMNS
    if everything:
        # nobody times probes, nor derived tasks
        timed = places[0].task == "retarget"
        wanted = tuple(column for column in builder.all_columns(found) if timed or column != FPS)
    elif columns is not None:
        wanted = tuple(options.ids(columns))
        if by is None and (over := builder.curve_index(found, wanted)):
            by, found = over, summary.split_summaries(places, over, at_least)
    return builder.tables(found, wanted, by or "")


def _published(places: Sequence[Any], name: str) -> list[Any]:
    from retarget_bench.tables.published import published_tables
    from retarget_bench.tables.published.layout import paper_table

    published = published_tables.published(name)
    if published.task == "reconstruct":
        published = published_tables.with_structures(published, places)
    return [paper_table(published, published_tables.own_rows(published, places))]
