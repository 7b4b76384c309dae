"""``bench check``: the regression gate."""

import traceback
from pathlib import Path

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.errors import BenchError, FileError


@click.command("check")
@click.option(
    "--baseline",
    metavar="DIR",
    type=options.FOLDER,
    help="The folder of golden rows. [default: those that came with this package]",
)
@click.option(
    "--method",
    "methods",
    multiple=True,
    metavar="METHOD",
    shell_complete=options.plugin_names("methods"),
    help="Check this method only; may be repeated. [default: all of the golden rows]",
)
@click.option("-d", "--dataset", metavar="DATASET", help="[default: that of the golden rows]")
@options.root_option
@options.plugin_option
@click.option("--accept", is_flag=True, help="Make what is measured now the golden rows.")
@click.option("--because", metavar="TEXT", help="With --accept: why numbers may move; it is logged.")
@click.option(
    "--forget",
    multiple=True,
    metavar="METHOD",
    help="With --accept: drop the golden rows of this method, which is no more.",
)
@click.option(
    "--summary", metavar="FILE", type=options.FILE, help="Also append the report to this file, as Markdown."
)
@click.option("--all", "everything", is_flag=True, help="Write out every row that moved.")
def command(
    baseline: Path | None,
    methods: tuple[str, ...],
    dataset: str | None,
    root: str | None,
    accept: bool,
    because: str | None,
    forget: tuple[str, ...],
    summary: Path | None,
    everything: bool,
) -> int:
    """Check that metrics and methods still give the same numbers.

    Compares metrics on frozen motions, and methods on a few cases, with golden rows. Exit status 0: same;
    1: a number changed, for better or worse; 2: something could not be measured.
    """
    from retarget_bench.verification.gate import golden, report, run

    if accept != bool(because and because.strip()):
        raise BenchError('--accept and --because "why numbers may move" go together')
    if forget and not accept:
        raise BenchError("--forget goes with --accept")
    folder = baseline or golden.built_in()
    if root is not None and dataset is None:
        dataset = golden.read(folder).dataset["spec"] if golden.exists(folder) else defaults.DATASET
    spec = None if dataset is None else options.dataset_spec(dataset, root)
    try:
        with options.progress_bar("bench check", "it") as progress:
            found = run.check(folder, methods, spec, progress, accept=accept, forget=forget)
    except (BenchError, click.ClickException):
        raise
    except Exception:  # Python would end with 1, which says that something was measured and moved
        traceback.print_exc()
        click.echo("Could not measure: the gate itself, or a plug-in in it, broke.", err=True)
        return 2
    click.echo(report.text(found.lines, found.verdict, everything))
    if summary is not None:
        try:
            with summary.open("a", encoding="utf-8") as file:
                file.write(report.markdown(found.lines, found.verdict))
        except OSError as error:
            raise FileError(summary, f"cannot be written ({error.strerror})") from error
    if accept:
        if found.verdict == 0:
            click.echo("Nothing to accept: the golden rows are as they were.")
        else:
            click.echo(f"Accepted, and logged in {run.accept(folder, found, because or '')}.")
    return found.verdict
