"""Files for others: ``bench export`` and ``bench submit``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from retarget_bench.commands import echo
from retarget_bench.commands.options import OfResults, plugin_names, takes
from retarget_bench.errors import BenchError
from retarget_bench.files import write_text
from retarget_bench.options import OfSplits, WithData, listed, option
from retarget_bench.plugins import named, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.progress import progress_bar

if TYPE_CHECKING:
    from retarget_bench.results.paths import ResultPaths


class ExportOptions(OfSplits):
    """``bench export``."""

    format: Literal["bvh", "glb"] = option("How motions are written.", default="bvh", letter="f")
    questions: bool = option(
        "Write sources and target characters alone, without any reference, for "
        "prediction by another program.",
        default=False,
    )


@click.command("export")
@click.argument("dataset", metavar="DATASET", shell_complete=plugin_names("datasets"))
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@takes(ExportOptions)
def export(dataset: str, folder: Path, options: ExportOptions) -> None:
    """Write a whole data set, references, labels and training clips included, as files; or its questions.

    DIR/manifest.json lists characters, cases and files, DIR/SHA256SUMS their check sums. Interrupted, the
    same command goes on where it stopped; on a finished folder it checks every file and replaces what is
    damaged. With --questions the manifest names every case and the file that its prediction is to be
    written to. Lengths are metres, Y is up, quaternions are w first.
    """
    spec = registry.canonical("datasets", named.parse(dataset))
    if options.questions:
        _questions(spec, folder, listed(options.splits))
    elif options.splits:
        raise BenchError("--splits: a whole data set is written; only --questions may be of some splits")
    else:
        _complete(spec, folder, options.format)


def _complete(spec: Spec, folder: Path, form: str) -> None:
    from retarget_bench.exchange import dataset_export

    with progress_bar("bench export", "clips") as progress:
        data = registry.create("datasets", spec)
        for done, total in dataset_export.export(data, str(spec), folder, form):
            progress(done, total)
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    echo(f"{folder}: {len(files)} files, {size:.0f} MB. Check them with: sha256sum -c SHA256SUMS")


def _questions(spec: Spec, folder: Path, splits: tuple[str, ...]) -> None:
    from retarget_bench.api.datasets import chosen_splits
    from retarget_bench.exchange.case_export import export

    source = registry.create("datasets", spec)
    infos = [info for split in chosen_splits(source, splits) for info in source.cases("retarget", split)]
    # where the files lie here says nothing to whoever reads the manifest
    name = Spec(spec.name, {key: value for key, value in spec.parameters.items() if key != "root"})
    with progress_bar("bench export", "cases") as progress:
        for done in export(source, str(name), infos, folder):
            progress(done, len(infos))
    sources = len({(info.source, info.clip) for info in infos})
    targets = len({info.target for info in infos})
    where = "" if spec == name else " --root DIR"
    echo(f"{folder}: {len(infos)} cases, {sources} source motions, {targets} target characters.")
    echo(f"Write the predictions beside manifest.json; then: bench score {folder}{where} --name METHOD")


class SubmitOptions(OfResults, WithData):
    """``bench submit``."""

    make: str = option(
        "Write a submission of this method's results into DIR.", default="", metavar="METHOD"
    )
    check: bool = option("Check the submission in DIR.", default=False)
    board: bool = option("Draw the leaderboard of the submissions in DIR.", default=False)
    out: Path = option(
        "With --board: the page, or a .md, .tex or .csv file.",
        default=Path("leaderboard.html"),
        letter="o",
        metavar="FILE",
    )


@click.command("submit")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@takes(SubmitOptions)
def submit(folder: Path, options: SubmitOptions) -> int:
    """Make (--make), check (--check) or show (--board) submissions to a leaderboard.

    A submission is a folder of results, as `bench run` and `bench score` write them, with a card.toml: who
    made the method, how it was trained, what it costs. --check exits 1 where something is wrong.
    """
    if bool(options.make) + options.check + options.board != 1:
        raise BenchError("say one of --make METHOD, --check and --board")
    if options.make:
        return _make(folder, options.places(), named.with_names(options.make))
    if options.check:
        return _check(folder, options.root)
    return _board(folder, options.out, options.root)


def _make(folder: Path, places: list[ResultPaths], name: str) -> int:
    from retarget_bench.evaluation import timing
    from retarget_bench.exchange import card
    from retarget_bench.python.results import Results
    from retarget_bench.results import dataset_names

    results = Results(places).only(name)
    headers = dataset_names.headers(results.places)
    about = headers[results.places[0]].method
    if len(names := dataset_names.listed(headers)) > 1:
        raise BenchError(
            f"there are results of {about.label} on several data sets: {', '.join(names)}. A submission is "
            "of one; name it: -d"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchError(f"{folder} is not an empty folder; name a new one")
    text = card.begun(about, timing.rate(timing.read(results.places[-1])))
    results.save(folder)
    write_text(folder / card.CARD, text)
    echo(f"wrote {folder}. Fill in {folder / card.CARD}, then: bench submit {folder} --check")
    return 0


def _check(folder: Path, root: str | None) -> int:
    from retarget_bench.exchange.checking import check
    from retarget_bench.tables.model import count

    errors, warnings = check(folder, root)
    for line in (*(f"error: {each}" for each in errors), *(f"warning: {each}" for each in warnings)):
        echo(line)
    echo(f"{folder}: {count(len(errors), 'error') if errors else 'can be submitted'}")
    return int(bool(errors))


def _board(folder: Path, out: Path, root: str | None) -> int:
    from retarget_bench.exchange.leaderboard import leaderboard
    from retarget_bench.tables.rendering import WITH_INTERVALS

    form = out.suffix.lower().lstrip(".")
    if form not in ("html", "md", "tex", "csv"):
        raise BenchError(f"{out}: name a page that ends in .html, .md, .tex or .csv")
    tables, left_out = leaderboard(folder, root)
    for sentence in left_out:
        echo(sentence, err=True)
    write_text(out, WITH_INTERVALS[form](tables))
    echo(f"wrote {out}")
    return 0
