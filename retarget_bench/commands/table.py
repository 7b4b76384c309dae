"""``bench table``: results as a table."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from retarget_bench.commands import options
from retarget_bench.errors import BenchError

FORMATS = ("text", "md", "tex", "html", "csv", "json")
BREAKDOWNS = (
    "pair", "clip", "kind", "structure", "level", "joint", "part", "seen", "second", "threshold",
)  # fmt: skip


@click.command("table")
@options.roots_argument
@click.option(
    "-s",
    "--split",
    "splits",
    multiple=True,
    metavar="SPLIT",
    callback=options.split_names,
    help="A split, such as cross, with more columns; may be repeated. [default: all side by side]",
)
@click.option(
    "-m",
    "--method",
    "methods",
    multiple=True,
    metavar="METHOD",
    shell_complete=options.plugin_names("methods"),
    help="Only these methods, and controls; may be repeated, or METHOD,METHOD.",
)
@click.option("--variants", is_flag=True, help="Show variants of methods, too.")
@click.option("--controls/--no-controls", default=True, help="Show controls.  [default: controls]")
@options.bodies_option
@click.option("--columns", metavar="ID,ID", help="Value ids to show (bench info METRIC lists them).")
@click.option("--all", "everything", is_flag=True, help="Show every value.")
@click.option(
    "--against",
    type=click.Choice(["source"]),
    help="Show the values against the source instead of those against the reference.",
)
@click.option(
    "--unit", type=click.Choice(["m"]), help="Show metres instead of per cent of the target's height."
)
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
    help="Print a published table with these results beside it, variants too: humot-table2, -3, -4, -5, "
    "pan-table1 to -5 or correspondence-free-table2 to -7; PAPER-text: numbers outside tables. With -m and "
    "--bodies: these. Without results: the printed numbers.",
)
@click.option("--probes", is_flag=True, help="Show what bench probe found, every probe, and nothing else.")
@click.option("--notes", is_flag=True, help="Print all notes, and how numbers are made in full.")
@click.option(
    "--intervals", is_flag=True, help="Show 95 % intervals in text, md and tex; the others always do."
)
@options.format_option(*FORMATS)
@options.output_option
@options.only_dataset_option
def command(
    roots: tuple[Path, ...],
    columns: str | None,
    everything: bool,
    against: Any,
    unit: Any,
    by: Any,
    task: str,
    at_least: int | None,
    paper: str | None,
    probes: bool,
    notes: bool,
    intervals: bool,
    form: str,
    output: Path | None,
    dataset: str | None,
    **choice: Any,
) -> None:
    """Print the table of results. RESULTS: folders written by `bench run`. [default: runs]

    MPJPE, contact recall and FID on all splits, for people; -s SPLIT has more columns of one. While
    a run is going on, the cases that all methods have done.
    """
    own = everything or by or at_least or choice["splits"] or against or unit
    if paper is not None and (columns is not None or own):
        raise BenchError(
            "--paper has columns and splits of its own; leave --columns, --all, --against, --unit, --by, "
            "--at-least and -s"
        )
    if paper is not None and probes:
        raise BenchError("published tables have no probes; give --paper or --probes")
    if paper is not None:
        select = _selection(choice["methods"], variants=True, controls=choice["controls"], apart=True)
        made = [_published(paper, roots, dataset, select, choice["bodies"] or "")]
    else:
        from retarget_bench.tables import requested

        task, maker = ("probe", "bench probe METHOD") if probes else (task, options.maker(task))
        what = "results of probes" if probes else "results"
        places = options.results(roots or (Path("runs"),), dataset, task, maker, what)
        everything = everything or (probes and columns is None)
        asked = _request(task, columns, everything, by, at_least, against=against, unit=unit, **choice)
        made = requested.tables(places, asked, form)
    options.write_out(_drawn(made, form, intervals, notes, output is None), output)


def _published(paper: str, roots: tuple[Path, ...], dataset: str | None, select: Any, bodies: str) -> Any:
    """A published table with the results of its task that lie in these folders, if there are any."""
    from retarget_bench.analysis.selection import of_dataset
    from retarget_bench.results import store
    from retarget_bench.tables.published.joined import joined
    from retarget_bench.tables.published.printed import published

    table = published(paper)
    if missing := [root for root in roots if not root.is_dir()]:
        raise BenchError(f"there is no folder {missing[0]}")
    places = [place for root in roots or (Path("runs"),) for place in store.find_results(root, table.task)]
    if places and dataset is not None:
        places = of_dataset(places, dataset)
    return joined(table, places, select, bodies)


def _drawn(made: Sequence[Any], form: str, intervals: bool, notes: bool, here: bool) -> str:
    """The tables in a format; text that is printed here is as wide as the terminal."""
    from retarget_bench.tables import rendering

    if form == "text":
        width = options.screen_width() if here else rendering.WIDTH
        return rendering.text(made, intervals, notes=notes, columns=width)
    if form == "md":
        return rendering.markdown(made, intervals, notes=notes)
    renderers = rendering.WITH_INTERVALS if intervals else rendering.RENDERERS
    return renderers[form](made)


def _request(
    task: str,
    columns: str | None,
    everything: bool,
    by: Any,
    at_least: int | None,
    *,
    against: Any,
    unit: Any,
    splits: tuple[str, ...],
    methods: tuple[str, ...],
    variants: bool,
    controls: bool,
    bodies: str | None,
) -> Any:
    from retarget_bench.tables.requested import Request

    plain = task in options.RUN_TASKS
    return Request(
        columns=None if columns is None else options.ids(columns),
        everything=everything,
        by=by,
        at_least=at_least,
        splits=splits,
        bodies=bodies or "",
        select=_selection(methods, variants=variants or not plain, controls=controls, apart=plain),
        against=against or "",
        unit=unit or "",
    )


def _selection(methods: tuple[str, ...], *, variants: bool, controls: bool, apart: bool) -> Any:
    from retarget_bench.analysis.selection import Selection

    labels = tuple(name for each in methods for name in options.method_names(each))
    return Selection(labels, variants, controls, apart=apart)
