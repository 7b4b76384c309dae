"""``bench data``: export of data sets."""

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
