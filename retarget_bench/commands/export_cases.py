"""``bench export-cases``: cases as files, without references, for prediction by other programs."""

from pathlib import Path

import click

from retarget_bench.commands import options
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec


@click.command("export-cases")
@click.argument("dataset", metavar="DATASET", shell_complete=options.plugin_names("datasets"))
@click.argument("folder", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@options.root_option
@options.split_option
@options.plugin_option
def command(dataset: str, folder: Path, root: str | None, splits: tuple[str, ...]) -> None:
    """Write a data set's sources and target characters as BVH and NumPy files, without any reference.

    DIR/manifest.json names every case and the file that its prediction is to be written to. Lengths are
    metres, Y is up, quaternions are w first.
    """
    from tqdm import tqdm

    from retarget_bench.exchange.case_export import export

    spec = registry.canonical("datasets", options.dataset_spec(dataset, root))
    data = registry.create("datasets", spec)
    infos = [
        info for split in splits if split in data.card.splits for info in data.cases("retarget", split)
    ]
    # where the files lie here says nothing to whoever reads the manifest
    name = Spec(spec.name, {key: value for key, value in spec.parameters.items() if key != "root"})
    for _ in tqdm(
        export(data, str(name), infos, folder), total=len(infos), unit="case", leave=False, disable=None
    ):
        pass
    sources = len({(info.source, info.clip) for info in infos})
    targets = len({info.target for info in infos})
    where = "" if spec == name else " --root DIR"
    click.echo(f"{folder}: {len(infos)} cases, {sources} source motions, {targets} target characters.")
    click.echo(
        f"Write the predictions beside manifest.json; then: bench score {folder}{where} --name METHOD"
    )
