"""``bench check``: the regression gate."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import echo
from retarget_bench.commands.options import takes
from retarget_bench.errors import BenchError, FileError
from retarget_bench.options import Names, OfMethods, listed, option
from retarget_bench.parallel import one_thread
from retarget_bench.plugins import named
from retarget_bench.python.progress import progress_bar

if TYPE_CHECKING:
    from retarget_bench.verification.gate.compare import Criteria

_TOLERANCE = re.compile(r"\s*(?:(?P<name>[^=]+)=)??(?P<number>\d+\.?\d*|\.\d+)\s*(?P<share>%?)\s*(?:,|$)")


class Options(OfMethods):
    """``bench check``."""

    results: Path | None = option(
        "The folder of golden rows.",
        default=None,
        shown="those that came with this package",
        letter="r",
        metavar="DIR",
    )
    columns: Names = option(
        "Compare these values only, as bench table calls them.", default=(), metavar="ID,ID"
    )
    worse_only: bool = option("Let numbers of methods get better.", default=False)
    tolerance: Names = option(
        "By how much a method's mean may differ, such as 2%; of one value "
        "mpjpe=2%, or mpjpe=0.1 in its unit.",
        default=(),
        metavar="SHARE",
    )
    dataset: str | None = option(
        "The data set.", default=None, shown="that of the golden rows", letter="d", metavar="DATASET"
    )
    accept: str = option(
        "Make what is measured now the golden rows, and log why numbers may move.",
        default="",
        metavar="WHY",
    )
    summary: Path | None = option(
        "Also append the report to this file, as Markdown.", default=None, metavar="FILE"
    )
    all: bool = option("Write out every row that moved.", default=False)


@click.command("check")
@takes(Options)
def command(options: Options) -> int:
    """Check that metrics and methods still give the same numbers.

    Compares metrics on frozen motions, and methods on a few cases, with golden rows. Exit status 0: same;
    1: a number changed, for better or worse; 2: something could not be measured.
    """
    one_thread()  # others wait for each other in such small sums
    from retarget_bench.python.plans import method_spec
    from retarget_bench.verification.gate import golden, report, run

    if options.accept and not options.accept.strip():
        raise BenchError('--accept takes the reason: --accept "why numbers may move"')
    if options.accept and (options.columns or options.worse_only or options.tolerance):
        raise BenchError("--accept takes everything; leave --columns, --worse-only and --tolerance")
    accept, dataset = bool(options.accept), options.dataset
    criteria = _criteria(options)
    methods = [str(method_spec(each)) for each in listed(options.methods)]
    folder = options.results or golden.built_in()
    spec = None if dataset is None else named.parse(dataset)
    with TemporaryDirectory(prefix="bench-check-") as scratch:
        try:
            with progress_bar("bench check", "items") as progress:
                outcome, now = run.check(
                    folder, Path(scratch), methods, spec, progress, accept=accept, criteria=criteria
                )
        except (BenchError, click.ClickException):
            raise
        except Exception:  # Python would end with 1, which says that something was measured and moved
            traceback.print_exc()
            echo("Could not measure: the gate itself, or a plug-in in it, broke.", err=True)
            return 2
        if options.summary is not None:
            try:
                with options.summary.open("a", encoding="utf-8") as file:
                    file.write(report.markdown(outcome))
            except OSError as error:
                raise FileError(options.summary, f"cannot be written ({error.strerror})") from error
        if not accept or outcome.verdict == 2:
            echo(report.text(outcome, options.all))
        if not accept:
            return outcome.verdict
        if outcome.verdict == 0:
            echo("Nothing to accept: the golden rows are as they were.")
        else:
            echo(f"Accepted, and logged in {run.accept(folder, outcome, now, options.accept)}.")
    return 0


def _criteria(options: Options) -> Criteria:
    """The criteria of the options. Raises BenchError for names of no value and unreadable tolerances."""
    from retarget_bench.tables import names
    from retarget_bench.verification.gate.compare import Criteria, Tolerance

    if not (options.columns or options.tolerance):
        return Criteria(worse_only=options.worse_only)
    installed = names.installed()
    allowed: dict[str, Tolerance] = {}
    for match in _matches([options.tolerance] if isinstance(options.tolerance, str) else options.tolerance):
        number = float(match["number"])
        tolerance = Tolerance(0.0, number / 100) if match["share"] else Tolerance(number, 0.0)
        allowed[names.value_id(match["name"], installed) if match["name"] else ""] = tolerance
    values = names.value_ids(listed(options.columns), installed)
    return Criteria(frozenset(values), options.worse_only, allowed)


def _matches(tolerances: Sequence[str]) -> Iterator[re.Match[str]]:
    """The tolerances one by one. Commas separate them, and labels of values may hold some."""
    for text in tolerances:
        start = 0
        while start < len(text):
            match = _TOLERANCE.match(text, start)
            if match is None or not (match["name"] or match["share"]):
                raise BenchError(
                    "--tolerance takes a share, such as 2%, or that of one value, such as mpjpe=2% or, in "
                    f"its unit, mpjpe=0.1; got {text[start:]!r}"
                )
            yield match
            start = match.end()
