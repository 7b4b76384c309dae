"""``bench table``: results as a table."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import click

from retarget_bench import defaults
from retarget_bench.commands.options import OfResults, ToFile, takes
from retarget_bench.errors import BenchError
from retarget_bench.options import listed, option
from retarget_bench.tables.requested import Request


class Options(ToFile, OfResults, Request):
    """``bench table``."""

    task: str = option("Results of this task, as bench run --task made them.", default=defaults.TASK)
    paper: str = option(
        "Print a published table with these results beside it, variants too: humot-table2, -3, -4, -5, "
        "pan-table1 to -5 or correspondence-free-table2 to -7; PAPER-text: numbers outside tables. With "
        "--methods and --bodies: these. Without results: the printed numbers.",
        default="",
        metavar="TABLE",
    )
    protocols: bool = option(
        "Show what every position protocol says of the same predictions, and the factors between them; "
        "--columns: between these alone, --all: between each two.",
        default=False,
    )
    notes: bool = option("Print all notes, and how numbers are made in full.", default=False)
    intervals: bool = option(
        "Show 95 % intervals in text, md and tex; the others always do.", default=False
    )
    format: Literal["", "text", "md", "tex", "html", "csv", "json"] = option(
        "Format.", default="", shown="by the ending of -o, else text", letter="f"
    )


@click.command("table")
@takes(Options)
def command(options: Options) -> None:
    """Print the table of results.

    MPJPE, contact recall and FID on all splits, for people; -s SPLIT has more columns of one. While
    a run is going on, the cases that all methods have done.
    """
    from retarget_bench.tables import rendering, requested

    form = options.form
    if options.protocols:
        options.write(_protocols(options, form))
        return
    if options.paper:
        tables: Sequence[Any] = [_published(options)]
    elif options.task == "probe":
        request = replace(options, all=options.all or not options.columns)
        tables = requested.tables(options.places("probe"), request, form)
    else:
        tables = requested.tables(options.places(options.task), options, form)
    if form == "text":
        text = rendering.text(tables, options.intervals, notes=options.notes, columns=options.width)
    elif form == "md":
        text = rendering.markdown(tables, options.intervals, notes=options.notes)
    else:
        renderers = rendering.WITH_INTERVALS if options.intervals else rendering.RENDERERS
        text = renderers[form](tables)
    options.write(text)


def _published(options: Options) -> Any:
    """A published table with the results of its task that lie in these folders, if there are any."""
    from retarget_bench.analysis.selection import of_dataset
    from retarget_bench.results import store
    from retarget_bench.tables.published.joined import joined
    from retarget_bench.tables.published.printed import published

    own = ("columns", "all", "splits", "by", "at_least", "against", "unit")
    if stated := [f"--{name.replace('_', '-')}" for name in own if getattr(options, name)]:
        raise BenchError(f"--paper has columns and splits of its own; leave {', '.join(stated)} out")
    table = published(options.paper)
    if missing := [root for root in options.results if not root.is_dir()]:
        raise BenchError(f"there is no folder {missing[0]}")
    places = [place for root in options.roots for place in store.find_results(root, table.task)]
    if places and options.only is not None:
        places = of_dataset(places, options.only)
    return joined(table, places, replace(options, variants=True).selection(defaults.TASK), options.bodies)


def _protocols(options: Options, form: str) -> str:
    """For each method and split: the number under every protocol, the factor between protocols as measured
    case by case, and its reasons (squared or not, height, axes, joints, alignment, self pairs, unit). A
    factor that is not the same in every case cannot turn one published number into another."""
    from retarget_bench.analysis import protocol_factors
    from retarget_bench.analysis.selection import label_of, of_splits, unknown
    from retarget_bench.results.result_matrix import result_matrices

    if form not in ("text", "md"):
        raise BenchError(f"protocols are compared as text or md, not as {form}")
    places = options.places()
    splits = {place.split for place in of_splits(places, listed(options.splits))}
    rows = [(matrix, row) for matrix in result_matrices(places) for row in matrix.rows]
    labels = {row.label for _, row in rows}
    methods = {name: label_of(name, labels) for name in listed(options.methods)}
    if strangers := [name for name, label in methods.items() if label is None]:
        raise unknown(labels, strangers[0])
    pages, problems = [], []
    for matrix, row in rows:
        if matrix.split not in splits or (methods and row.label not in methods.values()):
            continue
        for seed in range(len(row.runs)):
            try:
                page = protocol_factors.explain(matrix, row, seed)
                factors = protocol_factors.chosen(page, listed(options.columns), every=options.all)
            except BenchError as error:
                problems.append(error)
                continue
            if form == "md":
                pages.append(protocol_factors.markdown(page, factors))
            else:
                pages.append(protocol_factors.text(page, factors, options.width))
    if not pages:
        raise problems[0]
    return "\n".join(pages)
