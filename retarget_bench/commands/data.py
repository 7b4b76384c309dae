"""``bench data``: export of data sets, and training data made beforehand."""

from pathlib import Path

import click

from retarget_bench.commands import options
from retarget_bench.plugins import registry


@click.group("data")
def command() -> None:
    """Work with data sets themselves."""


@command.command("export")
@click.argument("dataset", metavar="DATASET", shell_complete=options.plugin_names("datasets"))
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--format",
    "form",
    type=click.Choice(["bvh"]),
    default="bvh",
    show_default=True,
    help="How motions are written.",
)
@options.root_option
@options.plugin_option
def export(dataset: str, folder: Path, form: str, root: str | None) -> None:
    """Write a whole data set, references, labels and training clips included, as files.

    DIR/manifest.json lists characters, cases and files, DIR/SHA256SUMS their check sums. Interrupted, the
    same command goes on where it stopped; on a finished folder it checks every file and replaces what is
    damaged.
    """
    del form
    from retarget_bench.exchange import dataset_export

    spec = registry.canonical("datasets", options.dataset_spec(dataset, root))
    data = registry.create("datasets", spec)
    with options.progress_bar("bench data export", "clip") as progress:
        for done, total in dataset_export.export(data, str(spec), folder):
            progress(done, total)
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    click.echo(f"{folder}: {len(files)} files, {size:.0f} MB. Check them with: sha256sum -c SHA256SUMS")


@command.command("prepare")
@click.argument("dataset", metavar="DATASET", shell_complete=options.plugin_names("datasets"))
@options.root_option
@options.jobs_option
@options.plugin_option
def prepare(dataset: str, root: str | None, jobs: int) -> None:
    """Make the training motion and training pairs of a data set and keep them in the cache folder.

    Training makes what it needs by itself; this does it beforehand, in the background if you like.
    Interrupted, the same command goes on where it stopped.

    \b
    bench data prepare 'puppets[size=large,bodies=200]'
    """
    from retarget_bench.files import cache_folder
    from retarget_bench.motion.bvh.catalogue import some
    from retarget_bench.training.prepare import prepare

    spec, total = registry.canonical("datasets", options.dataset_spec(dataset, root)), 0
    unusable: list[str] = []
    with options.progress_bar("bench data prepare", "item") as progress:
        for done, total in prepare(spec, jobs, unusable):
            progress(done, total)
    if unusable:
        click.echo(f"left out: {len(unusable)} clips: {some(unusable, 10)}")
    click.echo(f"{spec}: {total} bodies and groups of pairs are in {cache_folder()}")
