"""``bench check``: the regression gate."""

from __future__ import annotations

import re
import traceback
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from retarget_bench import defaults
from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError, FileError
from retarget_bench.python.progress import progress_bar

if TYPE_CHECKING:
    from retarget_bench.verification.gate.compare import Criteria

_TOLERANCE = re.compile(r"(?:(?P<name>[^=]+)=)?(?P<number>\d+\.?\d*|\.\d+)\s*(?P<share>%?)")


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
@click.option("--columns", metavar="ID,ID", help="Compare these values only, as bench table calls them.")
@click.option("--worse-only", is_flag=True, help="Let numbers of methods get better.")
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    metavar="SHARE",
    help="By how much a method's mean may differ, such as 2%; of one value mpjpe=2%, or mpjpe=0.1 in its "
    "unit. May be repeated.",
)
@click.option("-d", "--dataset", metavar="DATASET", help="[default: that of the golden rows]")
@options.root_option
@options.plugin_option
@click.option("--accept", is_flag=True, help="Make what is measured now the golden rows.")
@click.option("--because", metavar="TEXT", help="With --accept: why numbers may move; it is logged.")
@click.option(
    "--summary", metavar="FILE", type=options.FILE, help="Also append the report to this file, as Markdown."
)
@click.option("--all", "--verbose", "everything", is_flag=True, help="Write out every row that moved.")
def command(
    baseline: Path | None,
    methods: tuple[str, ...],
    columns: str | None,
    worse_only: bool,
    tolerances: tuple[str, ...],
    dataset: str | None,
    root: str | None,
    accept: bool,
    because: str | None,
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
    if accept and (columns is not None or worse_only or tolerances):
        raise BenchError("--accept takes everything; leave --columns, --worse-only and --tolerance")
    asked = _criteria(columns, worse_only, tolerances)
    folder = baseline or golden.built_in()
    if root is not None and dataset is None:
        dataset = golden.read(folder).facts.get("dataset/spec", defaults.DATASET)
    spec = None if dataset is None else options.dataset_spec(dataset, root)
    with TemporaryDirectory(prefix="bench-check-") as scratch:
        try:
            with progress_bar("bench check", "items") as progress:
                found, now = run.check(
                    folder, Path(scratch), methods, spec, progress, accept=accept, asked=asked
                )
        except (BenchError, click.ClickException):
            raise
        except Exception:  # Python would end with 1, which says that something was measured and moved
            traceback.print_exc()
            echo("Could not measure: the gate itself, or a plug-in in it, broke.", err=True)
            return 2
        if summary is not None:
            try:
                with summary.open("a", encoding="utf-8") as file:
                    file.write(report.markdown(found))
            except OSError as error:
                raise FileError(summary, f"cannot be written ({error.strerror})") from error
        if not accept or found.verdict == 2:
            echo(report.text(found, everything))
        if not accept:
            return found.verdict
        if found.verdict == 0:
            echo("Nothing to accept: the golden rows are as they were.")
        else:
            echo(f"Accepted, and logged in {run.accept(folder, found, now, because or '')}.")
    return 0


def _criteria(columns: str | None, worse_only: bool, tolerances: tuple[str, ...]) -> Criteria:
    """The criteria that the options ask for. Raises BenchError for names of no value, and for what is no
    tolerance."""
    from retarget_bench.tables import names
    from retarget_bench.verification.gate.compare import Criteria, Tolerance

    if columns is None and not tolerances:
        return Criteria(worse_only=worse_only)
    known = names.installed()
    allowed: dict[str, Tolerance] = {}
    for each in _single(tolerances):
        found = _TOLERANCE.fullmatch(each)
        if found is None or not (found["name"] or found["share"]):
            raise BenchError(
                f"--tolerance takes a share, such as 2%, or that of one value, such as mpjpe=2% or, in its "
                f"unit, mpjpe=0.1; got {each!r}"
            )
        number = float(found["number"])
        tolerance = Tolerance(0.0, number / 100) if found["share"] else Tolerance(number, 0.0)
        allowed[names.value_id(found["name"], known) if found["name"] else ""] = tolerance
    values = [] if columns is None else names.value_ids(options.ids(columns), known)
    if columns is not None and not values:
        raise BenchError("--columns names no value; leave it out for all of them")
    return Criteria(frozenset(values), worse_only, allowed)


def _single(tolerances: Sequence[str]) -> list[str]:
    """The tolerances one by one; commas separate them, and stand in labels, too."""
    found, name = [], ""
    for part in (part.strip() for text in tolerances for part in text.split(",")):
        each = f"{name}, {part}" if name else part
        name = "" if "=" in each or _TOLERANCE.fullmatch(each) else each
        found += [] if name else [each]
    return [*found, *([name] if name else [])]
