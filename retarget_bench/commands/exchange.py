"""Files for others (``bench data export``, ``bench export-cases``, ``bench submit``) and training data."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.plans import dataset_spec
from retarget_bench.python.progress import progress_bar

if TYPE_CHECKING:
    from retarget_bench.results.paths import ResultPaths

dataset_argument = click.argument(
    "dataset", metavar="DATASET", shell_complete=options.plugin_names("datasets")
)


@click.group("data")
def data() -> None:
    """Work with data sets themselves."""


@data.command("export")
@dataset_argument
@click.argument("folder", metavar="DIR", type=options.PATH)
@click.option(
    "--format",
    "form",
    type=click.Choice(["bvh", "glb"]),
    default="bvh",
    show_default=True,
    help="How motions are written.",
)
@options.root_option
def export_data(dataset: str, folder: Path, form: str, root: str | None) -> None:
    """Write a whole data set, references, labels and training clips included, as files.

    DIR/manifest.json lists characters, cases and files, DIR/SHA256SUMS their check sums. Interrupted, the
    same command goes on where it stopped; on a finished folder it checks every file and replaces what is
    damaged.
    """
    from retarget_bench.exchange import dataset_export

    spec = registry.canonical("datasets", dataset_spec(dataset, root))
    with progress_bar("bench data export", "clips") as progress:
        data = registry.create("datasets", spec)
        for done, total in dataset_export.export(data, str(spec), folder, form):
            progress(done, total)
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    echo(f"{folder}: {len(files)} files, {size:.0f} MB. Check them with: sha256sum -c SHA256SUMS")


@data.command("prepare")
@dataset_argument
@options.root_option
@options.jobs_option
def prepare_data(dataset: str, root: str | None, jobs: int) -> None:
    """Make the training motion and training pairs of a data set and keep them in the cache folder.

    Training makes what it needs by itself; this does it beforehand, in the background if you like.
    Interrupted, the same command goes on where it stopped.

    \b
    bench data prepare 'puppets[size=large,bodies=200]'
    """
    from retarget_bench.files import cache_folder
    from retarget_bench.motion.bvh.catalogue import some
    from retarget_bench.training.prepare import prepare

    spec, total = registry.canonical("datasets", dataset_spec(dataset, root)), 0
    unusable: list[str] = []
    with progress_bar("bench data prepare", "items") as progress:
        for done, total in prepare(spec, jobs, unusable):
            progress(done, total)
    if unusable:
        echo(f"left out: {len(unusable)} clips: {some(unusable, 10)}")
    echo(f"{spec}: {total} bodies and groups of pairs are in {cache_folder()}")


@click.command("export-cases")
@dataset_argument
@click.argument("folder", metavar="DIR", type=options.FOLDER)
@options.root_option
@options.split_option
def cases(dataset: str, folder: Path, root: str | None, splits: tuple[str, ...]) -> None:
    """Write a data set's sources and target characters as BVH and NumPy files, without any reference.

    DIR/manifest.json names every case and the file that its prediction is to be written to. Lengths are
    metres, Y is up, quaternions are w first.
    """
    from tqdm import tqdm

    from retarget_bench.api.datasets import chosen_splits
    from retarget_bench.exchange.case_export import export

    spec = registry.canonical("datasets", dataset_spec(dataset, root))
    source = registry.create("datasets", spec)
    infos = [info for split in chosen_splits(source, splits) for info in source.cases("retarget", split)]
    # where the files lie here says nothing to whoever reads the manifest
    name = Spec(spec.name, {key: value for key, value in spec.parameters.items() if key != "root"})
    for _ in tqdm(
        export(source, str(name), infos, folder), total=len(infos), unit="case", leave=False, disable=None
    ):
        pass
    sources = len({(info.source, info.clip) for info in infos})
    targets = len({info.target for info in infos})
    where = "" if spec == name else " --root DIR"
    echo(f"{folder}: {len(infos)} cases, {sources} source motions, {targets} target characters.")
    echo(f"Write the predictions beside manifest.json; then: bench score {folder}{where} --name METHOD")


@click.command("submit")
@click.argument("folder", metavar="DIR", type=options.PATH)
@click.option("--make", metavar="METHOD", help="Write a submission of this method's results into DIR.")
@click.option("--check", "checked", is_flag=True, help="Check the submission in DIR.")
@click.option("--board", is_flag=True, help="Draw the leaderboard of the submissions in DIR.")
@click.option(
    "--results",
    metavar="DIR",
    default="runs",
    show_default=True,
    type=options.PATH,
    help="With --make: where the results lie.",
)
@click.option(
    "-d",
    "--dataset",
    metavar="DATASET",
    help="With --make: the data set, where the method has results on several.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    default="leaderboard.html",
    show_default=True,
    type=options.FILE,
    help="With --board: the page, or a .md, .tex or .csv file.",
)
@options.root_option
def submit(
    folder: Path,
    make: str | None,
    checked: bool,
    board: bool,
    results: Path,
    dataset: str | None,
    output: Path,
    root: str | None,
) -> int:
    """Make (--make), check (--check) or show (--board) submissions to a leaderboard.

    A submission is a folder of results, as `bench run` and `bench score` write them, with a card.toml: who
    made the method, how it was trained, what it costs. --check exits 1 where something is wrong.
    """
    if (make is not None) + checked + board != 1:
        raise BenchError("say one of --make METHOD, --check and --board")
    if make is not None:
        return _make(folder, options.results([results], dataset), make)
    return _check(folder, root) if checked else _board(folder, output, root)


def _make(folder: Path, places: "list[ResultPaths]", name: str) -> int:
    from retarget_bench.evaluation import timing
    from retarget_bench.exchange import card
    from retarget_bench.python.results import Results
    from retarget_bench.results import dataset_names

    mine = Results(places).only(name)
    headers = dataset_names.headers(mine.places)
    about = headers[mine.places[0]].method
    if len(names := dataset_names.listed(headers)) > 1:
        raise BenchError(
            f"there are results of {about.label} on several data sets: {', '.join(names)}. A submission is "
            "of one; name it: -d"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BenchError(f"{folder} is not an empty folder; name a new one")
    mine.save(folder)
    card.write(folder, about, timing.rate(timing.read(mine.places[-1])))
    echo(f"wrote {folder}. Fill in {folder / card.CARD}, then: bench submit {folder} --check")
    return 0


def _check(folder: Path, root: str | None) -> int:
    from retarget_bench.exchange.checking import check

    errors, warnings = check(folder, root)
    for level, sentences in (("error", errors), ("warning", warnings)):
        for sentence in sentences:
            echo(f"{level}: {sentence}")
    echo(
        f"{folder}: "
        + (f"{len(errors)} error{'s' if len(errors) > 1 else ''}" if errors else "can be submitted")
    )
    return int(bool(errors))


def _board(folder: Path, output: Path, root: str | None) -> int:
    from retarget_bench.exchange.leaderboard import leaderboard
    from retarget_bench.tables.rendering import WITH_INTERVALS

    form = output.suffix.lower().lstrip(".")
    if form not in ("html", "md", "tex", "csv"):
        raise BenchError(f"{output}: name a page that ends in .html, .md, .tex or .csv")
    tables, left_out = leaderboard(folder, root)
    for sentence in left_out:
        echo(sentence, err=True)
    options.write_out(WITH_INTERVALS[form](tables), output)
    return 0
