"""``bench report``: results, charts and motion as one page."""

import click

from retarget_bench.commands import echo
from retarget_bench.commands.options import OfResults, takes
from retarget_bench.options import option
from retarget_bench.report.writing import ReportOptions


class Options(OfResults, ReportOptions):
    """``bench report``."""

    task: str = option("Only results of this task.", default="")


@click.command("report")
@takes(Options)
def command(options: Options) -> None:
    """Make one page of results that opens from disk: tables, charts, and the motion behind every number.

    With -o FILE.pdf, a page for a paper's appendix: table, intervals, protocol, versions, keys, and what
    checklists of conferences ask for."""
    from retarget_bench.python.progress import stepped
    from retarget_bench.report import writing
    from retarget_bench.tables.model import count

    with stepped("bench report") as over:
        shown = writing.write(
            options, options.roots, task=options.task or None, dataset=options.only, over=over
        )
    in_motion = f", with {count(len(shown.scenes), 'case')} in motion" if shown.scenes else ""
    echo(f"wrote {options.page} ({options.page.stat().st_size / 1e6:.2f} MB{in_motion})")
    for note in shown.notes:
        echo(f"- {note}")
